"""The image of a regular polygon among points: a ring of evenly spaced lights among text, snow and reflections.

Three neighbouring lights fix an affine image of the polygon, which foretells where the next lights are. Triples whose
foretelling comes true grow, by a homography, to the whole ring.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy.spatial import KDTree

MAX_POINTS = 150  # of more, the brightest are looked at
_NEIGHBOURS = 10
_TRIALS = 60  # of the triples, the most promising
_USUAL_NUMBERS = range(7, 17)  # of lights, where it is not known; fewer prove nothing
_NEXT = np.array([-3, -2, 2, 3])  # corners that a triple (-1, 0, 1) foretells
_NEXT_TOLERANCE = np.array([0.35, 0.2, 0.2, 0.35])  # of the spacing: perspective bends what is farther
_TOLERANCE_PX, _TOLERANCE_OF_RADIUS = 1.5, 0.025
_GROWING_TOLERANCE, _STRICT_TOLERANCE = 0.22, 0.2  # of the spacing
_STRICT_ROUNDS = 3
_SMALLEST_RADIUS_PX = 3.0
# With fewer than eight in ten corners, the lights must lie within so much of their places, root mean square, and the
# brightest be no more than so many times as bright as the dimmest.
# With fewer than about two in three, or where their number is not known, they must be so many times better than that.
_FEW, _DOUBT_OF_FEW, _DOUBT_OF_NUMBER = 0.65, 4.0, 2.5
_NEARLY_COMPLETE, _EXACT_PX, _EXACT_OF_RADIUS, _MUCH_ALIKE = 0.8, 0.35, 0.008, 25.0
_NARROWEST = 0.12  # of the ellipse's axes
_PERSPECTIVE_MARGIN = 1.5  # focal lengths are not always well known
_NOISE_PX = 1.0
_PERSPECTIVE_PRIOR = 0.03


@dataclass(frozen=True)
class _Polygon:
    """One regular polygon found: for each corner the point that lies there (-1 where none does), and how well."""

    corners: np.ndarray
    rms_px: float
    radius_px: float

    @property
    def members(self) -> np.ndarray:
        return self.corners[self.corners >= 0]


def find_polygon(points_px: np.ndarray, brightness: np.ndarray, sides: int | None, focal_px: float) -> np.ndarray:
    """Find the points that are the corners of a regular polygon seen in perspective.

    Parameters
    ----------
    points_px : (N, 2) points, undistorted.
    brightness : (N,) of each; of two polygons with no point in common the brighter is taken.
    sides : how many corners it has, at least 3; some may be missing. None tries 7 to 16, and wants nearly all of
        them.
    focal_px : of the camera; it limits how much perspective a polygon of that size in the picture can have.

    Returns
    -------
    (N,) bool; all False where there is none. Deterministic.
    """
    on_ring = np.zeros(len(points_px), dtype=bool)
    chosen = np.arange(len(points_px))
    if len(chosen) > MAX_POINTS:
        chosen = np.sort(np.argsort(-brightness, kind="stable")[:MAX_POINTS])
    points, brightness = points_px[chosen], brightness[chosen]
    if sides is not None:
        found = [polygon for polygon in _polygons(points, sides, focal_px) if _is_proof(polygon, brightness)]
    else:
        tried = (polygon for number in _USUAL_NUMBERS for polygon in _polygons(points, number, focal_px))
        whole = [polygon for polygon in tried if _is_nearly_complete(polygon)]
        found = [polygon for polygon in whole if _is_exact(polygon, brightness, _DOUBT_OF_NUMBER)]
    best = _best(found, brightness)
    if best is not None:
        on_ring[chosen[best.members]] = True
    return on_ring


def _polygons(points: np.ndarray, sides: int, focal_px: float) -> list[_Polygon]:
    """All regular polygons among the points: grown from neighbouring lights, or else from every second one."""
    if len(points) < least_corners(sides):
        return []
    tree = KDTree(points)
    return _grow_all(points, tree, sides, 1, focal_px) or _grow_all(points, tree, sides, 2, focal_px)


def least_corners(sides: int) -> int:
    """How many corners can be proof of a ring among other points: all of up to five, of more five and over half."""
    return sides if sides <= 5 else max(5, math.ceil(0.55 * sides))


def _is_proof(polygon: _Polygon, brightness: np.ndarray) -> bool:
    """Whether a polygon is more than chance: nearly complete, or else exact and of lights that are much alike."""
    few = len(polygon.members) < _FEW * len(polygon.corners)
    return _is_nearly_complete(polygon) or _is_exact(polygon, brightness, _DOUBT_OF_FEW if few else 1.0)


def _is_nearly_complete(polygon: _Polygon) -> bool:
    return len(polygon.members) >= _NEARLY_COMPLETE * len(polygon.corners)


def _is_exact(polygon: _Polygon, brightness: np.ndarray, doubt: float = 1.0) -> bool:
    """Whether the lights lie where they should and are much alike, each ``doubt`` times as well as is usually asked."""
    spread = brightness[polygon.members].max() / max(float(brightness[polygon.members].min()), 1e-9)
    # Chance finds large rings more easily than small ones: doubt counts twice for what may grow with the radius.
    exact = max(_EXACT_PX / doubt, _EXACT_OF_RADIUS * polygon.radius_px / doubt**2)
    return bool(spread < _MUCH_ALIKE / doubt and polygon.rms_px <= exact)


def _grow_all(points: np.ndarray, tree: KDTree, sides: int, stride: int, focal_px: float) -> list[_Polygon]:
    """Grow the most promising triples of corners ``stride`` apart; stops at the first complete ring."""
    step = 2 * np.pi * stride / sides
    if np.sin(step) < 1e-6:
        return []
    found: list[_Polygon] = []
    for before, middle, after in _promising(points, tree, step):
        if any(_covers(polygon, (before, middle, after)) for polygon in found):
            continue
        start = np.full(sides, -1)
        start[[-stride % sides, 0, stride]] = before, middle, after
        polygon = _grow(points, tree, start, focal_px)
        if polygon is not None:
            found.append(polygon)
    return found


def _covers(polygon: _Polygon, triple: tuple[int, int, int]) -> bool:
    return bool(np.isin(triple, polygon.members).all())


def _promising(points: np.ndarray, tree: KDTree, step: float) -> list[tuple[int, int, int]]:
    """Triples of neighbours, those first that foretell most of the next corners, and most exactly."""
    count = len(points)
    near = np.asarray(tree.query(points, k=min(_NEIGHBOURS + 1, count))[1])[:, 1:]
    pairs = np.array(list(combinations(range(near.shape[1]), 2)))
    middle = np.repeat(np.arange(count), len(pairs))
    before, after = near[:, pairs[:, 0]].ravel(), near[:, pairs[:, 1]].ravel()
    a, b, c = points[before], points[middle], points[after]
    one, two = a - b, c - b
    lengths = np.hypot(*one.T), np.hypot(*two.T)
    ratio = lengths[0] / np.maximum(lengths[1], 1e-9)
    area = np.abs(one[:, 0] * two[:, 1] - one[:, 1] * two[:, 0])
    sane = (ratio > 1 / 4) & (ratio < 4) & (area > 0.08 * lengths[0] * lengths[1])
    before, middle, after, a, b, c = (value[sane] for value in (before, middle, after, a, b, c))
    if len(middle) == 0:
        return []
    # The affine image of a regular polygon: centre + (b - centre) cos k step + across sin k step.
    centre = (a + c - 2 * np.cos(step) * b) / (2 - 2 * np.cos(step))
    across = (c - a) / (2 * np.sin(step))
    angle = (step * _NEXT)[None, :, None]
    foretold = centre[:, None] + (b - centre)[:, None] * np.cos(angle) + across[:, None] * np.sin(angle)
    spacing = np.minimum(np.hypot(*(a - b).T), np.hypot(*(c - b).T))
    distance = tree.query(foretold.reshape(-1, 2))[0].reshape(-1, len(_NEXT)) / spacing[:, None]
    hits = distance < _NEXT_TOLERANCE
    score = hits.sum(axis=1) - 0.5 * np.where(hits, distance, 0).sum(axis=1)
    order = np.argsort(-score, kind="stable")[:_TRIALS]
    return [(int(before[i]), int(middle[i]), int(after[i])) for i in order if score[i] > 0 or len(points) <= 5]


def _grow(points: np.ndarray, tree: KDTree, corners: np.ndarray, focal_px: float) -> _Polygon | None:
    """Grow a polygon from three corners: fit, look for the corners next to those that are known, and fit again.

    Corners are added from near to far, since the first fits bend what is far from the points they are made of. When no
    more are found, all corners are looked for where the last fits put them, and have to lie there exactly.
    """
    strict = 0
    distance, mapping = np.empty(0), np.eye(3)
    while strict < _STRICT_ROUNDS:
        mapping = _fit(points, corners, focal_px)
        if mapping is None:
            return None
        places = _apply(mapping, _unit_corners(len(corners)))
        distance, nearest = tree.query(places)
        spacing = np.hypot(*(places - np.roll(places, 1, axis=0)).T)
        spacing = np.minimum(spacing, np.roll(spacing, -1))
        exact = max(_TOLERANCE_PX, _TOLERANCE_OF_RADIUS * _smallest_radius(mapping))
        tolerance = np.minimum(_STRICT_TOLERANCE * spacing, exact) if strict else _GROWING_TOLERANCE * spacing
        grown = np.where(distance < tolerance, nearest, -1)
        if strict == 0:
            grown[~_within_two(corners >= 0)] = -1
        if strict or (grown >= 0).sum() <= (corners >= 0).sum():
            strict += 1
        corners = grown
        if (corners >= 0).sum() < 3:
            return None
    members = corners[corners >= 0]
    if len(members) < least_corners(len(corners)) or len(np.unique(members)) < len(members):
        return None
    return _Polygon(corners, float(np.sqrt(np.mean(distance[corners >= 0] ** 2))), _smallest_radius(mapping))


def _within_two(known: np.ndarray) -> np.ndarray:
    """Corners that are known, or one or two steps along from one that is."""
    return known | np.roll(known, 1) | np.roll(known, -1) | np.roll(known, 2) | np.roll(known, -2)


def _unit_corners(sides: int) -> np.ndarray:
    angles = 2 * np.pi * np.arange(sides) / sides
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _fit(points: np.ndarray, corners: np.ndarray, focal_px: float) -> np.ndarray | None:
    """Homography (3, 3) of the unit circle's corners to the points, no more in perspective than they ask for.

    Three corners fix an affine image; how much the two numbers of perspective may differ from 0 for the sake of more
    corners is set by a weak prior. None where it is no plausible picture of a dock: too small, too narrow, or seen
    from too near.
    """
    known = np.flatnonzero(corners >= 0)
    x, y = _unit_corners(len(corners))[known].T
    seen = points[corners[known]]
    middle, size = seen.mean(axis=0), max(float(seen.std()), 1e-9)
    u, v = ((seen - middle) / size).T
    count = len(known)
    rows = np.zeros((2 * count + 2, 8))
    rows[:count, 0], rows[:count, 1], rows[:count, 2] = x, y, 1
    rows[count:-2, 3], rows[count:-2, 4], rows[count:-2, 5] = x, y, 1
    rows[:count, 6], rows[:count, 7], rows[count:-2, 6], rows[count:-2, 7] = -x * u, -y * u, -x * v, -y * v
    rows[-2, 6] = rows[-1, 7] = _PERSPECTIVE_PRIOR
    solution = np.linalg.lstsq(rows, np.concatenate([u, v, [0, 0]]), rcond=None)[0]
    mapping = np.append(solution, 1.0).reshape(3, 3)
    perspective = float(np.hypot(mapping[2, 0], mapping[2, 1]))
    mapping = np.array([[size, 0, middle[0]], [0, size, middle[1]], [0, 0, 1]]) @ mapping
    stretch = np.linalg.svd(_linear_part(mapping), compute_uv=False)
    if stretch[1] < max(_SMALLEST_RADIUS_PX / 3, _NARROWEST * stretch[0]) or stretch[0] < _SMALLEST_RADIUS_PX:
        return None
    # The scale changes across a dock by its radius over its range, which is its radius in the picture over the focal
    # length, times the sine of its tilt; what the lights' own noise feigns comes on top.
    if perspective > _PERSPECTIVE_MARGIN * stretch[0] / focal_px + _NOISE_PX / stretch[1]:
        return None
    return mapping


def _linear_part(mapping: np.ndarray) -> np.ndarray:
    """How the mapping stretches around the circle's middle (2, 2)."""
    return mapping[:2, :2] - np.outer(mapping[:2, 2], mapping[2, :2])


def _smallest_radius(mapping: np.ndarray) -> float:
    return float(np.linalg.svd(_linear_part(mapping), compute_uv=False)[1])


def _apply(mapping: np.ndarray, unit: np.ndarray) -> np.ndarray:
    image = np.column_stack([unit, np.ones(len(unit))]) @ mapping.T
    return image[:, :2] / image[:, 2:]


def _best(found: list[_Polygon], brightness: np.ndarray) -> _Polygon | None:
    """The polygon with most corners, then the most exact; of two nearly as complete and apart, the brighter."""
    if not found:
        return None
    found = sorted(found, key=lambda polygon: (-len(polygon.members), polygon.rms_px))
    best = found[0]
    for other in found[1:]:
        apart = not np.isin(other.members, best.members).any()
        as_exact = other.rms_px <= 2 * best.rms_px + 0.1
        nearly_as_many = len(other.members) >= 0.7 * len(best.members)
        brighter = np.median(brightness[other.members]) > np.median(brightness[best.members])
        if apart and as_exact and nearly_as_many and brighter:
            best = other
    return best
