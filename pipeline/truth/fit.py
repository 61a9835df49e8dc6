"""Clocks, mount, dock and scale by robust least squares, as far as the motion tells them."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from dockpose.truth.curve import Curve
from dockpose.truth.model import LEVER, NORMAL, OFFSET, PLACE, SIZE, TURN, Compared, Frames, Setup
from dockpose.truth.start import starts

# What may at most be open of each number, in s, 1, radians, metres, radians and shares, for it to be told.
_OPEN = np.array([0.05, 2e-4, *[0.05] * 3, *[0.05] * 6, 0.05, 0.05, 0.05])
_LEAST = 3.0  # singular value, in standard deviations for each of these, of a direction that is told
_MEDIAN = 4.35  # of the squared length of five standard normal numbers
_OUT = 40.0  # squared length from which a frame does not count, where the covariances are as they say
_SHARED = 1e-6  # share of a direction that is not told, by which a number is not told either
_PLACES = {"offset_s": OFFSET, "mount": TURN, "lever_m": LEVER, "dock_m": PLACE, "normal": NORMAL}
_AS_WELL = 0.3  # difference of costs below which another setup fits as well
_UNKNOWN = 1e4  # squared length that a frame counts in which there is no truth
_TOGETHER = 10.0  # widths of the trajectory's smoothing over which errors may go together
_ROUNDS, _AT_MOST = 30, 12_000


@dataclass(frozen=True)
class Fit:
    """What was found."""

    setup: Setup
    covariance: np.ndarray  # (14, 14): of steps of the setup
    told: np.ndarray  # (14,) bool: what the motion tells, or was held
    free: np.ndarray  # (14,): 0 for what was held
    spread: float  # by which squared lengths exceed what the covariances say, 1 or more


def fit(frames: Frames, curve: Curve, given: dict[str, Any]) -> Fit:
    """Search from many starts, then from the best; ``given`` are fields of the setup that stay."""
    free = np.ones(SIZE)
    for name in given:
        free[_PLACES[name]] = 0.0
    thin = frames.some(np.arange(0, len(frames.times_s), 1 + len(frames.times_s) // 400))
    tried = [replace(one, **given) for one in starts(frames, curve, given.get("offset_s"))]
    found = [refined(thin, one, free, 15).setup for one in tried]
    costs = np.array([_cost(thin.against(one), 1.0) for one in found])
    best = found[int(costs.argmin())]
    # As well fits, after half a period of a motion that repeats itself, a camera that is turned around.
    rivals = [one.minus(best) for one, cost in zip(found, costs, strict=True) if cost < costs.min() + _AS_WELL]
    rows = np.arange(0, len(frames.times_s), 1 + len(frames.times_s) // _AT_MOST)
    last = refined(frames.some(rows), best, free)
    return replace(last, told=last.told & (np.abs(rivals) < _OPEN).all(axis=0))


def refined(frames: Frames, setup: Setup, free: np.ndarray, rounds: int = _ROUNDS) -> Fit:
    """Reweighted Gauss-Newton steps in directions that are told, of numbers that are ``free`` (14,) (Huber 1981).

    Each frame counts with whichever of its candidates fits better, by the biweight of its distance (Beaton and Tukey
    1974).
    """
    compared = frames.against(setup)
    for _ in range(rounds):
        weights, slopes, off, spread = _weighed(compared)
        values, vectors = _directions(weights, slopes, free)
        toward = vectors.T @ (np.einsum("nia,ni,n->a", slopes, off, weights) * _OPEN * free)
        clear = values > spread * _LEAST**2
        step = -_OPEN * (vectors[:, clear] @ (toward[clear] / values[clear]))
        now = _cost(compared, spread)
        for share in (1.0, 0.3, 0.1, 0.03, 0.0):
            moved = frames.against(setup.moved(share * step))
            if _cost(moved, spread) <= now:
                break
        setup, compared = setup.moved(share * step), moved
        if np.abs(share * step / _OPEN).max() < 1e-4:
            break
    reach = int(_TOGETHER * frames.curve.width_s / np.median(np.diff(frames.times_s)))
    return _judged(compared, setup, free, reach)


def _best(compared: Compared) -> tuple[np.ndarray, np.ndarray]:
    """Rows at which results and truth are known, and which candidate fits better there."""
    rows = np.flatnonzero(np.isfinite(compared.squares[:, 0]))
    return rows, compared.squares[rows].argmin(axis=1)


def _cost(compared: Compared, spread: float) -> float:
    """Mean of logarithms of squared lengths; frames that the trajectory does not cover count as far off."""
    squares = np.nan_to_num(compared.squares.min(axis=1), nan=_UNKNOWN * spread)
    return float(np.log1p(squares / (5 * spread)).mean())


def _weighed(compared: Compared) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Weights (K,) of the frames that are known, slopes (K, 5, 14) and errors (K, 5) in standard deviations, spread."""
    rows, best = _best(compared)
    squares = compared.squares[rows, best]
    spread = max(1.0, float(np.median(squares)) / _MEDIAN)
    weights = np.maximum(0.0, 1 - squares / (_OUT * spread)) ** 2
    slopes = np.linalg.solve(compared.root[rows], compared.slopes[rows])
    return weights, slopes, compared.white[rows, :, best], spread


def _directions(weights: np.ndarray, slopes: np.ndarray, free: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Squared singular values and directions of the weighted slopes, each number in what may be open of it."""
    scaled = slopes * (_OPEN * free)
    return np.linalg.eigh(np.einsum("nia,nib,n->ab", scaled, scaled, weights, optimize=True))


def _judged(compared: Compared, setup: Setup, free: np.ndarray, reach: int) -> Fit:
    """What is told, and covariances that hold for errors that go on from frame to frame (Newey and West 1987)."""
    weights, slopes, off, spread = _weighed(compared)
    values, vectors = _directions(weights, slopes, free)
    clear = values > spread * _LEAST**2
    by = vectors[:, clear] * _OPEN[:, None]
    scores = np.einsum("nia,ni,n->na", slopes, off, weights) @ by
    lengths = (off**2).sum(axis=1)
    # How the weights change with what they weigh takes part of the curvature away.
    bend = (weights - 4 / 5 * lengths / (_OUT * spread) * np.sqrt(weights)).sum() / weights.sum()
    less = by / (bend * values[clear])
    covariance = less @ _long_run(scores, reach) @ less.T
    hidden = (vectors[:, ~clear & (values > -1)] ** 2).sum(axis=1) * free
    told = (hidden < _SHARED) & (np.sqrt(np.diag(covariance)) < _OPEN)
    return Fit(setup, covariance, told, free, spread)


def _long_run(scores: np.ndarray, reach: int) -> np.ndarray:
    """Covariance (K, K) of a sum of scores (N, K), with neighbours up to a reach, and what a short film leaves open.

    That is the numbers that were fitted, beside the N / reach stretches that are independent, and the quantile of
    Kiefer and Vogelsang (2005) beside that of the normal distribution.
    """
    count, numbers = scores.shape
    reach = max(1, min(reach, count // 20))
    total = scores.T @ scores
    for lag in range(1, reach + 1):
        both = scores[lag:].T @ scores[:-lag]
        total += (1 - lag / (reach + 1)) * (both + both.T)
    stretches, wide = max(1.5 * count / reach, 1.5 * numbers), 1 + 1.5 * reach / count
    return total * stretches / (stretches - numbers) * wide**2
