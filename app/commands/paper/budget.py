"""``dockpose budget``: which errors a camera and a dock allow, by range and tilt."""

import argparse
import contextlib
import csv
import itertools
import math
from collections.abc import Sequence

from dockpose import Camera, Dock
from dockpose.app.commands.arguments import add_options, camera_of, dock_of
from dockpose.app.commands.console import EXIT_ALL_READ
from dockpose.app.commands.output import Lines, open_lines
from dockpose.app.commands.progress import put_rich
from dockpose.app.errors import UserError, blaming
from dockpose.app.export.budget import HEAD, TILTS_DEG, budget_cells, budget_sentences, usual_ranges_m
from dockpose.app.export.parts import sentences
from dockpose.study.budget import USUAL_NOISE_PX, Budget, budget, simulated_budget
from rich import box
from rich.table import Table

_COLUMNS = ("sigma_x_m", "sigma_y_m", "sigma_z_m", "sigma_theta_x_deg", "sigma_theta_y_deg", "told_apart")
_TOTAL_COLUMNS = tuple(name.replace("sigma", "sigma_total") for name in _COLUMNS[:5])


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add those of ``dockpose budget``."""
    tilts = ",".join(f"{tilt:g}" for tilt in TILTS_DEG)
    add_options(parser, "budget", words={"tilts": tilts}, noise={"default": USUAL_NOISE_PX})
    parser.set_defaults(dock=None)  # the budget is of lights that are evenly spaced


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose budget``; returns the exit status."""
    camera, dock = camera_of(arguments), dock_of(arguments)
    assert camera is not None
    assert dock is not None
    ranges_m, tilts_deg = _numbers("--ranges", arguments.ranges), _numbers("--tilts", arguments.tilts)
    with contextlib.ExitStack() as files:
        file = open_lines(arguments.csv, files)
        with blaming("no error budget: "):
            rows = []
            for place in itertools.product(ranges_m or usual_ranges_m(camera, dock), tilts_deg or TILTS_DEG):
                asked = (camera, dock, *place, arguments.noise)
                rows.append((budget(*asked), simulated_budget(*asked, arguments.draws, arguments.seed)))
        if file is not None:
            _write(rows, file)
        if arguments.csv != "-":
            _print(camera, dock, rows, arguments)
    return EXIT_ALL_READ


def _write(rows: Sequence[tuple[Budget, Budget]], file: Lines) -> None:
    writer = csv.writer(file, lineterminator="\n")
    simulated = [f"simulated_{name}" for name in _COLUMNS]
    writer.writerow(["range_m", "tilt_deg", "lights_apart_px", "in_view", *_COLUMNS, *simulated, *_TOTAL_COLUMNS])
    for one, other in rows:
        total = (*(one.sigma_total_position_m or ()), *map(math.degrees, one.sigma_total_theta_rad or ()))
        place = one.range_m, one.tilt_deg, one.apart_px, int(one.in_view)
        writer.writerow([*place, *_values(one), *_values(other), *total])


def _values(one: Budget) -> list[float | str]:
    chance = "" if one.tells_apart is None else one.tells_apart
    return [*one.sigma_position_m, *map(math.degrees, one.sigma_theta_rad), chance]


def _print(camera: Camera, dock: Dock, rows: Sequence[tuple[Budget, Budget]], arguments: argparse.Namespace) -> None:
    table = Table(box=box.SIMPLE)
    for name in HEAD:
        table.add_column(name, justify="right")
    for number, (one, other) in enumerate(rows):
        is_last = number + 1 == len(rows) or rows[number + 1][0].range_m != one.range_m
        table.add_row(*budget_cells(one, other), end_section=is_last)
    set_up, *reach = budget_sentences(camera, dock, arguments.noise)
    put_rich(set_up, table, *reach, *sentences("budget.txt", "how", arguments.draws))


def _numbers(option: str, text: str | None) -> list[float]:
    try:
        return [] if text is None else [float(word) for word in text.split(",")]
    except ValueError as error:
        raise UserError(f"{option} {text} must be numbers with commas between them") from error
