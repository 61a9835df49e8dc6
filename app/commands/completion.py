"""``dockpose completion``: what lets a shell complete the program's words, printed for it to read."""

import argparse
import re

from dockpose.app.commands.console import EXIT_ALL_READ, put_text
from dockpose.app.errors import UserError

_FOLDERS = re.compile(r"DIR|FOLDER|ROOT")
_FILES = re.compile(r"FILE|\.yaml|SOURCE|SESSION|PICTURE|VIDEO")


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose completion``; returns the exit status."""
    try:
        import shtab
    except ImportError as error:
        raise UserError("completion needs shtab: pip install 'dockpose[completion]'") from error
    program: argparse.ArgumentParser = arguments.program
    _mark_files(program, shtab.FILE, shtab.DIRECTORY)
    put_text(shtab.complete(program, shell=arguments.shell))
    return EXIT_ALL_READ


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
