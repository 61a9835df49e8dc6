"""``dockpose study``: Monte Carlo on simulated scenes, every method on each, and a page on what comes of it."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from dockpose.app.commands.arguments import Commands, check_least
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_STOPPED, EXIT_TERMINATED, FrameProgress, Terminated, say
from dockpose.app.processing.study import Study


def add_parser(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add the command ``study``."""
    parser = commands.add_parser("study", help="try all methods on simulated scenes drawn at random, and compare them")
    parser.add_argument("--scenes", type=int, metavar="N", required=True, help="number of scenes")
    parser.add_argument("--seed", type=int, metavar="S", required=True, help="random seed")
    where = parser.add_mutually_exclusive_group()
    where.add_argument(
        "--jobs", type=int, metavar="N", default=os.cpu_count() or 1, help="processes (default: one a core)"
    )
    where.add_argument(
        "--scheduler", metavar="ADDRESS", help="work on the Dask cluster at this address, as tcp://127.0.0.1:8786"
    )
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=Path,
        default=Path("study"),
        help="folder for study.csv, cost.csv, index.html and plots; a study that was stopped goes on in it "
        "(default: study)",
    )


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose study``; returns the exit status."""
    check_least(arguments, scenes=1, seed=0, jobs=1)
    study = Study(arguments.out, arguments.scenes, arguments.seed)
    try:
        with FrameProgress("study", total=arguments.scenes, unit="scenes") as progress:
            study.run(arguments.jobs, arguments.scheduler, progress.reach)
    except KeyboardInterrupt as stopped:
        kept = f"{study.done} of {study.scenes} scenes are kept in {study.folder}"
        say(f"stopped; {kept}, and the same command goes on from there")
        return EXIT_TERMINATED if isinstance(stopped, Terminated) else EXIT_STOPPED
    # Matplotlib takes a while to load, which the other commands need not wait for.
    from dockpose.app.export.study.report import write_report

    say(f"the page is {write_report(study.folder)}")
    return EXIT_ALL_READ
