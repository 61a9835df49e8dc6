"""``dockpose reproduce``: the paper's figures and tables beside ours, as one report."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from dockpose.app.commands.arguments import Commands, check_least
from dockpose.app.commands.console import EXIT_ALL_READ, FrameProgress, say
from dockpose.app.export.reproduction.report import PARTS, reproduce

SEED = 2016


def add_parser(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add the command ``reproduce``."""
    parser = commands.add_parser("reproduce", help="make the paper's figures and tables again, as one report")
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        default=Path("reproduction"),
        help="folder for index.html and the PNG, SVG and CSV of each part (default: reproduction)",
    )
    parser.add_argument("--seed", type=int, metavar="N", default=SEED, help=f"random seed (default: {SEED})")
    parser.add_argument(
        "--jobs", type=int, metavar="N", default=os.cpu_count() or 1, help="processes (default: one a core)"
    )
    parser.add_argument(
        "--only",
        metavar="PART",
        action="append",
        default=[],
        help=f"one part alone; may be repeated: {', '.join(PARTS)}",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose reproduce``; returns the exit status."""
    check_least(arguments, seed=0, jobs=1)
    total = len(set(arguments.only)) or len(PARTS)
    with FrameProgress("reproduce", total=total, unit="parts") as progress:
        reproduce(arguments.out, arguments.seed, arguments.jobs, arguments.only, lambda key: progress.step(name=key))
    say(f"the report is {arguments.out / 'index.html'}")
    return EXIT_ALL_READ
