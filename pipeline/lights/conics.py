"""Rings of many lights: ellipses through more points than chance would put there, and how many lights each has."""

import math
import sys
from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations
from operator import attrgetter
from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.chance import (
    ACCEPTED_AMONG_OTHERS,
    MOST_LIGHTS,
    log_chance_of_spacing,
    log_chances_of_spacings,
)
from dockpose.lights.cone import circles_behind
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError, fit_ellipse
from dockpose.lights.growing import NARROWEST, SMALLEST_RADIUS_PX, TOLERANCE_OF_AXIS, TOLERANCE_OF_RADIUS, distances
from dockpose.lights.polygon import Polygon, refitted
from dockpose.lights.reprojection import turned
from dockpose.lights.spacing import phase_of, regular

LEAST_LIGHTS = 9  # fewer are found by their corners, and hardly by trying fives of the points
_TRIALS = 600  # fives of points: one of them is all lights in 99 % of pictures where two in five points are
_MOST_RINGS = 3
_FILLED = 0.5  # of the corners, at the least: of one number every second is another
# Of a ring that is nearly complete another focal length may be told, within these times the camera's: the range of zoom
# lenses, of water, and of cameras of which nothing is known.
_CLOSED, _TIMES_FOCAL = 2 / 3, 1.1 ** np.arange(-12, 16)
_MOST, _MOST_SPACINGS = 0.8, 5  # of the points; of how many spacings the one that most points fit is taken
_OF_CONIC = (0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)  # places of A to F in a conic's matrix
_ROUNDS = 3  # of fitting an ellipse and looking which points are on it


def polygons_on_ellipses(
    points_px: np.ndarray, chosen: np.ndarray, lights: int | None, focal_px: float, tolerance_px: float
) -> list[Polygon]:
    """Rings of evenly spaced lights among points (M, 2) from the principal point, begun from the chosen ones."""
    found = []
    for ellipse, on in _ellipses(points_px[chosen], tolerance_px):
        numbers = range(LEAST_LIGHTS, MOST_LIGHTS + 1) if lights is None else [lights]
        polygon = _spaced(points_px, chosen[on], ellipse, numbers, focal_px, tolerance_px)
        if polygon is not None:
            found.append(polygon)
    return found


def _ellipses(points_px: np.ndarray, tolerance_px: float) -> Iterator[tuple[Ellipse, np.ndarray]]:
    """Ellipses and which points (M,) are on each, the one through most points first."""
    left = np.ones(len(points_px), dtype=bool)
    for _ in range(_MOST_RINGS):
        if left.sum() < LEAST_LIGHTS:
            return
        best = _through_most(points_px[left], tolerance_px)
        if best is None:
            return
        ellipse, on_left = best
        on = np.zeros(len(points_px), dtype=bool)
        on[np.flatnonzero(left)[on_left]] = True
        if _log_chance_of_ellipse(ellipse, on, points_px) > math.log(ACCEPTED_AMONG_OTHERS):
            return
        yield ellipse, on
        left &= ~on


def _log_chance_of_ellipse(ellipse: Ellipse, on: np.ndarray, points_px: np.ndarray) -> float:
    """Logarithm of how many ellipses through five of the points (M, 2) chance would lead past as many more of them."""
    from scipy.special import pdtrc  # takes a third of a second to import, which few pictures need

    major = ellipse.semi_axes_px[0]
    off = points_px[~on] - ellipse.centre_px
    around = int((np.hypot(off[:, 0], off[:, 1]) < 2 * major).sum())
    # Of the disc in which the others are counted the band along the ellipse, as wide as it takes for those on it.
    band = ellipse.distances(points_px[on]).max() / major
    beyond = float(pdtrc(on.sum() - MIN_POINTS - 1, (1 + around) * min(1.0, band)))
    return math.log(math.comb(len(points_px), MIN_POINTS)) + math.log(max(beyond, sys.float_info.min))


