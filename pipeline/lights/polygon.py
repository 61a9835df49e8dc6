"""The images of a dock's lights among points: three points give an affine image of it, whose corners follow."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.growing import NARROWEST, SMALLEST_RADIUS_PX, TOLERANCE_PX, distances, grow_all, stretch
from dockpose.lights.reprojection import Sought, as_pose

# The brightest points are looked at, first few, then more.
FIRST_POINTS, MAX_POINTS = 40, 150
# Of each point: those it may have as the next corners. Of few points all, for lights may be missing between; of many
# fewer, or the triples to be grown are mostly chance. Uneven lights may be far apart.
_NEIGHBOURS_OF_FEW, _NEIGHBOURS, _NEIGHBOURS_OF_MANY = 12, 8, 6
_MOST_BEYOND = 4  # corners by which a triple is judged: two on each side, but all of few points
_TRIALS, _TRIALS_OF_MANY = 80, 24  # triples that are grown, the most promising; of many points the rest are chance
# Of the few brightest points any three of a ring are such a triple, ten by five lights alone: a few of the best do.
_FEWER_OF_BRIGHTEST = 4
# Corners between the first and the second, and the second and the third point of a triple: neighbours; every second
# corner; one missing between them.
_STEPS = ((1, 1), (2, 2), (1, 2), (2, 1))
_WIDEST_STEP = 4  # where there are few points
FEW_POINTS = 12  # of so few, all corners and steps can be tried in time
# The predicted corners and how far from them a point may lie, in spacings: perspective bends what is farther away.
_NEXT_TOLERANCE, _FAR_TOLERANCE = 0.2, 0.35
_EXACT = 0.03  # of the spacing: nearer is no better
_MOST_SCORE = 1 + math.log(_FAR_TOLERANCE / _EXACT)  # of a corner


@dataclass(frozen=True)
class Polygon:
    """A ring that was found among points."""

    corners: np.ndarray  # (N,): for each light of the dock the number of the point that lies there, -1 where none does
    squares_px2: float  # sum of the squared distances of these points from their corners, in px^2
    semi_axes_px: tuple[float, float]  # major and minor semi-axis of the ring's image
    centre_px: tuple[float, float]  # image of the ring's centre
    mapping: np.ndarray  # (3, 3): homography of the dock's plane, in which the ring is the unit circle, to the picture
    focal_px: float  # focal length with which the mapping is that of a pose

    @property
    def members(self) -> np.ndarray:
        """Numbers of the points that are corners."""
        return self.corners[self.corners >= 0]


def regular(sides: int, roll_rad: float = 0.0) -> np.ndarray:
    """Corners (N, 2) of a regular polygon on the unit circle."""
    corner_rad = roll_rad + 2 * math.pi * np.arange(sides) / sides
    return np.column_stack([np.cos(corner_rad), np.sin(corner_rad)])


def find_polygons(
    points_px: np.ndarray,
    units: Sequence[np.ndarray],
    even: bool,
    focal_px: float,
    tolerance_px: float = TOLERANCE_PX,
    first: np.ndarray | None = None,
    *,
    whole: bool = False,
) -> list[Polygon]:
    """Find images of polygons, each of corners (N, 2) near the unit circle, among points (M, 2), from ``first`` on.

    Of a whole one any three neighbours are corners, so that other steps need not be tried.
    """
    first = np.arange(len(points_px)) if first is None else first
    count = len(first)
    if count < 4:
        return []
    points = np.ascontiguousarray(points_px, dtype=float)
    most = _NEIGHBOURS if count <= FIRST_POINTS else _NEIGHBOURS_OF_MANY
    is_scarce = count <= (FEW_POINTS if even else FIRST_POINTS)
    most = min(_NEIGHBOURS_OF_FEW if is_scarce else most, count - 1)
    apart = distances(points[first], points[first])
    np.fill_diagonal(apart, -1.0)
    near = np.ascontiguousarray(first[apart.argsort(axis=1, kind="stable")[:, 1 : most + 1]])
    # Of several numbers of lights those are ranked together whose triples are judged by as many further corners.
    alike: dict[int, list[Sought]] = {}
    for unit in units:
        judged_by = len(unit) - 3 if count <= FEW_POINTS else min(len(unit) - 3, _MOST_BEYOND)
        if judged_by > 0:
            alike.setdefault(judged_by, []).append(Sought(points, unit, float(focal_px), float(tolerance_px)))
    return [polygon for soughts in alike.values() for polygon in _of_alike(soughts, first, near, even, whole)]


def _of_alike(
    soughts: list[Sought], first: np.ndarray, near: np.ndarray, even: bool, neighbours_only: bool
) -> list[Polygon]:
    """Polygons of numbers whose triples compete, by neighbours, then by other steps where one is not whole."""
    found: list[Polygon] = []
    count = len(soughts[0].points)
    trials = (_TRIALS if count <= FIRST_POINTS else _TRIALS_OF_MANY) * (1 if even else 2)
    is_few = len(first) <= FEW_POINTS
    if is_few and count > FEW_POINTS:
        trials = min(trials, _TRIALS // _FEWER_OF_BRIGHTEST)
    for is_first in (True,) if neighbours_only else (True, False):
        best, kept = np.full(trials, -1.0), np.full((trials, 7), -1)
        whole = {len(one.corners) for one in found if len(one.members) >= 0.8 * len(one.corners)}
        for sought in soughts:
            sides = len(sought.unit)
            some = slice(1) if is_first else slice(1, None)
            steps, beyond = (each[some] for each in _steps_of(sides, is_few))
            if len(steps) and sides not in whole:
                _promising(sought, first, near, steps, beyond, even, best, kept)
        kept = kept[np.argsort(-best)[: np.count_nonzero(best >= 0)]]
        for sought in soughts:
            triples = np.ascontiguousarray(kept[kept[:, 6] == len(sought.unit), :6])
            if len(triples):
                grown = zip(*grow_all(sought, triples), strict=True)
                found += [
                    _polygon(corners, float(squares), *pose, sought.focal_px) for corners, squares, *pose in grown
                ]
    return found


def _polygon(corners: np.ndarray, squares_px2: float, mapping: np.ndarray, focal_px: float) -> Polygon:
    centre_px = (float(mapping[0, 2]), float(mapping[1, 2]))
    return Polygon(corners, squares_px2, stretch(mapping), centre_px, mapping, focal_px)


def without_worst(polygon: Polygon, points_px: np.ndarray, unit: np.ndarray) -> Polygon:
    """Return a polygon without the corner whose point lies farthest off, fitted to the others."""
    places = np.column_stack([unit, np.ones(len(unit))]) @ polygon.mapping.T
    off_px = np.hypot(*(points_px[polygon.corners] - places[:, :2] / places[:, 2:]).T)
    corners = polygon.corners.copy()
    corners[np.argmax(np.where(corners >= 0, off_px, -1.0))] = -1
    return refitted(corners, polygon.mapping, points_px, unit, polygon.focal_px)


def refitted(
    corners: np.ndarray, mapping: np.ndarray, points_px: np.ndarray, unit: np.ndarray, focal_px: float
) -> Polygon:
    """The polygon of these corners (N,), fitted as a pose from near a homography (3, 3)."""
    points = np.ascontiguousarray(points_px, dtype=float)
    squares_px2, mapping = as_pose(Sought(points, unit, float(focal_px), 0.0), corners, mapping)
    return _polygon(corners, float(squares_px2), mapping, focal_px)


@cache
def _steps_of(sides: int, is_few: bool) -> tuple[np.ndarray, np.ndarray]:
    """Steps (S, 2) of triples, and for each the corners (S, K), counted from the first, that judge it; 0 for none.

    Of few points also all pairs of the three steps around a ring that are no larger than the third.
    """
    each = range(1, _WIDEST_STEP + 1)
    more = [(one, two) for one in each for two in each if is_few and max(one, two) <= sides - one - two]
    pairs = [(one, two) for one, two in dict.fromkeys([*_STEPS, *more]) if one + two < sides]
    beyond = np.zeros((len(pairs), max(_MOST_BEYOND, sides - 3)), dtype=np.int64)
    for row, (one, two) in enumerate(pairs):
        last = one + two
        around = [corner % sides for corner in (-1, last + 1, -2, last + 2)]
        corners = dict.fromkeys(range(1, sides) if is_few else around)
        kept = [corner for corner in corners if corner not in (0, one, last)]
        beyond[row, : len(kept)] = kept
    return np.array(pairs, dtype=np.int64).reshape(-1, 2), beyond


class _Predicted(NamedTuple):
    """Three points taken for three corners, by which others are predicted."""

    corners: tuple[int, int, int]
    triple: tuple[int, int, int]  # numbers of the points
    inverse: np.ndarray  # (3, 3): turns the points into an affine image
    spacing: float  # of neighbouring corners, in pixels
    beyond: np.ndarray  # (K,): corners to predict, counted from the first; 0 for none


@compiled
def _promising(
    sought: Sought,
    middles: np.ndarray,
    near: np.ndarray,
    steps: np.ndarray,
    beyond: np.ndarray,
    even: bool,
    best: np.ndarray,
    kept: np.ndarray,
) -> None:
    """Keep triples, (T, 7) of points, their corners and N, that predict most of the next corners, and most exactly."""
    points, sides = sought.points, len(sought.unit)
    worst = np.argmin(best)
    least = best[worst]
    for step in range(len(steps)):
        one, two, further = steps[step, 0], steps[step, 1], beyond[step]
        for first in range(1 if even else sides):
            middle, last = (first + one) % sides, (first + one + two) % sides
            inverse = _inverse_of(sought.unit[np.array([first, middle, last])])
            for row in range(len(middles)):
                m, beside = middles[row], near[row]
                for i in beside:
                    for j in beside:
                        if i == j or (even and one == two and j < i):
                            continue
                        ax, ay = points[m, 0] - points[i, 0], points[m, 1] - points[i, 1]
                        bx, by = points[j, 0] - points[m, 0], points[j, 1] - points[m, 1]
                        cross = ax * by - ay * bx
                        if not even and cross < 0:
                            continue
                        a, b = np.sqrt(ax * ax + ay * ay) / one, np.sqrt(bx * bx + by * by) / two
                        if (even and (a > 4 * b or b > 4 * a)) or abs(cross) < 0.04 * a * b * one * two:
                            continue
                        predicted = _Predicted((first, middle, last), (i, m, j), inverse, min(a, b), further)
                        score = _score(sought, beside, predicted, least)
                        if score > least:
                            best[worst] = score
                            kept[worst] = np.array([i, m, j, first, middle, last, sides])
                            worst = np.argmin(best)
                            least = best[worst]


@compiled
def _inverse_of(places: np.ndarray) -> np.ndarray:
    """What turns the points at three places (3, 2) into the affine image of their plane (3, 3)."""
    inverse, (u, v) = np.empty((3, 3)), places.T
    for k in range(3):
        one, two = (k + 1) % 3, (k + 2) % 3
        inverse[k] = v[one] - v[two], u[two] - u[one], u[one] * v[two] - u[two] * v[one]
    return inverse / inverse[:, 2].sum()


@compiled
def _score(sought: Sought, candidates: np.ndarray, predicted: _Predicted, least: float) -> float:
    """How many of the next corners have a point, and how near; -1 for no image of a dock, or if less than the least."""
    points, unit = sought.points, sought.unit
    corners, triple, inverse, spacing, beyond = predicted
    xx, xy, xt, yx, yy, yt = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        x, y = points[triple[k], 0], points[triple[k], 1]
        xx, xy, xt = xx + x * inverse[k, 0], xy + x * inverse[k, 1], xt + x * inverse[k, 2]
        yx, yy, yt = yx + y * inverse[k, 0], yy + y * inverse[k, 1], yt + y * inverse[k, 2]
    mean, apart = (xx * xx + xy * xy + yx * yx + yy * yy) / 2, abs(xx * yy - xy * yx)
    major = np.sqrt(mean + np.sqrt(max(mean * mean - apart * apart, 0.0)))
    if major < SMALLEST_RADIUS_PX / 2 or apart < NARROWEST / 1.5 * major * major:
        return -1.0
    sides = len(unit)
    score, left = 0.0, len(beyond)
    # A dock whose radius is a large share of its range is bent by up to that share.
    spacing *= 1 + min(major / sought.focal_px, 1.0)
    last = (corners[2] - corners[0]) % sides
    for ahead in beyond:
        left -= 1
        if ahead == 0:
            continue
        corner = (corners[0] + ahead) % sides
        x = xx * unit[corner, 0] + xy * unit[corner, 1] + xt
        y = yx * unit[corner, 0] + yy * unit[corner, 1] + yt
        nearest = np.inf
        for other in candidates:
            if other == triple[0] or other == triple[2]:
                continue
            square = (points[other, 0] - x) ** 2 + (points[other, 1] - y) ** 2
            nearest = min(nearest, square)
        beside = ahead == last + 1 or ahead == sides - 1
        within = (_NEXT_TOLERANCE if beside else _FAR_TOLERANCE) * spacing
        if nearest < within * within:
            score += 1 + np.log(within / max(np.sqrt(nearest), _EXACT * spacing))
        if score + left * _MOST_SCORE <= least:
            return -1.0
    return score
