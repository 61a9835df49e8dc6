"""Threes of points that may be three corners of a dock's polygon: those that predict most of the others."""

import math
from functools import cache
from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled, compiled_least, compiled_within
from dockpose.lights.growing import NARROWEST, SMALLEST_RADIUS_PX
from dockpose.lights.reprojection import RingTemplate

MOST_BEYOND = 4  # corners by which a triple is judged: two on each side, but all of few points
FEW_POINTS = 12  # of so few, all corners and steps can be tried in time
# Corners between the first and the second, and the second and the third point of a triple: neighbours; every second
# corner; one missing between them.
_STEPS = ((1, 1), (2, 2), (1, 2), (2, 1))
_WIDEST_STEP = 4  # where there are few points
# The predicted corners and how far from them a point may lie, in spacings: perspective bends what is farther away.
_NEXT_TOLERANCE, _FAR_TOLERANCE = 0.2, 0.35
_MOST_UNEQUAL = 4.0  # spacings on both sides of a corner, one over the other: narrow rings seen along their rim
_EXACT = 0.03  # of the spacing: nearer is no better
_FAR_AWAY = 1e9  # pixels
_LEAST_BEND = 0.04  # at the second of three points, as the sine of the angle: of less they are in line
_MOST_SCORE = 1 + math.log(_FAR_TOLERANCE / _EXACT)  # of a corner


@cache
def steps_of(sides: int, is_few: bool) -> tuple[np.ndarray, np.ndarray]:
    """Steps (S, 2) of triples, and for each the corners (S, K), counted from the first, that judge it; 0 for none.

    Of few points also all pairs of the three steps around a ring that are no larger than the third.
    """
    each = range(1, _WIDEST_STEP + 1)
    more = [(one, two) for one in each for two in each if is_few and max(one, two) <= sides - one - two]
    pairs = [(one, two) for one, two in dict.fromkeys([*_STEPS, *more]) if one + two < sides]
    beyond = np.zeros((len(pairs), max(MOST_BEYOND, sides - 3)), dtype=np.int64)
    for row, (one, two) in enumerate(pairs):
        last = one + two
        around = [corner % sides for corner in (-1, last + 1, -2, last + 2)]
        corners = dict.fromkeys(range(1, sides) if is_few else around)
        kept = [corner for corner in corners if corner not in (0, one, last)]
        beyond[row, : len(kept)] = kept
    return np.array(pairs, dtype=np.int64).reshape(-1, 2), beyond


class Judges(NamedTuple):
    """Triples of corners, and the corners that judge three points taken for them."""

    corners: np.ndarray  # (S, 3): from any one on in the order of the ring
    steps: np.ndarray  # (S, 2): from the first to the second, and on to the third
    within: np.ndarray  # (S, K): how far off its place a corner's point may be, in spacings
    weights: np.ndarray  # (S, 2 + K, 2): by what goes from the second point to the others, of both axes and each corner


@compiled
def judges_of(unit: np.ndarray, steps: np.ndarray, beyond: np.ndarray, firsts: int) -> Judges:
    """Triples from each of the first corners on, by their steps (S, 2); judged by corners (S, K), 0 for none."""
    sides, count = len(unit), firsts * len(steps)
    corners, within = np.empty((count, 3), np.int64), np.zeros((count, beyond.shape[1]))
    weights, both = np.zeros((count, 2 + beyond.shape[1], 2)), np.empty((count, 2), np.int64)
    for row in range(count):
        step, first = row // firsts, row % firsts
        one, two = steps[step]
        both[row] = steps[step]
        corners[row] = first, (first + one) % sides, (first + one + two) % sides
        inverse = _inverse_of(unit[corners[row]])
        weights[row, :2] = inverse[0::2, :2].T
        for k in range(beyond.shape[1]):
            ahead = beyond[step, k]
            if ahead == 0:
                break
            u, v = unit[(first + ahead) % sides]
            weights[row, 2 + k] = inverse[0::2, 0] * u + inverse[0::2, 1] * v + inverse[0::2, 2]
            within[row, k] = _NEXT_TOLERANCE if ahead in (one + two + 1, sides - 1) else _FAR_TOLERANCE
    return Judges(corners, both, within, weights)


@compiled
def _inverse_of(places: np.ndarray) -> np.ndarray:
    """What turns the points at three places (3, 2) into the affine image of their plane (3, 3)."""
    inverse, (u, v) = np.empty((3, 3)), places.T
    for k in range(3):
        one, two = (k + 1) % 3, (k + 2) % 3
        inverse[k] = v[one] - v[two], u[two] - u[one], u[one] * v[two] - u[two] * v[one]
    return inverse / inverse[:, 2].sum()