def _through_most(points_px: np.ndarray, tolerance_px: float) -> tuple[Ellipse, np.ndarray] | None:
    """The ellipse through most of some points (M, 2), and which are on it (M,); None where it is through few."""
    conics, places, _, scale = conics_of_fives(points_px, _TRIALS)
    on = _near_best(conics, places, tolerance_px / scale)
    for _ in range(_ROUNDS):
        if on.sum() < LEAST_LIGHTS:
            return None
        try:
            ellipse = fit_ellipse(points_px[on])
        except NoEllipseError:
            return None
        major, minor = ellipse.semi_axes_px
        if minor < max(NARROWEST * major, SMALLEST_RADIUS_PX):
            return None
        on = ellipse.distances(points_px) < max(tolerance_px, TOLERANCE_OF_AXIS * major)
    return (fit_ellipse(points_px[on]), on) if on.sum() >= LEAST_LIGHTS else None


def conics_of_fives(points_px: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, float]:
    """Conics (T, 6) through fives of points (M, 2), the points less their middle (2,), over a scale; and these two."""
    middle, scale = points_px.mean(axis=0), max(float(points_px.std()), 1e-9)
    places = (points_px - middle) / scale
    fives = np.column_stack([places, np.ones(len(places))])[_fives_of(len(places), most)]
    return conics_through(fives), places, middle, scale


@cache
def _fives_of(count: int, most: int) -> np.ndarray:
    """Fives (T, 5) of so many points: all of them, or so many drawn at random, always the same."""
    if math.comb(count, MIN_POINTS) <= most:
        return np.array(list(combinations(range(count), MIN_POINTS)))
    rng = np.random.default_rng(count)
    return rng.random((most, count)).argpartition(MIN_POINTS, axis=1)[:, :MIN_POINTS].copy()


@compiled
def _near_best(conics: np.ndarray, places: np.ndarray, tolerance: float) -> np.ndarray:
    """Which of points (M, 2) are near the ellipse, of conics (T, 6), that most are near; none of none."""
    most, best = 0, np.zeros(len(places), np.bool_)
    on = best.copy()
    for t in range(len(conics)):
        A, B, C, D, E, F = conics[t]
        if 4 * A * C <= B * B:
            continue
        for k in range(len(places)):
            x, y = places[k, 0], places[k, 1]
            along_x, along_y = 2 * A * x + B * y + D, B * x + 2 * C * y + E
            off = A * x * x + B * x * y + C * y * y + D * x + E * y + F
            on[k] = off * off < tolerance * tolerance * max(along_x * along_x + along_y * along_y, 1e-24)
        count = np.count_nonzero(on)
        if count > most:
            most, best = count, on.copy()
    return best


def conics_through(places: np.ndarray) -> np.ndarray:
    """Conics (T, 6) through five homogeneous points each (T, 5, 3): of the pencil through four the one by the fifth."""
    a, b, c, d = (np.cross(places[:, i], places[:, j]) for i, j in ((0, 1), (2, 3), (0, 2), (1, 3)))
    # Each two lines are a conic through the four.
    one, two = ((np.vecdot(i, places[:, 4]) * np.vecdot(j, places[:, 4]))[:, None, None] for i, j in ((c, d), (a, b)))
    matrices = one * a[:, :, None] * b[:, None] - two * c[:, :, None] * d[:, None]
    xx, xy, yy, x, y, level = ((matrices[:, i, j] + matrices[:, j, i]) / 2 for i, j in _OF_CONIC)
    return np.column_stack([xx, 2 * xy, yy, 2 * x, 2 * y, level])


class _Spacing(NamedTuple):
    """Points on an ellipse as corners of an evenly spaced ring behind it."""

    log_chance: float
    sides: int
    focal_px: float
    corner_of: np.ndarray  # (N,): for each point
    rotation: np.ndarray  # (3, 3): of the ring, the first corner to the right
    centre: np.ndarray  # (3,): in radii
    off: np.ndarray  # (N,): of each point from its corner, in radii


