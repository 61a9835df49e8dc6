"""``dockpose study``: Monte Carlo on simulated scenes, every method on each, and a page on what comes of it."""

from __future__ import annotations

import argparse
import os
import time
from pathlib import Path

from dockpose.app.commands.arguments import Commands
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_STOPPED, EXIT_TERMINATED, TerminalBar, Terminated, say
from dockpose.app.errors import UserError
from dockpose.app.processing.study import Study
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, TimeRemainingColumn

_EVERY_S = 10.0  # between two lines where there is no terminal


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
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose study``; returns the exit status."""
    for name, least in (("scenes", 1), ("seed", 0), ("jobs", 1)):
        if getattr(arguments, name) < least:
            raise UserError(f"--{name} is {getattr(arguments, name)}; it must be at least {least}")
    study = Study(arguments.out, arguments.scenes, arguments.seed)
    try:
        with SceneProgress(arguments.scenes) as progress:
            study.run(arguments.jobs, arguments.scheduler, progress.done)
    except KeyboardInterrupt as stopped:
        kept = f"{study.done} of {study.scenes} scenes are kept in {study.folder}"
        say(f"stopped; {kept}, and the same command goes on from there")
        return EXIT_TERMINATED if isinstance(stopped, Terminated) else EXIT_STOPPED
    # Matplotlib takes a while to load, which the other commands need not wait for.
    from dockpose.app.export.study.report import write_report

    say(f"the page is {write_report(study.folder)}")
    return EXIT_ALL_READ


class SceneProgress:
    """Shows how many scenes are done: a bar at a terminal, elsewhere a plain line every ten seconds."""

    def __init__(self, total: int) -> None:
        self._total, self._first = total, -1
        self._began_s = self._told_s = time.monotonic()
        console = Console(stderr=True)
        self._is_terminal = console.is_terminal
        columns = ("{task.description}", BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
        self._bar = TerminalBar(*columns, console=console, transient=True, disable=not self._is_terminal)
        self._task = self._bar.add_task("study", total=total)

    def __enter__(self) -> SceneProgress:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def done(self, count: int) -> None:
        """Tell how many scenes are done; the first call, how many an earlier run has left."""
        now_s = time.monotonic()
        if self._first < 0:
            self._first, self._began_s = count, now_s
            if count > 0:
                say(f"{count} of {self._total} scenes are done already")
        self._bar.update(self._task, completed=count)
        if self._is_terminal or now_s - self._told_s < _EVERY_S:
            return
        self._told_s = now_s
        a_second = (count - self._first) / max(now_s - self._began_s, 1e-9)
        left = f", {(self._total - count) / a_second:.0f} s left" if a_second > 0 else ""
        say(f"{count} of {self._total} scenes, {a_second:.1f} a second{left}")
