"""The images of a dock's lights among points: three points give an affine image of it, whose corners follow."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dockpose.lights.chance import FIRST_POINTS, Scene, log_chance_of
from dockpose.lights.growing import TOLERANCE_PX, distances, grow_all
from dockpose.lights.judging import fit_of, least_likely
from dockpose.lights.reprojection import Sought, as_pose, stretch
from dockpose.lights.triples import FEW_POINTS, MOST_BEYOND, judges_of, promising, steps_of

MAX_POINTS = 150  # that are looked at, the brightest
# Of each point: those it may have as the next corners. Of few points all, for lights may be missing between; of many
# fewer, or the triples to be grown are mostly chance. Uneven lights may be far apart.
_NEIGHBOURS_OF_FEW, _NEIGHBOURS, _NEIGHBOURS_OF_MANY = 12, 8, 6
_TRIALS, _TRIALS_OF_MANY = 80, 24  # triples that are grown, the most promising; of many points the rest are chance
# Of the few brightest points any three of a ring are such a triple, ten by five lights alone: a few of the best do.
_FEWER_OF_BRIGHTEST = 4


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


@dataclass(frozen=True)
class Candidate:
    """A polygon that is more than chance, and how much more."""

    polygon: Polygon
    log_chance: float

    @property
    def sides(self) -> int:
        """How many lights it has, missing ones included."""
        return len(self.polygon.corners)

    @property
    def members(self) -> frozenset[int]:
        """Numbers of the points on it."""
        return frozenset(self.polygon.members.tolist())


def accepted(polygon: Polygon, scene: Scene) -> Candidate | None:
    """A polygon that is more than chance; None where chance, or lamps on a cable, have made it."""
    log_chance = log_chance_of(fit_of(polygon.corners, polygon.squares_px2, polygon.mapping), scene, True)
    return Candidate(polygon, log_chance) if log_chance < math.inf else None


def regular(sides: int, roll_rad: float = 0.0) -> np.ndarray:
    """Corners (N, 2) of a regular polygon on the unit circle."""
    corner_rad = roll_rad + 2 * math.pi * np.arange(sides) / sides
    return np.column_stack([np.cos(corner_rad), np.sin(corner_rad)])


def find_polygons(
    scene: Scene,
    units: Sequence[np.ndarray],
    tolerance_px: float = TOLERANCE_PX,
    first: np.ndarray | None = None,
    *,
    whole: bool = False,
) -> list[Candidate]:
    """Find images beyond chance of polygons, each of corners (N, 2) near the unit circle, from points ``first`` on.

    Of a whole one any three neighbours are corners, so that other steps need not be tried.
    """
    first = np.arange(len(scene.points_px)) if first is None else first
    count = len(first)
    if count < 4:
        return []
    most = _NEIGHBOURS if count <= FIRST_POINTS else _NEIGHBOURS_OF_MANY
    is_scarce = count <= (FEW_POINTS if scene.even else FIRST_POINTS)
    most = min(_NEIGHBOURS_OF_FEW if is_scarce else most, count - 1)
    apart = distances(scene.points_px[first], scene.points_px[first])
    np.fill_diagonal(apart, -1.0)
    near = np.ascontiguousarray(first[apart.argsort(axis=1, kind="stable")[:, 1 : most + 1]])
    # Of several numbers of lights those are ranked together whose triples are judged by as many further corners.
    alike: dict[int, list[Sought]] = {}
    for unit in units:
        judged_by = len(unit) - 3 if count <= FEW_POINTS else min(len(unit) - 3, MOST_BEYOND)
        if judged_by > 0:
            alike.setdefault(judged_by, []).append(Sought(scene.points_px, unit, scene.focal_px, float(tolerance_px)))
    return [ring for soughts in alike.values() for ring in _of_alike(soughts, first, near, scene, whole)]


def _of_alike(
    soughts: list[Sought], first: np.ndarray, near: np.ndarray, scene: Scene, neighbours_only: bool
) -> list[Candidate]:
    """Polygons of numbers whose triples compete, by neighbours, then by other steps where one is not whole."""
    found: list[Candidate] = []
    count = len(scene.points_px)
    trials = (_TRIALS if count <= FIRST_POINTS else _TRIALS_OF_MANY) * (1 if scene.even else 2)
    is_few = len(first) <= FEW_POINTS
    if is_few and count > FEW_POINTS:
        trials = min(trials, _TRIALS // _FEWER_OF_BRIGHTEST)
    for is_first in (True,) if neighbours_only else (True, False):
        best, kept = np.full(trials, -1.0), np.full((trials, 7), -1)
        whole = {one.sides for one in found if len(one.members) >= 0.8 * one.sides}
        for sought in soughts:
            sides = len(sought.unit)
            some = slice(1) if is_first else slice(1, None)
            steps, beyond = (each[some] for each in steps_of(sides, is_few))
            if len(steps) and sides not in whole:
                judges = judges_of(sought.unit, steps, beyond, 1 if scene.even else sides)
                promising(sought, first, near, judges, scene.even, best, kept, np.empty((5, near.shape[1])))
        kept = kept[np.argsort(-best)[: np.count_nonzero(best >= 0)]]
        for sought in soughts:
            triples = np.ascontiguousarray(kept[kept[:, 6] == len(sought.unit), :6])
            if len(triples):
                grown = zip(*grow_all(sought, triples, scene), strict=True)
                found += [
                    Candidate(polygon_of(corners, float(squares), mapping, scene.focal_px), float(chance))
                    for corners, squares, mapping, chance in grown
                ]
    return found


def polygon_of(corners: np.ndarray, squares_px2: float, mapping: np.ndarray, focal_px: float) -> Polygon:
    """The polygon of corners (N,) by its homography (3, 3)."""
    centre_px = (float(mapping[0, 2]), float(mapping[1, 2]))
    return Polygon(corners, squares_px2, stretch(mapping), centre_px, mapping, focal_px)


def least_likely_part(
    sought: Sought, corners: np.ndarray, mapping: np.ndarray, scene: Scene, *, is_exact: bool
) -> Candidate | None:
    """The ring of all of a polygon's points or of some that is least likely to be chance; None of none."""
    chance, corners, squares_px2, mapping = least_likely(sought, corners, mapping, scene, is_exact)
    return Candidate(polygon_of(corners, squares_px2, mapping, sought.focal_px), chance) if chance < math.inf else None


def refitted(
    corners: np.ndarray, mapping: np.ndarray, points_px: np.ndarray, unit: np.ndarray, focal_px: float
) -> Polygon:
    """The polygon of these corners (N,), fitted as a pose from near a homography (3, 3)."""
    points = np.ascontiguousarray(points_px, dtype=float)
    squares_px2, mapping = as_pose(Sought(points, unit, float(focal_px), 0.0), corners, mapping)
    return polygon_of(corners, float(squares_px2), mapping, focal_px)
