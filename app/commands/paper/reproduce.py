"""``dockpose reproduce``: the paper's figures and tables beside ours, as one report."""

import argparse
import os

from dockpose.app.commands.arguments import add_options, check_least
from dockpose.app.commands.console import EXIT_ALL_READ, say
from dockpose.app.commands.progress import FrameProgress
from dockpose.app.export.reproduction.report import PARTS, reproduce


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add those of ``dockpose reproduce``."""
    add_options(parser, "reproduce", words={"parts": ", ".join(PARTS)}, jobs={"default": os.cpu_count() or 1})


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose reproduce``; returns the exit status."""
    check_least(arguments, seed=0, jobs=1)
    total = len(set(arguments.only)) or len(PARTS)
    with FrameProgress("reproduce", total=total, unit="parts") as progress:
        reproduce(arguments.out, arguments.seed, arguments.jobs, arguments.only, lambda key: progress.step(name=key))
    say(f"the report is {arguments.out / 'index.html'}")
    return EXIT_ALL_READ
