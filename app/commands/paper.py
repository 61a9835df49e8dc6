"""Tables and figures for papers: which errors a camera and a dock allow, the paper's results, the study of methods."""

import argparse
import contextlib
import csv
import itertools
import os
from collections.abc import Sequence

from dockpose import Camera, Dock
from dockpose.app.commands.arguments import camera_of, check_least, dock_of
from dockpose.app.commands.console import EXIT_ALL_READ, say
from dockpose.app.commands.output import Lines, open_lines
from dockpose.app.commands.progress import FrameProgress, put_rich, table_of_numbers
from dockpose.app.drawing.numbers import SIGMA_COLUMNS, TOTAL_COLUMNS
from dockpose.app.errors import UserError, blaming
from dockpose.app.export.parts import PARTS, reproduce, sentences
from dockpose.app.export.words import HEAD, TILTS_DEG, budget_cells, budget_sentences, usual_ranges_m
from dockpose.study.budget import USUAL_NOISE_PX, Budget, budget

_TILTS = ",".join(f"{tilt:g}" for tilt in TILTS_DEG)
KNOWN = {"jobs": {"default": os.cpu_count() or 1}, "noise": {"default": USUAL_NOISE_PX}}
KNOWN["words"] = {"tilts": _TILTS, "parts": ", ".join(PARTS)}


def run_budget(arguments: argparse.Namespace) -> int:
    """Run ``dockpose budget``; returns the exit status."""
    camera, dock = camera_of(arguments), dock_of(arguments)
    assert camera is not None
    assert dock is not None
    ranges_m, tilts_deg = _numbers("--ranges", arguments.ranges), _numbers("--tilts", arguments.tilts)
    with contextlib.ExitStack() as files:
        file = open_lines(arguments.csv, "--csv", files)
        with blaming("no error budget: "):
            rows = []
            for place in itertools.product(ranges_m or usual_ranges_m(camera, dock), tilts_deg or TILTS_DEG):
                rows.append(budget(camera, dock, *place, arguments.noise))
        if file is not None:
            _write(rows, file)
        if arguments.csv != "-":
            _print(camera, dock, rows, arguments)
    return EXIT_ALL_READ


def _write(rows: Sequence[Budget], file: Lines) -> None:
    writer = csv.writer(file, lineterminator="\n")
    writer.writerow(["range_m", "tilt_deg", "lights_apart_px", "in_view", *SIGMA_COLUMNS, "told_apart", *TOTAL_COLUMNS])
    for one in rows:
        place = one.range_m, one.tilt_deg, one.apart_px, int(one.in_view)
        writer.writerow([*place, *one.sigmas.tolist(), one.tells_apart, *one.totals.tolist()])  # None is empty


def _print(camera: Camera, dock: Dock, rows: Sequence[Budget], arguments: argparse.Namespace) -> None:
    table = table_of_numbers(HEAD)
    for number, one in enumerate(rows):
        is_last = number + 1 == len(rows) or rows[number + 1].range_m != one.range_m
        table.add_row(*budget_cells(one), end_section=is_last)
    set_up, *reach = budget_sentences(camera, dock, arguments.noise)
    put_rich(set_up, table, *reach, *sentences("budget.txt", "how"))


def _numbers(option: str, text: str | None) -> list[float]:
    try:
        return [] if text is None else [float(word) for word in text.split(",")]
    except ValueError as error:
        raise UserError(f"{option} {text} must be numbers with commas between them") from error


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
