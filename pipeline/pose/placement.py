"""Which of a dock's lights points around a ring are, by their spacing."""

import math
from dataclasses import dataclass

import numpy as np
from dockpose.dock import Dock

# Of the spacing, root mean square: how far off even spacing all lights of a dock may be for it to tell anything; their
# order says which each is.
_IN_ORDER_WITHIN = 0.3
WITHIN = 0.25  # of the mean spacing: points farther than this from every light are not the dock's
_WORTH = 1.0  # penalty for a light that two points are, in squared mean spacings: more than the largest allowed offset


@dataclass(frozen=True)
class Placement:
    """The lights that N points are, on each of K candidates."""

    lights: np.ndarray  # (K, N): numbers of the lights
    rolls_rad: np.ndarray  # (K,): roll of the dock that brings its lights closest to the points
    angles_rad: np.ndarray  # (K, N): angles of the lights at that roll
    fits: list[bool]  # for each candidate, whether every point is near its light and no two share one
    period_rad: float  # the roll is known modulo this


def place(points_rad: np.ndarray, dock: Dock) -> Placement:
    """Find the lights that points at angles (K, N) around the ring are, on each of K candidates."""
    if not dock.angles_deg:
        count = dock.lights or points_rad.shape[1]
        lights, rolls, angles, fits = _on_even_ring(points_rad, count, dock.lights == points_rad.shape[1])
        return Placement(lights, rolls, angles, fits.tolist(), 2 * math.pi / count)
    known = dock.light_angles_rad()
    placed, rolls, fits = zip(*(_place_known(row, known) for row in points_rad), strict=True)
    lights, rolls = np.array(placed), np.array(rolls)
    return Placement(lights, rolls, known[lights] + rolls[:, None], list(fits), 2 * math.pi)


def _on_even_ring(
    points: np.ndarray, count: int, are_all: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What :class:`Placement` has, by the common phase of the points' angles, modulo the spacing.

    If these are all of the dock's lights, their order may say which each is.
    """
    step = 2 * math.pi / count
    rolls = np.arctan2(np.sin(count * points).sum(axis=1), np.cos(count * points).sum(axis=1)) / count
    slots = (points - rolls[:, None]) / step
    nearest = np.rint(slots)
    lights, angles = nearest.astype(int) % count, rolls[:, None] + step * nearest
    sorted_lights = np.sort(lights, axis=1)
    are_others = (sorted_lights[:, 1:] > sorted_lights[:, :-1]).all(axis=1)
    fits = are_others & (np.abs(slots - nearest) < WITHIN).all(axis=1)
    for row in np.flatnonzero(~fits) if are_all else ():
        lights[row] = points[row].argsort().argsort()
        rolls[row] = (points[row] - step * lights[row]).mean()
        angles[row] = rolls[row] + step * lights[row]
        fits[row] = np.sqrt(np.mean((points[row] - angles[row]) ** 2)) < _IN_ORDER_WITHIN * step
    return lights, rolls, angles, fits


def _place_known(points_rad: np.ndarray, known_rad: np.ndarray) -> tuple[np.ndarray, float, bool]:
    """Lights (N,), roll, and whether they fit: the best of all rolls that bring some light to the first point."""
    step = 2 * math.pi / len(known_rad)
    rolls = points_rad[0] - known_rad
    off = points_rad[None, :, None] - known_rad - rolls[:, None, None]
    off = (off + math.pi) % (2 * math.pi) - math.pi
    lights = np.argmin(np.abs(off), axis=2)
    row, column = np.ogrid[: len(rolls), : len(points_rad)]
    nearest = off[row, column, lights]
    # The roll contains the first point's own error: remove it before judging.
    shift = nearest.mean(axis=1)
    squares = ((nearest - shift[:, None]) ** 2).sum(axis=1) / step**2
    repeated = np.array([len(points_rad) - len(set(each)) for each in lights.tolist()])
    best = int(np.argmin(squares + _WORTH * repeated))
    apart = np.abs(nearest[best] - shift[best]).max()
    fits = bool(apart < WITHIN * step and repeated[best] == 0)
    return lights[best], float(rolls[best] + shift[best]), fits
