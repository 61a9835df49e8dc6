"""``dockpose study``: Monte Carlo on simulated scenes, every method on each, and a page on what comes of it."""

import argparse
import os

from dockpose.app.commands.arguments import add_options, check_least
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_STOPPED, EXIT_TERMINATED, Terminated, say
from dockpose.app.commands.progress import FrameProgress
from dockpose.app.processing.study import Study


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add those of ``dockpose study``."""
    add_options(parser, "study")
    add_options(parser.add_mutually_exclusive_group(), "study_workers", jobs={"default": os.cpu_count() or 1})
    add_options(parser, "study_output")


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
