"""Which light is which from view to view of an evenly spaced ring: by following its roll, and by its unevenness."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from dockpose.dock import Dock
from dockpose.pose.learned.views import Placed
from dockpose.pose.refine import on_planes

_ROUNDS = 20  # at the most; it ends when no chain turns
_STARTS = 6  # chains that it begins from, the longest
_CLEAR = 0.25  # of a light's spacing: the farthest that the dock may seem to roll from one frame to the next
_LIKE = 0.7  # correlation of the unevenness seen by one half of the views and by the other


def aligned(placed: Sequence[Placed], dock: Dock) -> list[Placed] | None:
    """Number the lights alike in all views, by the roll and by unevenness; None where halves of the views differ."""
    count = dock.lights or 0
    followed = _chained(placed, count)
    chains: list[list[int]] = []
    for index, each in enumerate(followed):
        if each.follows and chains:
            chains[-1].append(index)
        else:
            chains.append([index])
    if len(chains) == 1:
        return followed
    shifts = [_shifts(each, dock) for each in followed]
    patterns = [np.stack([shifts[index] for index in chain]) for chain in chains]
    turns, _ = _turns(patterns, count)
    if not _halves_agree(patterns, count):
        return None
    for chain, turn in zip(chains, turns, strict=True):
        for index in chain:
            followed[index] = followed[index].turned(turn, count)
    return followed


def _chained(placed: Sequence[Placed], count: int) -> list[Placed]:
    """The views, with those that follow another numbered so that the roll changes least."""
    step = 2 * math.pi / count
    done: list[Placed] = []
    for each in placed:
        if done and each.follows:
            between = done[-1].rotation.T @ each.rotation
            rolled = math.atan2(between[1, 0] - between[0, 1], between[0, 0] + between[1, 1])
            turns = round(rolled / step)
            # A roll about half-way between two numberings leaves open which.
            each = replace(each.turned(turns, count), follows=abs(rolled / step - turns) < _CLEAR)
        done.append(each)
    return done


def _shifts(each: Placed, dock: Dock) -> np.ndarray:
    """Shift (lights, 2) of each light in the dock's plane, outwards and along the ring, in metres; NaN for unseen."""
    (flat,) = on_planes(each.rays, each.rotation[None], each.position_m[None])
    angles = dock.light_angles_rad()[each.lights]
    out = np.column_stack([np.cos(angles), np.sin(angles)])
    off = flat - dock.radius * out
    shifts = np.full((dock.lights or 0, 2), np.nan)
    shifts[each.lights, 0] = (off * out).sum(axis=1)
    shifts[each.lights, 1] = off[:, 1] * out[:, 0] - off[:, 0] * out[:, 1]
    return shifts


def _turns(patterns: Sequence[np.ndarray], count: int) -> tuple[list[int], np.ndarray]:
    """Turn of each chain of views (M, lights, 2) that makes all agree best, and their median (lights, 2) then."""
    best: tuple[float, list[int], np.ndarray] | None = None
    longest = sorted(range(len(patterns)), key=lambda index: -np.isfinite(patterns[index]).sum())[:_STARTS]
    for start in longest:
        mean, turns = _middle(patterns[start]), [0] * len(patterns)
        for _ in range(_ROUNDS):
            costs = np.array([[_cost(pattern, mean, turn) for turn in range(count)] for pattern in patterns])
            after = [int(turn) for turn in costs.argmin(axis=1)]
            mean = _middle(np.concatenate([np.roll(p, turn, axis=1) for p, turn in zip(patterns, after, strict=True)]))
            if after == turns:
                break
            turns = after
        total = float(sum(_cost(pattern, mean, turn) for pattern, turn in zip(patterns, turns, strict=True)))
        if best is None or total < best[0]:
            best = (total, turns, mean)
    assert best is not None
    return best[1], best[2]


def _middle(pattern: np.ndarray) -> np.ndarray:
    """Mean (lights, 2) over views; 0 for lights that none of them shows."""
    seen = np.isfinite(pattern)
    return np.where(seen, pattern, 0.0).sum(axis=0) / np.maximum(1, seen.sum(axis=0))


def _cost(pattern: np.ndarray, mean: np.ndarray, turn: int) -> float:
    return float(np.nansum((np.roll(pattern, turn, axis=1) - mean) ** 2))


def _halves_agree(patterns: Sequence[np.ndarray], count: int) -> bool:
    """Whether every other chain shows the same unevenness as those between them."""
    if len(patterns) < 4:
        return True
    one, other = (_turns(patterns[half::2], count)[1].ravel() for half in (0, 1))
    likeness = [float(one @ np.roll(other.reshape(-1, 2), turn, axis=0).ravel()) for turn in range(count)]
    return max(likeness) > _LIKE * float(np.linalg.norm(one) * np.linalg.norm(other))
