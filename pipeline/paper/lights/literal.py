"""HATS read as literally as sections 2.1.1 and 2.1.2 of the paper give it, and the steps from there to ours.

What is chosen where they leave it open is the plainest; ``literal_hats`` in static/parts.toml lists it.
"""

import math
from dataclasses import dataclass

import numpy as np
from dockpose.pixels.bright import SATURATED
from dockpose.thresholds import LEVELS, Histogram
from dockpose.thresholds.hats import (
    DIM_LEVELS,
    REAL_LEVELS,
    REAL_SHARE,
    RISE_NOISE,
    above_noise,
    background_limit,
    background_mode,
)


@dataclass(frozen=True)
class Scheme:
    """Which steps are taken beyond the literal reading; none by default."""

    min_area_px: int = 1  # smaller groups do not count
    is_bounded: bool = False  # candidates end above the background and at saturation
    has_every_level: bool = False  # every level is a candidate, not peaks alone
    in_a_row: bool = False  # a count's votes are those of its longest unbroken run of candidates, not of all
    by_brightness: bool = False  # a vote weighs by its reach in the logarithm of brightness above the background
    largest_real: bool = False  # elected is the largest count with a real share of the votes, not the one with the most
    above_noise: bool = False  # levels at which noise dissolves do not vote, and the level keeps clear of noise


# Each step adds to the one before.
_NAMES = ("bounds", "every level", "unbroken run", "log brightness", "largest real count", "clear of noise")
STEPS = {"literal": Scheme(), "+ minimum area": Scheme(2)}
STEPS |= {f"+ {name}": Scheme(2, *[True] * number) for number, name in enumerate(_NAMES, start=1)}


@dataclass(frozen=True)
class Vote:
    """How the candidates voted."""

    level: int  # elected, 0..255; 256 where there is no candidate with a group
    groups: int  # elected
    candidates: np.ndarray  # (n,): levels, from bright to dark
    counts: np.ndarray  # (n,): number of groups at each
    weights: np.ndarray  # (n,): of each one's vote


def local_peaks(counts: np.ndarray) -> np.ndarray:
    """Levels, from bright to dark, with more pixels than the next darker and no fewer than the next brighter one."""
    padded = np.concatenate([[0], counts, [0]])
    return np.flatnonzero((padded[1:-1] > padded[:-2]) & (padded[1:-1] >= padded[2:]))[::-1]


def literal_hats(histogram: Histogram, scheme: Scheme | None = None) -> Vote:
    """Choose a level by the literal reading, or with the steps of a scheme; the brightest of the elected candidates."""
    scheme = scheme or Scheme()
    sketch = histogram.sketch if scheme.is_bounded else histogram.counts
    mode, floor, top = 0, 0, LEVELS - 1
    if scheme.is_bounded:
        mode, floor = background_mode(sketch), background_limit(sketch)
    if floor >= LEVELS or (pixels := histogram.bright(floor)).is_empty:
        nothing = np.empty(0, dtype=int)
        return Vote(LEVELS, 0, nothing, nothing, nothing.astype(float))
    groups = pixels.groups_at_every_level(scheme.min_area_px)
    if scheme.is_bounded:
        top = max(floor, min(int(pixels.level.max()), SATURATED))
    if scheme.above_noise:
        floor = above_noise(groups, floor, top)
    candidates = np.arange(LEVELS)[::-1] if scheme.has_every_level else local_peaks(histogram.counts)
    candidates = candidates[(candidates >= floor) & (candidates <= top)]
    counts = groups[candidates]
    weights = np.ones(len(candidates))
    if scheme.by_brightness:  # each stands for the brightness above the background down to the next, or the floor
        reached = np.append(candidates[1:], floor - 1)
        weights = np.log((candidates - mode + DIM_LEVELS) / (reached - mode + DIM_LEVELS))
    return _elected(scheme, candidates, counts, weights, histogram.noise)


def _elected(scheme: Scheme, candidates: np.ndarray, counts: np.ndarray, weights: np.ndarray, noise: float) -> Vote:
    runs = _runs(counts, weights, scheme.in_a_row)
    if not runs:
        return Vote(LEVELS, 0, candidates, counts, weights)
    most = max(votes for _, _, votes in runs.values())
    if scheme.largest_real:
        share = min(most, REAL_SHARE * float(weights.sum()))
        least = min(REAL_LEVELS, max(length for _, length, _ in runs.values()))
        real = [count for count, (_, length, votes) in runs.items() if _at_least(votes, share) and length >= least]
        elected = max(real) if real else max(runs, key=lambda count: runs[count][2])
    else:
        elected = max(count for count, (_, _, votes) in runs.items() if _at_least(votes, most))
    first, length, _ = runs[elected]
    if scheme.above_noise:
        first += max(0, min(math.floor(RISE_NOISE * noise) - 1, (length - 1) // 2))
    return Vote(int(candidates[first]), elected, candidates, counts, weights)


def _at_least(votes: float, needed: float) -> bool:
    """Compare sums of weights regardless of the order in which they were added."""
    return votes >= needed * (1 - 1e-12)


def _runs(counts: np.ndarray, weights: np.ndarray, in_a_row: bool) -> dict[int, tuple[int, int, float]]:
    """For each count above 0 its first candidate, how many there are, and their votes: of all, or the longest run."""
    found: dict[int, tuple[int, int, float]] = {}
    if in_a_row:
        runs = np.split(np.arange(len(counts)), np.flatnonzero(np.diff(counts)) + 1)
    else:
        runs = [np.flatnonzero(counts == count) for count in np.unique(counts)]
    for run in runs:
        count = int(counts[run[0]]) if len(run) else 0
        if count > 0 and len(run) > found.get(count, (0, 0, 0.0))[1]:
            found[count] = int(run[0]), len(run), float(weights[run].sum())
    return found