def _spaced(
    points_px: np.ndarray,
    on: np.ndarray,
    ellipse: Ellipse,
    numbers: Sequence[int],
    focal_px: float,
    tolerance_px: float,
) -> Polygon | None:
    """The polygon of the number of lights that points on an ellipse are spaced by; None where they are not."""
    best: Polygon | None = None
    # Where most lights are uneven it may be another camera's picture; by some focal length other numbers fit as well.
    others_px = [focal_px * times for times in _TIMES_FOCAL]
    for focals_px, filled, tried in (([focal_px], _FILLED, len(numbers)), (others_px, _CLOSED, MOST_LIGHTS)):
        if best is not None and len(best.members) >= _MOST * len(on):
            break
        fitting = [sides for sides in numbers if len(on) >= filled * sides]
        most = math.log(ACCEPTED_AMONG_OTHERS / 2 / tried / len(focals_px))
        spaced = _spacings(points_px[on], ellipse, fitting, focals_px, filled, most)
        spacings = sorted(spaced, key=attrgetter("log_chance"))[:_MOST_SPACINGS]
        likely = [one for one in spacings if one.sides == spacings[0].sides]
        least = 0.0 if filled == _FILLED else _MOST * len(on)
        polygons = [_whole(each, points_px, on, tolerance_px) for each in likely]
        polygons = [*filter(None, [best]), *(one for one in polygons if len(one.members) >= least)]
        best = max(polygons, key=lambda polygon: (len(polygon.members), -polygon.squares_px2), default=None)
    return best


def _spacings(
    points_px: np.ndarray, ellipse: Ellipse, numbers: Sequence[int], focals_px: list[float], filled: float, most: float
) -> list[_Spacing]:
    """Numbers of lights, focals and poses with which points (N, 2) are spaced as chance would less often than most."""
    found = []
    for focal_px in focals_px if numbers else ():
        for R, t in _planes(ellipse, focal_px):
            rays = np.column_stack([points_px / focal_px, np.ones(len(points_px))])
            depth = (t @ R[:, 2]) / (rays @ R[:, 2])
            flat = (rays * depth[:, None] - t) @ R[:, :2]
            angles, each = np.arctan2(flat[:, 1], flat[:, 0]), np.array(numbers)
            for sides in each[log_chances_of_spacings(angles, each, filled) < most].tolist():
                chance, corner_of, _ = log_chance_of_spacing(angles, sides, filled)
                roll_rad = phase_of(angles, sides)
                off = np.hypot(*(flat - regular(sides, roll_rad)[corner_of]).T)
                found.append(_Spacing(chance, sides, focal_px, corner_of, turned(R, roll_rad), t, off))
    return found


def _whole(spacing: _Spacing, points_px: np.ndarray, on: np.ndarray, tolerance_px: float) -> Polygon:
    """The polygon of points (M, 2) that some of them on an ellipse begin."""
    sides, focal_px = spacing.sides, spacing.focal_px
    unit, corners = regular(sides), np.full(sides, -1)
    for k in np.argsort(-spacing.off):  # of two at a corner the nearer
        corners[spacing.corner_of[k]] = on[k]
    mapping = np.column_stack([spacing.rotation[:, :2], spacing.centre]) * np.array([[focal_px], [focal_px], [1.0]])
    polygon = refitted(corners, mapping / spacing.centre[2], points_px, unit, focal_px)
    # Of the whole ring the places are better known than the ellipse was of its points and others.
    places = np.column_stack([unit, np.ones(sides)]) @ polygon.mapping.T
    off_px = distances(places[:, :2] / places[:, 2:], points_px)
    within_px = max(tolerance_px, TOLERANCE_OF_RADIUS * polygon.semi_axes_px[1])
    corners = np.where(off_px.min(axis=1) < within_px, off_px.argmin(axis=1), -1)
    return refitted(corners, polygon.mapping, points_px, unit, focal_px) if (corners >= 0).sum() >= 4 else polygon


def _planes(ellipse: Ellipse, focal_px: float) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Rotation (3, 3) and centre (3,) in radii of both unit circles behind an ellipse."""
    try:
        circles = circles_behind(ellipse.conic, (focal_px, focal_px), (0.0, 0.0), 1.0)
    except NoEllipseError:
        return
    for normal, centre in circles:
        into, level = -normal, math.hypot(normal[0], normal[2])
        right_x, right_z = -into[2] / level, into[0] / level
        # The cross products written out: NumPy's would take longer than all the rest.
        down = into[1] * right_z, -level, -into[1] * right_x
        yield np.column_stack([(right_x, 0.0, right_z), down, into]), centre
