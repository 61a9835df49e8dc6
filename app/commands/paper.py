"""Tables and figures for papers: the paper's results, and the study of methods."""

import argparse
import os

from dockpose.app.commands.arguments import check_least
from dockpose.app.commands.console import EXIT_ALL_READ, say
from dockpose.app.commands.progress import FrameProgress
from dockpose.app.export.parts import PARTS, reproduce

KNOWN = {"jobs": {"default": os.cpu_count() or 1}, "words": {"parts": ", ".join(PARTS)}}


def run_reproduce(arguments: argparse.Namespace) -> int:
    """Run ``dockpose reproduce``; returns the exit status."""
    check_least(arguments, seed=0, jobs=1)
    total, given = len(set(arguments.only)) or len(PARTS), (arguments.seed, arguments.jobs, arguments.only)
    with FrameProgress("reproduce", total=total, unit="parts") as progress:
        page = reproduce(arguments.out, *given, lambda key: progress.step(name=key))
    say(f"the page is {page}")
    return EXIT_ALL_READ


def run_study(arguments: argparse.Namespace) -> int:
    """Run ``dockpose study``; returns the exit status."""
    check_least(arguments, scenes=1, seed=0, jobs=1)
    # Matplotlib takes a while to load, which the other commands need not wait for.
    from dockpose.app.export.study.report import study

    given = arguments.out, arguments.scenes, arguments.seed, arguments.jobs
    with FrameProgress("study", total=arguments.scenes, unit="scenes") as progress:
        page = study(*given, progress.step)
    say(f"the page is {page}")
    return EXIT_ALL_READ
