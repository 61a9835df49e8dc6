"""The program ``dockpose``: which command does the work, and its exit status."""

import argparse
import difflib
import functools
import glob
import logging
import re
import sys
from collections.abc import Callable, Mapping, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, NoReturn

import dockpose.app.commands.console as console
from dockpose.app.commands import calibration, check, compare, doctor, estimate, export, paper, ros, serve, simulate
from dockpose.app.commands.arguments import add_command, logged, protected
from dockpose.app.errors import OutputError, UserError
from dockpose.app.inputs.pictures import sample_source
from dockpose.app.resources import read_toml
from dockpose.checks import one_line
from dockpose.compiled import on_compiling
from dockpose.thresholds import METHODS

_FOLDERS = re.compile(r"DIR|FOLDER|ROOT")
_FILES = re.compile(r"FILE|\.yaml|SOURCE|SESSION|PICTURE|VIDEO")
_LOG = logging.getLogger("dockpose")
_COMPILING = "compiling the loops over pixels; the first run takes up to a minute longer"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program."""
    warn = functools.partial(console.say, level=logging.WARNING)
    with console.forgiving_output(), console.stopped_by_signals(), METHODS.telling(warn):
        try:
            arguments = _parsed(_with_command(list(sys.argv[1:] if argv is None else argv)))
            with protected(arguments), logged(arguments):
                return _run(arguments)
        except (ValueError, OSError) as error:  # of the arguments themselves
            console.say(str(error), logging.ERROR)
            return console.EXIT_BAD_ARGUMENTS
        except console.Terminated:
            return console.EXIT_TERMINATED
        except KeyboardInterrupt:
            return console.EXIT_STOPPED


def _run(arguments: argparse.Namespace) -> int:
    """Run a command, noting when it begins and how it ends; returns the exit status."""
    command = arguments.command
    _LOG.info("%s begins: dockpose %s", command, version("dockpose"))
    status = console.EXIT_BAD_ARGUMENTS
    try:
        with on_compiling(lambda: console.say(_COMPILING)):
            status = arguments.run(arguments)
    except BrokenPipeError:  # the reader of our output went away, as `head` does
        status = console.EXIT_UNWRITABLE
    except OutputError as error:
        console.say(str(error), logging.ERROR)
        status = console.EXIT_UNWRITABLE
    except (ValueError, OSError) as error:
        console.say(str(error), logging.ERROR)
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
    return bool(re.search(r"[./\\\d]|://", word)) or glob.has_magic(word) or Path(sample_source(word)).exists()


class _Parser(argparse.ArgumentParser):
    """Says in one line what is wrong, rather than after a list of all options."""

    def error(self, message: str) -> NoReturn:
        """Say what is wrong with the arguments, and exit."""
        self.exit(
            console.EXIT_BAD_ARGUMENTS, f"{self.prog}: {one_line(message)} ({self.prog} --help lists the options)\n"
        )


def _parsed(words: list[str]) -> argparse.Namespace:
    """The arguments that the words of a command are; what it does not know ends the program."""
    parser = _parser()
    arguments, unknown = parser.parse_known_args(words)
    if unknown:
        command: argparse.ArgumentParser = arguments.parser
        near = difflib.get_close_matches(unknown[0].partition("=")[0], command._option_string_actions, 1, cutoff=0.75)
        what = (
            f"there is no option {unknown[0]}" if unknown[0].startswith("-") else f"{unknown[0]!r} is one word too many"
        )
        command.error(f"{what}; did you mean {near[0]}?" if near else what)
    return arguments


def _parser() -> argparse.ArgumentParser:
    parser = _Parser(
        prog="dockpose",
        description="Where is the dock? Position and attitude of a ring of lights from one camera image. "
        "Without a command the page in the browser is opened on a sample scene.",
    )
    parser.add_argument("--version", action="version", version=f"dockpose {version('dockpose')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND", dest="command", title="commands")
    for name, (run, known) in COMMANDS.items():
        about = read_toml("options.toml")["commands"][name]
        command = commands.add_parser(name, help=about["help"], description=about.get("description"))
        add_command(command, name, known)
        command.set_defaults(run=run, parser=command)
    parser.set_defaults(program=parser)  # which completion needs
    return parser


def _run_completion(arguments: argparse.Namespace) -> int:
    """Run ``dockpose completion``; returns the exit status."""
    try:
        import shtab
    except ImportError as error:
        raise UserError("completion needs shtab: pip install 'dockpose[completion]'") from error
    program: argparse.ArgumentParser = arguments.program
    _mark_files(program, shtab.FILE, shtab.DIRECTORY)
    console.put_text(shtab.complete(program, shell=arguments.shell))
    return console.EXIT_ALL_READ


def _mark_files(parser: argparse.ArgumentParser, file: object, folder: object) -> None:
    """Say which arguments are files and folders, by what the help calls them; a file may be in any folder."""
    for action in parser._actions:
        if isinstance(action, argparse._SubParsersAction):
            for one in dict.fromkeys(action.choices.values()):
                _mark_files(one, file, folder)
            continue
        name = action.metavar if isinstance(action.metavar, str) else ""
        if _FILES.search(name):
            action.complete = file  # pyright: ignore[reportAttributeAccessIssue]  # as shtab wants it
        elif _FOLDERS.search(name):
            action.complete = folder  # pyright: ignore[reportAttributeAccessIssue]


# What runs each command, and what only code knows of its options.
COMMANDS: dict[str, tuple[Callable[[argparse.Namespace], int], Mapping[str, Any]]] = {
    "serve": (serve.run, serve.KNOWN),
    "estimate": (estimate.run, estimate.KNOWN),
    "compare": (compare.run, {}),
    "export": (export.run, export.KNOWN),
    "simulate": (simulate.run, {}),
    "calibrate": (calibration.run_calibrate, calibration.KNOWN),
    "learn-dock": (calibration.run_learn_dock, {}),
    "check": (check.run, check.KNOWN),
    "budget": (paper.run_budget, paper.KNOWN),
    "reproduce": (paper.run_reproduce, paper.KNOWN),
    "study": (paper.run_study, paper.KNOWN),
    "ros": (ros.run, ros.KNOWN),
    "doctor": (doctor.run, {}),
    "completion": (_run_completion, {}),
}

if __name__ == "__main__":
    sys.exit(main())
