"""``dockpose reproduce``: the paper's figures and tables beside ours, as one report."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from dockpose.app.commands.arguments import Commands
from dockpose.app.commands.console import EXIT_ALL_READ, TerminalBar, say
from dockpose.app.errors import UserError
from dockpose.app.export.reproduction.report import PARTS, reproduce
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TimeElapsedColumn

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
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose reproduce``; returns the exit status."""
    for name in ("seed", "jobs"):
        if getattr(arguments, name) < (name == "jobs"):
            raise UserError(f"--{name} is {getattr(arguments, name)}; it must be at least {int(name == 'jobs')}")
    console = Console(stderr=True)
    total = len(set(arguments.only)) or len(PARTS)
    columns = ("{task.description}", BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with TerminalBar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("reproduce", total=total)
        count = 0

        def done(key: str) -> None:
            nonlocal count
            count += 1
            bar.update(task, completed=count, description=key)
            if not console.is_terminal:
                say(f"{key} ({count} of {total})")

        reproduce(arguments.out, arguments.seed, arguments.jobs, tuple(arguments.only), done)
    say(f"the report is {arguments.out / 'index.html'}")
    return EXIT_ALL_READ
