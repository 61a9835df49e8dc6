"""``dockpose doctor``: whether all that dockpose needs is there and works, for a report of a fault."""

import argparse
import contextlib
from collections.abc import Iterator
from dataclasses import replace

from dockpose.app.commands.arguments import Commands, add_options
from dockpose.app.commands.console import EXIT_ALL_READ, put
from dockpose.app.commands.machine.checkup import BROKEN, CHECKS, Finding, without_home
from dockpose.app.commands.output import open_lines, write_line
from dockpose.checks import one_line

EXIT_BROKEN = 1


def add_parser(commands: Commands) -> None:
    """Add the command ``doctor``."""
    parser = commands.add_parser("doctor", help="check the installation, for a report of a fault")
    add_options(parser, "json")


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose doctor``; returns the exit status, which is 1 where something is broken."""
    broken = 0
    with contextlib.ExitStack() as files:
        lines = open_lines(arguments.json, files)
        for finding in findings():
            broken += finding.state == BROKEN
            if lines is not None:
                write_line(lines, {"check": finding.name, "state": finding.state, "text": finding.text} | finding.more)
            else:
                put(f"{finding.state:7} {finding.name:20} {finding.text}")
        if lines is None:
            put("nothing is broken" if not broken else f"{broken} broken, see above")
    return EXIT_BROKEN if broken else EXIT_ALL_READ


def findings() -> Iterator[Finding]:
    """Yield what each check finds; one that fails itself is broken."""
    for name, check in CHECKS.items():
        try:
            for finding in check():
                yield replace(finding, text=one_line(without_home(finding.text)))
        except Exception as error:  # whatever is wrong here is what people want to read
            yield Finding(name, BROKEN, one_line(without_home(f"{type(error).__name__}: {error}")))
