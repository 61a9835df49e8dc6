"""The program ``dockpose``: which command does the work, and its exit status."""

import argparse
import difflib
import glob
import logging
import re
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path
from typing import NoReturn

from dockpose.app.commands import check, compare, console, estimate, export, ros, simulate
from dockpose.app.commands.arguments import protected
from dockpose.app.commands.calibration import calibrate, learn_dock
from dockpose.app.commands.logging_options import add_logging, logged
from dockpose.app.commands.machine import completion, doctor, serve
from dockpose.app.commands.paper import budget, reproduce, study
from dockpose.app.errors import OutputError, UserError
from dockpose.app.inputs.pictures import sample_source
from dockpose.checks import one_line
from dockpose.compiled import on_compiling
from dockpose.thresholds import METHODS

COMMANDS = {
    "serve": serve,
    "estimate": estimate,
    "compare": compare,
    "export": export,
    "simulate": simulate,
    "calibrate": calibrate,
    "learn-dock": learn_dock,
    "check": check,
    "budget": budget,
    "reproduce": reproduce,
    "study": study,
    "ros": ros,
    "doctor": doctor,
    "completion": completion,
}
_LOG = logging.getLogger("dockpose")
_COMPILING = "compiling the loops over pixels; the first run takes up to a minute longer"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program."""
    with console.forgiving_output(), console.stopped_by_signals(), METHODS.telling(_warn):
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


def _warn(text: str) -> None:
    console.say(text, logging.WARNING)


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
    for name, command in COMMANDS.items():
        command.add_parser(commands)
        add_logging(commands.choices[name])
        commands.choices[name].set_defaults(run=command.run, parser=commands.choices[name])
    parser.set_defaults(program=parser)  # which completion needs
    return parser


if __name__ == "__main__":
    sys.exit(main())
