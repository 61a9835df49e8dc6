"""The error budget beside Tables 2 to 4: what a believable camera, ring and picture would bring."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREY, ORANGE, VERMILLION
from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.reproduction.part import Cell, NumberTable, Part, Plot
from dockpose.paper.tables import COLUMNS, TABLES
from dockpose.paper.tank import error_budget as budgets
from dockpose.paper.tank.calibrations import BOARD, VIEWS
from dockpose.paper.tank.error_budget import ITEMS, Budget, poses_of_tables, reading_steps

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_PICTURES = {
    "quiet": "picture without noise",
    "noise": f"noise of {budgets.READ_NOISE_LEVELS:g} grey levels, and shot noise",
    "jpeg": f"JPEG of quality {budgets.JPEG_QUALITY}",
    "both": "noise and JPEG",
}
_NAMES = ("x", "y", "z", "theta x", "theta y")


def error_budget(seed: int) -> Part:
    """Make the error budget."""
    return part_of(budgets.error_budget(seed))


def part_of(budget: Budget) -> Part:
    """The part for a budget."""
    return Part(
        key="error_budget",
        title="Error budget of Tables 2 to 4: a believable camera beside the exact one",
        paper=(
            f"The {len(poses_of_tables()[0])} poses of Tables 2 to 4 together: root mean square errors of "
            f"{_in_words(_rms(poses_of_tables()[1]))}. How they come about is not known to us, nor how well its "
            "calibration, its ring and its measurements were known."
        ),
        ours=_ours(budget),
        differs=_differs(budget),
        plots=[
            Plot.of(
                "error_budget",
                "Root mean square error that each thing brings alone, all of them together, and the paper's, over the "
                "poses of Tables 2 to 4.",
                _figure(budget),
            )
        ],
        tables=[_budget_table(budget), _by_table(budget), _cameras(budget)],
    )


def _rms(errors: np.ndarray) -> np.ndarray:
    """Root mean squares (5,) over all but the last axis."""
    return np.sqrt(np.nanmean(errors.reshape(-1, 5) ** 2, axis=0))


def _rounded(errors: np.ndarray) -> list[float]:
    """Errors to a micrometre and a ten-thousandth of a degree."""
    return np.round(errors, 4).tolist()


def _in_words(errors: np.ndarray) -> str:
    x, y, z, theta_x, theta_y = (f"{error:.2g}" for error in errors)
    return f"{x}, {y} and {z} cm in x, y and z, and {theta_x} and {theta_y} degrees in theta x and theta y"


def _sigmas(budget: Budget) -> dict[str, float]:
    """Standard deviations of what the calibrations find."""
    names = ("fx", "fy", "cx", "cy")
    found = {name: float(np.std([getattr(camera, name) for camera in budget.cameras])) for name in names}
    distortion = np.std([camera.distortion for camera in budget.cameras], axis=0)
    return found | {"k1": float(distortion[0]), "k2": float(distortion[1])}


def _ours(budget: Budget) -> str:
    sigma, port = _sigmas(budget), budgets.CAMERA.port
    assert port is not None
    largest = {
        name: max(
            ((key, float(_rms(budget.items[key])[k])) for key in ITEMS if key != "ignored"), key=lambda one: one[1]
        )
        for k, name in enumerate(_NAMES)
    }
    angles = max((largest["theta x"], largest["theta y"]), key=lambda one: one[1])
    return (
        f"The camera looks through a flat port ({1000 * port.air_gap_m:.0f} mm of air, {1000 * port.glass_m:.0f} mm "
        f"of glass) and has a lens with distortion (k1 {budgets.CAMERA.distortion[0]:g}, k2 "
        f"{budgets.CAMERA.distortion[1]:g}). How well it is known was simulated: {VIEWS} pictures of a chessboard of "
        f"{BOARD.columns} x {BOARD.rows} squares, rendered and calibrated as by dockpose calibrate, leave "
        f"{budget.corner_px:.2f} px in a corner's x and y; {len(budget.cameras)} further calibrations with errors of "
        f"that size scatter by {sigma['fx']:.2f} px in the focal length, {sigma['cx']:.2f} and {sigma['cy']:.2f} px "
        f"in the centre, {sigma['k1']:.4f} in k1 and {sigma['k2']:.4f} in k2. Lights, diameter and air gap are off by "
        f"a normal error of 1 mm. With all of it at once, and the {budget.centroid_px:.3f} px by which the centres of "
        f"lights are off in pictures with noise and JPEG: {_in_words(_rms(budget.together))}. The right one of the "
        f"two poses is chosen in {100 * budget.right:.1f} %. The largest part of z comes from: "
        f"{ITEMS[largest['z'][0]]} ({largest['z'][1]:.2f} cm); that of the angles from: {ITEMS[angles[0]]} "
        f"({angles[1]:.2f} degrees). Not in the sum is a mistake: ignoring the distortion would bring "
        f"{_in_words(_rms(budget.items['ignored']))}."
    )


def _differs(budget: Budget) -> str:
    paper, together = _rms(poses_of_tables()[1]), _rms(budget.together)
    reading = reading_steps() / np.sqrt(12)
    total = np.hypot(together, reading)
    steps = reading_steps()

    def shares(values: np.ndarray) -> str:
        return ", ".join(f"{name} {100 * share:.0f} %" for name, share in zip(_NAMES, values / paper, strict=True))

    pictures = _rms(budget.pictures["both"])
    return (
        f"Of the paper's root mean square errors these tolerances reach: {shares(together)}. Hand measurements "
        f"printed in steps of {steps[0]:g} cm and {steps[3]:g} degrees cannot be better than {reading[0]:.2f} cm and "
        f"{reading[3]:.2f} degrees, for their rounding alone; with that it is {shares(total)}. So a millimetre here "
        f"and there accounts for much of the angles, and less of the positions. {_by_table_in_words(budget)} What "
        "remains may be a tape and a protractor that are read less well than their last digit, a tank whose axes are "
        "not those of the camera, a water or port that were not modelled, or the paper's method; its tables cannot "
        f"tell these apart. The pictures themselves hardly count: noise and JPEG bring {_in_words(pictures)}, through "
        "the whole pipeline. Our calibration is a good one, of a flat board and a lens that obeys its model; a real "
        "one is worse. The tolerances are our guess of a usual tank, not the paper's. Errors are of the candidate "
        "nearer to the truth; those of camera, ring and port are computed for projected lights, those of pictures on "
        "rendered ones."
    )


def _mean_absolute(errors: np.ndarray) -> dict[str, np.ndarray]:
    """Mean absolute errors (5,) of each table, of errors (draws, 12, 5)."""
    found, first = {}, 0
    for name, table in TABLES.items():
        found[name] = np.nanmean(np.abs(errors[:, first : first + len(table.measured)]), axis=(0, 1))
        first += len(table.measured)
    return found


def _by_table_in_words(budget: Budget) -> str:
    """Where the believable camera and ring are worse than the paper."""
    ours, worse = _mean_absolute(budget.together), []
    for name, table in TABLES.items():
        for k, column in enumerate(_NAMES):
            if ours[name][k] > table.mean_errors[k]:
                worse.append(f"{column} of Table {name} ({ours[name][k]:.2g} against {table.mean_errors[k]:.2g})")
    if not worse:
        return "In no column of the three tables do they exceed the paper's mean absolute error."
    return (
        f"It is more than the paper has in {', '.join(worse)}: there the paper's ring was closer to its drawing than a "
        "millimetre, or its errors happened to be small."
    )


def _budget_table(budget: Budget) -> NumberTable:
    rows: list[list[Cell]] = [[words, *_rounded(_rms(budget.items[key]))] for key, words in ITEMS.items()]
    rows += [[words, *_rounded(_rms(budget.pictures[key]))] for key, words in _PICTURES.items()]
    together = _rms(budget.together)
    reading = reading_steps() / np.sqrt(12)
    rows.append(["all together, without ignored distortion", *_rounded(together)])
    rows.append(["rounding of the measured values", *_rounded(reading)])
    rows.append(["all together, and rounding", *_rounded(np.hypot(together, reading))])
    rows.append(["the paper", *_rounded(_rms(poses_of_tables()[1]))])
    caption = (
        "Root mean square errors over the poses of Tables 2 to 4. All together: both of the calibration, lights off "
        "along and across the ring, diameter, port, and the centres' errors by noise and JPEG."
    )
    return NumberTable("error_budget", caption, ["what is off", *COLUMNS], rows, digits=2)


def _by_table(budget: Budget) -> NumberTable:
    rows: list[list[Cell]] = []
    believable, exact = _mean_absolute(budget.together), _mean_absolute(budget.pictures["both"])
    for name, table in TABLES.items():
        rows.append([f"Table {name}: the paper", *_rounded(table.mean_errors)])
        rows.append([f"Table {name}: ours, believable camera and ring", *_rounded(believable[name])])
        rows.append([f"Table {name}: ours, all known exactly, noise and JPEG", *_rounded(exact[name])])
    return NumberTable("error_budget_tables", "Mean absolute errors.", ["table", *COLUMNS], rows, digits=2)


def _cameras(budget: Budget) -> NumberTable:
    head = ["calibration", "fx (px)", "fy (px)", "cx (px)", "cy (px)", "k1", "k2", "p1", "p2", "k3"]
    rows = [
        [number, camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion]
        for number, camera in enumerate(budget.cameras, start=1)
    ]
    return NumberTable("error_budget_calibrations", "The calibrated cameras.", head, rows, is_shown=False)


def _figure(budget: Budget) -> Figure:
    bars = [(words, _rms(budget.items[key]), BLUE) for key, words in ITEMS.items()]
    bars.append((_PICTURES["both"], _rms(budget.pictures["both"]), BLUE))
    bars.append(("all together", _rms(budget.together), ORANGE))
    bars.append(("rounding of the measured values", reading_steps() / np.sqrt(12), GREY))
    bars.append(("the paper", _rms(poses_of_tables()[1]), VERMILLION))
    figure = new_figure(8.0, 4.6)
    figure.set_layout_engine("constrained")
    panels = figure.subplots(1, 5, sharey=True)
    places = np.arange(len(bars))
    for k, axes in enumerate(panels):
        axes.barh(places, [values[k] for _, values, _ in bars], color=[colour for _, _, colour in bars])
        axes.set_title(COLUMNS[k], fontsize=9)
        axes.set_xlim(0, 1.2 * max(values[k] for _, values, _ in bars))
        axes.locator_params(axis="x", nbins=3)
        axes.grid(axis="x", lw=0.4, color="0.85")
        axes.set_axisbelow(True)
    panels[0].set_yticks(places, [words for words, _, _ in bars])
    panels[0].invert_yaxis()
    figure.supxlabel("root mean square error", fontsize=9)
    return figure
