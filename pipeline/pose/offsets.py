"""Docks whose lights are not quite in their places: poses refined with where the lights really are."""

import math

import numpy as np
from dockpose.dock import Dock
from dockpose.pose.refine import Fit, LightRays, refine
from dockpose.pose.spacing import Placement
from dockpose.pose.uncertainty import log_odds

_SURE = 0.95  # probability from which the roll counts as known
_IN_ONE_TURN = 1e-9  # rounding of a full turn


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
    taken = candidates * len(turns) + best
    fit = Fit(
        tried.rotations[taken],
        tried.positions_m[taken],
        tried.squares_px2[taken],
        tried.covariances[taken],
        tried.numbers,
        tried.points,
    )
    least, *others = np.sort(squares[int(np.argmin(squares.min(axis=1)))]).tolist()
    is_sure = 1 / (1 + sum(math.exp(-log_odds(least, other, fit.numbers)) for other in others)) >= _SURE
    period = 2 * math.pi if is_sure else placement.period_rad
    known = Placement(lights[candidates, best], rolls[candidates, best], placement.angles_rad, placement.fits, period)
    return fit, known
