"""The program ``dockpose``: which command does the work, and its exit status."""

import argparse
import atexit
import contextlib
import difflib
import functools
import gc
import glob
import logging
import os
import re
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NoReturn

import dockpose.app.commands.console as console
from dockpose import __version__
from dockpose.app.errors import OutputError, UserError
from dockpose.app.resources import read_toml
from dockpose.text import InputError, one_line

# What runs each command, in its module below ``commands``, which is loaded for that command alone.
COMMANDS = {
    "serve": "serve:run",
    "estimate": "estimate:run",
    "compare": "compare:run",
    "export": "export:run",
    "simulate": "simulate:run",
    "calibrate": "calibration:run_calibrate",
    "learn-dock": "calibration:run_learn_dock",
    "check": "check:run",
    "budget": "paper:run_budget",
    "reproduce": "paper:run_reproduce",
    "study": "paper:run_study",
    "ros": "ros:run",
    "doctor": "doctor:run",
}
_LOG = logging.getLogger("dockpose")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program."""
    os.environ.setdefault("OPENCV_LOG_LEVEL", "OFF")  # here and in other processes, before OpenCV is loaded
    if argv is None:
        atexit.register(gc.freeze)  # the system takes all memory back at once; Python would take a third of a second
    with console.forgiving_output(), console.stopped_by_signals():
        try:
            words = _with_command(list(sys.argv[1:] if argv is None else argv))
            if words[0] not in COMMANDS:
                _parser().parse_args(words)
            return _run_command(words)
        except (ValueError, OSError) as error:  # of the arguments themselves
            console.say(str(error), logging.ERROR)
            return console.EXIT_UNWRITABLE if isinstance(error, OutputError) else console.EXIT_BAD_ARGUMENTS
        except console.Terminated:
            return console.EXIT_TERMINATED
        except KeyboardInterrupt:
            return console.EXIT_STOPPED


def _run_command(words: Sequence[str]) -> int:
    """Load what a command needs, and run it."""
    with _uncollected():
        from dockpose.app.commands.arguments import logged, protect

        _loaded(words[0])
    if words[0] == "serve":
        from dockpose.app.commands.serve import of_environment

        words = ["serve", *of_environment(os.environ), *words[1:]]
    arguments = _parsed(words)
    protect(arguments)
    with logged(arguments):
        return _run(arguments)


def _loaded(name: str) -> tuple[Callable[[argparse.Namespace], int], Mapping[str, Any]]:
    """What runs a command, and what only its code knows of its options."""
    module, _, run = COMMANDS[name].partition(":")
    command = import_module(f"dockpose.app.commands.{module}")
    return getattr(command, run), getattr(command, "KNOWN", {})


@contextlib.contextmanager
def _uncollected() -> Iterator[None]:
    """Look for no garbage while modules are loaded, nor in them later: that takes long, and there is none."""
    gc.disable()
    try:
        yield
    finally:
        gc.freeze()
        gc.enable()


def _run(arguments: argparse.Namespace) -> int:
    """Run a command, noting when it begins and how it ends; returns the exit status."""
    from dockpose.compiled import on_compiling

    command = arguments.command
    _LOG.info("%s begins: dockpose %s", command, __version__)
    status = console.EXIT_BAD_ARGUMENTS
    try:
        with on_compiling(_say_once_that_it_compiles):
            status = arguments.run(arguments)
    except BrokenPipeError:  # the reader of our output went away, as `head` does
        status = console.EXIT_UNWRITABLE
    except OutputError as error:
        console.say(str(error), logging.ERROR)
        status = console.EXIT_UNWRITABLE
    except (ValueError, OSError) as error:
        console.say(str(error), logging.ERROR)
        if isinstance(error, InputError) and not isinstance(error, UserError):  # no argument is wrong, but a source
            status = console.EXIT_SOME_UNREADABLE
    except (KeyboardInterrupt, Exception) as error:
        try:
            is_ended = isinstance(console.stop_in(error), console.Terminated)
        except Exception:
            _LOG.exception("%s failed", command)
            raise
        console.say("ended by SIGTERM" if is_ended else "stopped", logging.WARNING)
        status = console.EXIT_TERMINATED if is_ended else console.EXIT_STOPPED
    _LOG.info("%s ends with status %d", command, status)
    return status


@functools.cache
def _say_once_that_it_compiles() -> None:
    console.say("compiling the loops over pixels, once; this first run takes up to half a minute longer")


def _with_command(words: list[str]) -> list[str]:
    """The words, with "serve" before them where they name no command. Raises UserError for a mistyped command."""
    first = words[0] if words else ""
    if first in COMMANDS or first in ("-h", "--help", "--version"):
        return words
    if first and not first.startswith("-") and not _is_source(first):
        near = difflib.get_close_matches(first, COMMANDS, 1, cutoff=0.5)
        hint = f"did you mean {near[0]}?" if near else f"there are {', '.join(COMMANDS)}"
        raise UserError(f"there is no command {first!r}, and no file of that name; {hint}")
    return ["serve", *words]


def _is_source(word: str) -> bool:
    """Whether a word has the look of a file, a camera's number or an address, or names a sample."""
    from dockpose.sidecar import sample_source

    return bool(re.search(r"[./\\\d]|://", word)) or glob.has_magic(word) or Path(sample_source(word)).exists()


class _Parser(argparse.ArgumentParser):
    """Says in one line what is wrong, rather than after a list of all options."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong with the arguments, and exit."""
        self.exit(
            console.EXIT_BAD_ARGUMENTS, f"{self.prog}: {one_line(message)} ({self.prog} --help lists the options)\n"
        )


def _parsed(words: Sequence[str]) -> argparse.Namespace:
    """The arguments that the words of a command are; what it does not know ends the program."""
    parser = _parser(*words[:1])
    arguments, unknown = parser.parse_known_args(words)
    if unknown:
        command: argparse.ArgumentParser = arguments.parser
        near = difflib.get_close_matches(unknown[0].partition("=")[0], command._option_string_actions, 1, cutoff=0.75)
        what = (
            f"there is no option {unknown[0]}" if unknown[0].startswith("-") else f"{unknown[0]!r} is one word too many"
        )
        command.error(f"{what}; did you mean {near[0]}?" if near else what)
    return arguments


def _parser(*loaded: str) -> argparse.ArgumentParser:
    """The parser of the program, which knows the options of those commands alone."""
    parser = _Parser(
        prog="dockpose",
        description="Where is the dock? Position and attitude of a ring of lights from one camera image. "
        "Without a command the page in the browser is opened on a sample scene.",
    )
    parser.add_argument("--version", action="version", version=f"dockpose {__version__}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="command", title="commands")
    for name in COMMANDS:
        about = read_toml("options.toml")["commands"][name]
        command = commands.add_parser(name, help=about["help"], description=about.get("description"))
        if name in loaded:
            from dockpose.app.commands.arguments import add_command

            run, known = _loaded(name)
            add_command(command, name, known)
            command.set_defaults(run=run, parser=command)
    return parser


if __name__ == "__main__":
    sys.exit(main())
