"""An error budget in words and cells, for the terminal and the page."""

import math

import numpy as np
from dockpose import Camera, Dock
from dockpose.app.drawing.numbers import MISSING, length_words, number
from dockpose.app.export.parts import sentences
from dockpose.study.budget import (
    USUAL_NOISE_PX,
    Budget,
    farthest_apart_m,
    farthest_told_m,
    farthest_within_m,
    nearest_m,
)

TILTS_DEG = (0.0, 10.0, 20.0, 40.0)
_RANGES = 6
_GOOD_SHARE, _SURE = 0.05, 0.95  # of the range, and the chance, from which on the page warns
HEAD = (
    "range (m)",
    "tilt (°)",
    "lights apart (px)",
    "x, y (cm)",
    "range ± (cm)",
    "in all ± (cm)",
    "angles ± (°)",
    "told apart (%)",
)


def usual_ranges_m(camera: Camera, dock: Dock) -> list[float]:
    """Ranges from where the dock fills the picture to where its lights run together, to two digits."""
    near, far = nearest_m(camera, dock), farthest_apart_m(camera, dock)
    ranges = np.geomspace(near, max(far, 2 * near), _RANGES)
    return [float(f"{range_m:.2g}") for range_m in ranges]


def budget_cells(budget: Budget, simulated: Budget | None = None) -> list[str]:
    """Return the cells of ``HEAD``; what came out of simulation stands in brackets."""
    apart = f"{budget.apart_px:.0f}" + ("" if budget.lights_apart else " (merge)")
    pairs = zip(_numbers(budget), _numbers(simulated) if simulated else [""] * 5, strict=True)
    shown = [f"{one} ({other})" if other not in ("", MISSING) else one for one, other in pairs]
    tilt = f"{budget.tilt_deg:g}" + ("" if budget.in_view else " (not all in view)")
    return [f"{budget.range_m:g}", tilt, apart, *shown]


def _numbers(budget: Budget) -> list[str]:
    x, y, z = (100 * sigma for sigma in budget.sigma_position_m)
    angle = math.degrees(max(budget.sigma_theta_rad))
    told = None if budget.tells_apart is None else 100 * budget.tells_apart
    total_m = budget.sigma_total_position_m
    in_all = MISSING if total_m is None else _digits(100 * total_m[2])
    return [_digits(max(x, y)), _digits(z), in_all, _digits(angle), number(told, 0)]


def _digits(value: float) -> str:
    """Two significant digits, and no more than hundredths."""
    return number(value, 0 if value >= 10 else 1 if value >= 1 else 2)


def budget_sentences(camera: Camera, dock: Dock, noise_px: float = USUAL_NOISE_PX) -> list[str]:
    """Say whose budget it is, and up to where the dock's lights, its range and its attitude can be known."""
    apart, good = farthest_apart_m(camera, dock), farthest_within_m(camera, dock, _GOOD_SHARE, 20.0, noise_px)
    told = {tilt: farthest_told_m(camera, dock, _SURE, tilt, noise_px) for tilt in (10.0, 20.0)}
    return [
        *sentences("budget.txt", "set_up", camera, dock, length_words(dock.diameter), noise_px),
        *sentences("budget.txt", "reach", apart, good, _GOOD_SHARE, told, _SURE),
    ]
