"""Which light of the dock each point is, from the spacing of the lights around the ring and from their colours."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dockpose.compiled import compiled
from dockpose.dock import Dock
from dockpose.pose.refine import Fit, LightRays, refine
from dockpose.pose.uncertainty import log_odds

WITHIN = 0.25  # of the mean spacing: points farther than this from every light are not the dock's
_WORTH = 1.0  # penalty for a wrong colour, in squared mean spacings: more than the largest allowed offset
_SURE = 0.95  # probability from which the roll counts as known
_IN_ONE_TURN = 1e-9  # rounding of a full turn


@dataclass(frozen=True)
class Placement:
    """The lights that N points are, on each of K candidates."""

    lights: np.ndarray  # (K, N): numbers of the lights
    rolls_rad: np.ndarray  # (K,): roll of the dock that brings its lights closest to the points
    angles_rad: np.ndarray  # (K, N): angles of the lights at that roll
    fits: list[bool]  # for each candidate, whether every point is near its light and no two share one
    period_rad: float  # the roll is known modulo this


def place(points_rad: np.ndarray, dock: Dock, labels: Sequence[str | None] | None = None) -> Placement:
    """Find the lights that points at angles (K, N) around the ring are, on each of K candidates."""
    coloured = bool(dock.colours) and labels is not None and any(label is not None for label in labels)
    if not coloured and not dock.angles_deg:
        return _place_evenly(points_rad, dock.lights or points_rad.shape[1])
    known = dock.light_angles_rad()
    wrong = _wrong_colours(labels or (), dock) if coloured else np.zeros((points_rad.shape[1], len(known)))
    rows = [_place_known(row, known, wrong) for row in points_rad]
    lights = np.array([row[0] for row in rows])
    rolls = np.array([row[1] for row in rows])
    even = not dock.angles_deg and not coloured
    period = 2 * math.pi / len(known) if even else 2 * math.pi
    return Placement(lights, rolls, known[lights] + rolls[:, None], [row[2] for row in rows], period)


def _place_evenly(points_rad: np.ndarray, count: int) -> Placement:
    """Place evenly spaced lights by the common phase of the points' angles, modulo the spacing."""
    lights, rolls, angles, fits = _on_even_ring(points_rad, count)
    return Placement(lights, rolls, angles, fits.tolist(), 2 * math.pi / count)


@compiled
def _on_even_ring(points: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Lights (K, N), rolls (K,), angles of the lights (K, N) and whether they fit (K,), as in :class:`Placement`."""
    step = 2 * math.pi / count
    lights, angles = np.empty(points.shape, np.int64), np.empty(points.shape)
    rolls, fits = np.empty(len(points)), np.ones(len(points), np.bool_)
    taken = np.empty(count, np.bool_)
    for k in range(len(points)):
        sine, cosine = 0.0, 0.0
        for angle in points[k]:
            sine += math.sin(count * angle)
            cosine += math.cos(count * angle)
        roll = rolls[k] = math.atan2(sine, cosine) / count
        taken[:] = False
        for number in range(points.shape[1]):
            slot = (points[k, number] - roll) / step
            nearest = round(slot)
            light = lights[k, number] = int(nearest) % count
            angles[k, number] = roll + step * nearest
            if taken[light] or not abs(slot - nearest) < WITHIN:
                fits[k] = False
            taken[light] = True
    return lights, rolls, angles, fits


def _wrong_colours(labels: Sequence[str | None], dock: Dock) -> np.ndarray:
    """Whether (N, L) point i cannot be light j, because its colour differs."""
    return np.array([[float(label is not None and label != colour) for colour in dock.colours] for label in labels])


def _place_known(points_rad: np.ndarray, known_rad: np.ndarray, wrong: np.ndarray) -> tuple[np.ndarray, float, bool]:
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
    mismatch = wrong[column, lights].sum(axis=1)
    repeated = np.array([len(points_rad) - len(set(each)) for each in lights.tolist()])
    best = int(np.argmin(squares + _WORTH * (mismatch + repeated)))
    apart = np.abs(nearest[best] - shift[best]).max()
    fits = bool(apart < WITHIN * step and mismatch[best] == 0 and repeated[best] == 0)
    return lights[best], float(rolls[best] + shift[best]), fits


def offsets_of(dock: Dock, lights: np.ndarray, rolls_rad: np.ndarray) -> np.ndarray:
    """Offsets (..., N, 3) in metres of lights (..., N) of a dock, in the frame in which it has these rolls (...)."""
    x, y, z = np.moveaxis(np.array(dock.offsets_m)[lights], -1, 0)
    c, s = np.cos(rolls_rad)[..., None], np.sin(rolls_rad)[..., None]
    return np.stack([c * x - s * y, s * x + c * y, z], axis=-1)


def refine_with_offsets(
    rotations: np.ndarray, positions_m: np.ndarray, placement: Placement, dock: Dock, rays: LightRays
) -> tuple[Fit, Placement]:
    """Refine K poses by the lights' offsets, and find the roll by them; on an even ring the best of all turns."""
    count = dock.lights or placement.lights.shape[1]
    turns = np.arange(count if placement.period_rad < 2 * math.pi - _IN_ONE_TURN else 1)
    lights = (placement.lights[:, None] + turns[:, None]) % count
    rolls = placement.rolls_rad[:, None] - turns * 2 * math.pi / count
    # All turns of all candidates at once: (candidates, turns, ...), flattened.
    tried = refine(
        np.repeat(rotations, len(turns), axis=0),
        np.repeat(positions_m, len(turns), axis=0),
        np.repeat(placement.angles_rad, len(turns), axis=0),
        dock.radius,
        rays,
        offsets_of(dock, lights, rolls).reshape(-1, lights.shape[-1], 3),
    )
    squares = tried.squares_px2.reshape(rolls.shape)
    candidates = np.arange(len(rolls))
    best = np.argmin(squares, axis=1)
    fit = tried.taken(candidates * len(turns) + best)
    least, *others = np.sort(squares[int(np.argmin(squares.min(axis=1)))]).tolist()
    is_sure = 1 / (1 + sum(math.exp(-log_odds(least, other, fit.numbers)) for other in others)) >= _SURE
    period = 2 * math.pi if is_sure else placement.period_rad
    known = Placement(lights[candidates, best], rolls[candidates, best], placement.angles_rad, placement.fits, period)
    return fit, known