@compiled_least
def promising(
    template: RingTemplate,
    middles: np.ndarray,
    near: np.ndarray,
    judges: Judges,
    even: bool,
    best: np.ndarray,
    kept: np.ndarray,
    beside: np.ndarray,
) -> None:
    """Keep triples, (T, 7) of points, their corners and N, that predict most of the next corners, and most exactly.

    They are the middles and two of those near each (M, K), whose places are written to ``beside`` (5, K).
    """
    points, sides, count, focal_px = template.points, len(template.unit), near.shape[1], template.focal_px
    steps, weights, within, corners = judges.steps, judges.weights, judges.within, judges.corners
    worst = np.argmin(best)
    least = best[worst]
    x, y, long, others_x, others_y = beside[0], beside[1], beside[2], beside[3], beside[4]
    for row in range(len(middles)):
        for k in range(count):
            x[k] = points[near[row, k], 0] - points[middles[row], 0]
            y[k] = points[near[row, k], 1] - points[middles[row], 1]
            others_x[k], others_y[k] = x[k], y[k]
            long[k] = np.hypot(x[k], y[k])
        for i in range(count):
            others_x[i] = _FAR_AWAY
            for j in range(count):
                cross = y[i] * x[j] - x[i] * y[j]
                if i == j or abs(cross) < _LEAST_BEND * long[i] * long[j] or (not even and cross < 0):
                    continue
                others_x[j] = _FAR_AWAY
                for judge in range(len(steps)):
                    one, two = steps[judge, 0], steps[judge, 1]
                    a, b = long[i] / one, long[j] / two
                    if even and (a > _MOST_UNEQUAL * b or b > _MOST_UNEQUAL * a or (one == two and j < i)):
                        continue
                    score = _score(
                        weights, within, judge, others_x, others_y, x[i], y[i], x[j], y[j], min(a, b), focal_px, least
                    )
                    if score > least:
                        best[worst] = score
                        kept[worst, 0], kept[worst, 1], kept[worst, 2] = near[row, i], middles[row], near[row, j]
                        for k in range(3):
                            kept[worst, 3 + k] = corners[judge, k]
                        kept[worst, 6] = sides
                        worst = np.argmin(best)
                        least = best[worst]
                others_x[j] = x[j]
            others_x[i] = x[i]


@compiled_within
def _score(
    weights: np.ndarray,
    within: np.ndarray,
    judge: int,
    others_x: np.ndarray,
    others_y: np.ndarray,
    xi: float,
    yi: float,
    xj: float,
    yj: float,
    spacing: float,
    focal_px: float,
    least: float,
) -> float:
    """How many of the next corners have a point, and how near; -1 for no image of a dock, or if less than the least.

    All places are from the second point of a triple: the others', and those of the first and the third.
    """
    xx = weights[judge, 0, 0] * xi + weights[judge, 0, 1] * xj
    yx = weights[judge, 0, 0] * yi + weights[judge, 0, 1] * yj
    xy = weights[judge, 1, 0] * xi + weights[judge, 1, 1] * xj
    yy = weights[judge, 1, 0] * yi + weights[judge, 1, 1] * yj
    mean, apart = (xx * xx + xy * xy + yx * yx + yy * yy) / 2, abs(xx * yy - xy * yx)
    major = np.sqrt(mean + np.sqrt(max(mean * mean - apart * apart, 0.0)))
    if major < SMALLEST_RADIUS_PX / 2 or apart < NARROWEST / 1.5 * major * major:
        return -1.0
    # A dock whose radius is a large share of its range is bent by up to that share.
    spacing *= 1 + min(major / focal_px, 1.0)
    score, left = 0.0, within.shape[1]
    for k in range(within.shape[1]):
        left -= 1
        if within[judge, k] == 0:
            break
        to_x = weights[judge, 2 + k, 0] * xi + weights[judge, 2 + k, 1] * xj
        to_y = weights[judge, 2 + k, 0] * yi + weights[judge, 2 + k, 1] * yj
        nearest = np.inf
        for other in range(len(others_x)):
            nearest = min(nearest, (others_x[other] - to_x) ** 2 + (others_y[other] - to_y) ** 2)
        reach = within[judge, k] * spacing
        if nearest < reach * reach:
            score += 1 + np.log(reach / max(np.sqrt(nearest), _EXACT * spacing))
        if score + left * _MOST_SCORE <= least:
            return -1.0
    return score
