"""The images of a dock's lights among points: three points give an affine image of it, whose corners follow."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from operator import attrgetter

import numpy as np
from dockpose.dock import Dock
from dockpose.lights.chance import ALIKE, FIRST_POINTS, Scene, log_chance_of, score_ring
from dockpose.lights.growing import TOLERANCE_PX, distances, grow_all
from dockpose.lights.reprojection import RingTemplate, as_pose, stretch
from dockpose.lights.spacing import regular
from dockpose.lights.triples import FEW_POINTS, MOST_BEYOND, judges_of, promising, steps_of

# Numbers of lights that corners tell where none is told: more of them show an ellipse, in a third of the time.
BY_CORNERS = range(4, 13)
MAX_POINTS = 150  # that are looked at, the brightest
# Of each point: those it may have as the next corners. Of few points all, for lights may be missing between; of many
# fewer, or the triples to be grown are mostly chance. Uneven lights may be far apart.
_NEIGHBOURS_OF_FEW, _NEIGHBOURS, _NEIGHBOURS_OF_MANY = 12, 8, 6
_TRIALS, _TRIALS_OF_MANY = 80, 24  # triples that are grown, the most promising; of many points the rest are chance
# Of the few brightest points any three of a ring are such a triple, ten by five lights alone: a few of the best do.
_FEWER_OF_BRIGHTEST = 4
_NEARLY_WHOLE = 0.8  # of its lights: a ring by neighbouring corners, for whose number other steps find nothing more


@dataclass(frozen=True)
class Polygon:
    """A ring that was found among points."""

    corners: np.ndarray  # (N,): for each light of the dock the number of the point that lies there, -1 where none does
    squares_px2: float  # sum of the squared distances of these points from their corners, in px^2
    mapping: np.ndarray  # (3, 3): homography of the dock's plane, in which the ring is the unit circle, to the picture
    focal_px: float  # focal length with which the mapping is that of a pose

    @property
    def semi_axes_px(self) -> tuple[float, float]:
        """Major and minor semi-axis of the ring's image."""
        return stretch(self.mapping)

    @property
    def centre_px(self) -> tuple[float, float]:
        """Image of the ring's centre."""
        return float(self.mapping[0, 2]), float(self.mapping[1, 2])

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
    """A polygon that is more than chance; None where chance, or lamps on a string, have made it."""
    log_chance = log_chance_of(polygon.corners, polygon.squares_px2, ALIKE, polygon.mapping, scene, True)
    return Candidate(polygon, log_chance) if log_chance < math.inf else None


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
    alike: dict[int, list[RingTemplate]] = {}
    points_px, focal_px, tolerance_px = scene.points_px, scene.focal_px, float(tolerance_px)
    for unit in units:
        judged_by = len(unit) - 3 if count <= FEW_POINTS else min(len(unit) - 3, MOST_BEYOND)
        if judged_by > 0:
            alike.setdefault(judged_by, []).append(RingTemplate(points_px, unit, focal_px, tolerance_px))
    return [ring for templates in alike.values() for ring in _of_alike(templates, first, near, scene, whole)]


def _of_alike(
    templates: list[RingTemplate], first: np.ndarray, near: np.ndarray, scene: Scene, neighbours_only: bool
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
        whole = {one.sides for one in found if len(one.members) >= _NEARLY_WHOLE * one.sides}
        for template in templates:
            sides = len(template.unit)
            some = slice(1) if is_first else slice(1, None)
            steps, beyond = (each[some] for each in steps_of(sides, is_few))
            if len(steps) and sides not in whole:
                judges = judges_of(template.unit, steps, beyond, 1 if scene.even else sides)
                promising(template, first, near, judges, scene.even, best, kept, np.empty((5, near.shape[1])))
        kept = kept[np.argsort(-best)[: np.count_nonzero(best >= 0)]]
        for template in templates:
            triples = np.ascontiguousarray(kept[kept[:, 6] == len(template.unit), :6])
            if len(triples):
                grown = zip(*grow_all(template, triples, scene), strict=True)
                found += [
                    Candidate(Polygon(corners, float(squares), mapping, scene.focal_px), float(chance))
                    for corners, squares, mapping, chance in grown
                ]
    return found


def least_likely_part(
    template: RingTemplate, corners: np.ndarray, mapping: np.ndarray, scene: Scene, *, is_exact: bool
) -> Candidate | None:
    """The ring of all of a polygon's points or of some that is least likely to be chance; None of none.

    Whatever an exact ring leaves out, a row of lights becomes several, and less like lamps on a string.
    """
    squares_px2, mapping = as_pose(template, corners, mapping)
    chance, corners, squares_px2, mapping = score_ring(
        template, corners, squares_px2, mapping, scene, not is_exact, not is_exact, False
    )
    if chance == math.inf:
        return None
    return Candidate(Polygon(corners, squares_px2, mapping, template.focal_px), chance)


def refitted(
    corners: np.ndarray, mapping: np.ndarray, points_px: np.ndarray, unit: np.ndarray, focal_px: float
) -> Polygon:
    """The polygon of these corners (N,), fitted as a pose from near a homography (3, 3)."""
    points = np.ascontiguousarray(points_px, dtype=float)
    squares_px2, mapping = as_pose(RingTemplate(points, unit, float(focal_px), 0.0), corners, mapping)
    return Polygon(corners, float(squares_px2), mapping, focal_px)


def candidates_from(
    scene: Scene, chosen: np.ndarray, dock: Dock, tolerance: float, *, whole: bool = False
) -> list[Candidate]:
    """Polygons of the dock's lights that chance would hardly make, begun from the chosen points; the surest first."""
    units = [places_of(sides, dock) for sides in (BY_CORNERS if dock.lights is None else (dock.lights,))]
    return sorted(find_polygons(scene, units, tolerance, chosen, whole=whole), key=attrgetter("log_chance"))


def is_even(dock: Dock) -> bool:
    """Whether a dock's lights are evenly spaced on its circle."""
    return not (dock.angles_deg or dock.offsets_m)


def places_of(sides: int, dock: Dock) -> np.ndarray:
    """Places (N, 2) of the dock's lights on its plane, in radii, in order around it."""
    if not is_even(dock):
        places = dock.light_points()[:, :2] / dock.radius
        return places[np.argsort(np.mod(np.arctan2(places[:, 1], places[:, 0]), 2 * np.pi))]
    return regular(sides)
