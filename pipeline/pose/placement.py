"""Which of a dock's lights points around a ring are, by their spacing."""

import math
from dataclasses import dataclass

import numpy as np
from dockpose.compiled import compiled
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


@compiled
def _on_even_ring(
    points: np.ndarray, count: int, are_all: bool
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What :class:`Placement` has, by the common phase of the points' angles, modulo the spacing.

    If these are all of the dock's lights, their order may say which each is.
    """
    step = 2 * math.pi / count
    lights, angles = np.empty(points.shape, np.int64), np.empty(points.shape)
    rolls, fits = np.empty(len(points)), np.empty(len(points), np.bool_)
    taken = np.empty(count, np.bool_)
    for k in range(len(points)):
        sine, cosine = 0.0, 0.0
        for angle in points[k]:
            sine += math.sin(count * angle)
            cosine += math.cos(count * angle)
        roll = rolls[k] = math.atan2(sine, cosine) / count
        fits[k] = True
        for light in range(count):
            taken[light] = False
        for number in range(points.shape[1]):
            slot = (points[k, number] - roll) / step
            nearest = round(slot)
            light = lights[k, number] = int(nearest) % count
            angles[k, number] = roll + step * nearest
            if taken[light] or not abs(slot - nearest) < WITHIN:
                fits[k] = False
            taken[light] = True
        if not fits[k] and are_all:
            rolls[k] = _in_order(points[k], lights[k], angles[k])
            fits[k] = np.sqrt(np.mean((points[k] - angles[k]) ** 2)) < _IN_ORDER_WITHIN * step
    return lights, rolls, angles, fits


@compiled
def _in_order(points: np.ndarray, lights: np.ndarray, angles: np.ndarray) -> float:
    """Fill in which light each of all points (N,) is, whose order around a ring says so, and its angle; the roll."""
    count = len(points)
    step, roll = 2 * math.pi / count, 0.0
    for place, number in enumerate(np.argsort(points)):
        lights[number] = place
        roll += float(points[number] - step * place) / count
    for number in range(count):
        angles[number] = roll + step * lights[number]
    return roll


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
