"""The program ``dockpose``: which command does the work, and its exit status."""

from __future__ import annotations

import argparse
import difflib
import glob
import os
import re
import sys
from collections.abc import Sequence
from importlib.metadata import version
from pathlib import Path

from dockpose.app.commands import compare, estimate, export, serve, simulate
from dockpose.app.commands.calibration import calibrate, learn_dock
from dockpose.app.commands.console import EXIT_BAD_ARGUMENTS, EXIT_STOPPED, say
from dockpose.app.commands.paper import budget, reproduce, study
from dockpose.app.commands.ros import command as ros
from dockpose.app.errors import UserError
from dockpose.app.inputs.samples import sample_source
from dockpose.thresholds.compiled import on_compiling

COMMANDS = {
    "serve": serve,
    "estimate": estimate,
    "compare": compare,
    "export": export,
    "simulate": simulate,
    "calibrate": calibrate,
    "learn-dock": learn_dock,
    "budget": budget,
    "reproduce": reproduce,
    "study": study,
    "ros": ros,
}
_COMPILING = "compiling the loops over pixels; the first run takes some seconds longer"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program. Returns its exit status: 0 all read, 1 some source could not be read, 2 bad arguments."""
    try:
        arguments = _parser().parse_args(_with_command(list(sys.argv[1:] if argv is None else argv)))
        with on_compiling(lambda: say(_COMPILING)):
            return arguments.run(arguments)
    except BrokenPipeError:  # the reader of our output went away, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1
    except (ValueError, OSError) as error:
        say(str(error))
        return EXIT_BAD_ARGUMENTS
    except KeyboardInterrupt:
        say("stopped")
        return EXIT_STOPPED


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


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="dockpose",
        description="Where is the dock? Position and attitude of a ring of lights from one camera image. "
        "Without a command the page in the browser is opened on a sample scene.",
    )
    parser.add_argument("--version", action="version", version=f"dockpose {version('dockpose')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    for command in COMMANDS.values():
        command.add_parser(commands)
    return parser


if __name__ == "__main__":
    sys.exit(main())
