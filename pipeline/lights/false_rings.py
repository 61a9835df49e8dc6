"""Rings that are exact and no dock: of points of a lattice, of parts of other rings, or several through one place."""

import math

import cv2
import numpy as np
from dockpose.compiled import compiled
from dockpose.dock import Dock
from dockpose.lights.chance import ACCEPTED, ACCEPTED_AMONG_OTHERS, Scene
from dockpose.lights.ellipse import MIN_POINTS, NoEllipseError, fit_ellipse
from dockpose.lights.growing import TOLERANCE_OF_RADIUS, TOLERANCE_PX, distances
from dockpose.lights.polygon import Candidate, Polygon, places_of

_NEIGHBOURS = 8  # of a lattice's point: the nearest of a square one
_TOLERANCE = 0.05  # of a step, by which perspective and lens change it from one point to the next
_CLOSE = 0.25  # of how far off a light may be: more than its centre's error, mostly
_MOST_SHIFTED = 16  # lights of a ring, whose third power is looked at: steps between so many show any lattice
_LEAST_DEPTH = 0.1  # of the ring's middle: what is nearer to the camera's plane is far out of the picture
_LEAST_ANGLE = math.sin(math.radians(20))  # between a lattice's two directions, as steeply as it may be seen
# Another ring through some of the same points leaves it open which is right where its evidence comes so near.
AS_CONVINCING = 0.6
# What is said of groups that show no one ring.
SEVERAL = "Several rings can be laid through the same groups; which of them is the dock is unknown."
# Other lights on a ring, per light, from which on it is a part of another: of one with at least twice as many, so that
# as many others lie on it, of which two thirds may be missed. Two lamps may be on any rim.
_UNEXPLAINED, _FEWEST_OTHERS = 0.35, 3
_SPECK = 0.05  # of the ring's median light: lamps of one kind are not that unequal, beams and distance included
_LEAST_EXPECTED = 0.1  # other points on a ring: one may always be
# Of the radius: what two rings on one ellipse differ by at the most, and one ring and a part of it, of few lights.
_SAME_ELLIPSE, _SAME_RING = 0.08, 0.25


def repeating(points_px: np.ndarray) -> np.ndarray:
    """Which points (M, 2) form a lattice: (M,) bool, none unless they are more than half."""
    count = len(points_px)
    in_lattice = np.zeros(count, dtype=bool)
    if count <= _NEIGHBOURS:
        return in_lattice
    steps_px, near = (found[:, 1:] for found in nearest_of(points_px, points_px, _NEIGHBOURS + 1))
    away = points_px[near] - points_px[:, None]
    mirrored = (points_px[:, None] - away).reshape(-1, 2)
    off_px, opposite = (found.reshape(count, -1) for found in nearest_of(mirrored, points_px, 1))
    is_pair = off_px < np.maximum(TOLERANCE_PX, _TOLERANCE * steps_px)
    # Two directions: the first pair's, and any that leads elsewhere.
    first = np.argmax(is_pair, axis=1)
    x, y = np.take_along_axis(away, first[:, None, None], axis=1)[:, 0].T
    length = np.maximum(np.hypot(x, y)[:, None] * steps_px, 1e-9)
    aside = np.abs(x[:, None] * away[..., 1] - y[:, None] * away[..., 0]) / length
    is_other = is_pair & (aside > _LEAST_ANGLE)
    inside = is_pair.any(axis=1) & is_other.any(axis=1)
    in_lattice[inside] = True
    for ends in (near, opposite):
        in_lattice[ends[is_pair & inside[:, None]]] = True
    return in_lattice if in_lattice.sum() > count / 2 else np.zeros(count, dtype=bool)


@compiled
def nearest_of(points_px: np.ndarray, others_px: np.ndarray, most: int) -> tuple[np.ndarray, np.ndarray]:
    """How far (N, K) each of points (N, 2) is from the nearest of others (M, 2), and which those are."""
    off, which = np.full((len(points_px), most), np.inf), np.full((len(points_px), most), -1)
    for one in range(len(points_px)):
        for other in range(len(others_px)):
            square = (others_px[other, 0] - points_px[one, 0]) ** 2 + (others_px[other, 1] - points_px[one, 1]) ** 2
            if square >= off[one, most - 1]:
                continue
            place = most - 1
            while place > 0 and off[one, place - 1] > square:
                off[one, place], which[one, place] = off[one, place - 1], which[one, place - 1]
                place -= 1
            off[one, place], which[one, place] = square, other
    return np.sqrt(off), which


def goes_on(polygon: Polygon, unit: np.ndarray, points_px: np.ndarray, tolerance_px: float) -> bool:
    """Whether a ring's points are part of a lattice: shifted by the steps between them they meet others (M, 2)."""
    on_ring = points_px[polygon.members]
    lit = unit[polygon.corners >= 0]
    free, _ = cv2.findHomography(lit, on_ring)
    others = np.delete(points_px, polygon.members, axis=0)
    mappings = [polygon.mapping] if free is None else [polygon.mapping, free]
    return len(others) > 0 and any(_meets(on_ring, mapping, others, tolerance_px) for mapping in mappings)


def _meets(on_ring: np.ndarray, mapping: np.ndarray, others: np.ndarray, tolerance_px: float) -> bool:
    """Whether points of a ring, shifted in the plane of a mapping, meet others more often than by chance."""
    from scipy.special import bdtrc  # takes a third of a second to import, which few pictures need

    some = np.linspace(0, len(on_ring) - 1, min(len(on_ring), _MOST_SHIFTED)).round().astype(int)
    flat = cv2.perspectiveTransform(on_ring[None, some], np.linalg.inv(mapping))[0]
    shifted = (flat[:, None, None] + flat[None, :, None] - flat[None, None, :]).reshape(-1, 2)
    shifted = shifted[shifted @ mapping[2, :2] + mapping[2, 2] > _LEAST_DEPTH]
    places = cv2.perspectiveTransform(shifted[None], mapping)[0]
    places = places[nearest_of(places, on_ring, 1)[0][:, 0] > 2 * tolerance_px]
    middle = on_ring.mean(axis=0)
    reach = np.linalg.norm(places - middle, axis=1).max(initial=1.0)
    others = others[np.linalg.norm(others - middle, axis=1) < reach]
    if not len(others) or not len(places):
        return False
    off_px = nearest_of(others, places, 1)[0][:, 0]
    # Of a small ring only a few are near, which say more where they are as exact as its lights.
    within_px = np.array([tolerance_px, _CLOSE * tolerance_px])
    met = (off_px[:, None] < within_px).sum(axis=0)
    chance = np.minimum(1.0, len(places) * (within_px / reach) ** 2)
    return bool((bdtrc(met - 1.0, len(others), chance) < ACCEPTED_AMONG_OTHERS / 2).any())


def is_every_nth(one: Candidate) -> bool:
    """Whether six lights or more are every second of the dock's, or every third, which those left of it hardly are."""
    lit = np.flatnonzero(one.polygon.corners >= 0)
    steps = np.diff(lit, append=lit[0] + one.sides)
    return bool(steps[0] > 1 and (steps == steps[0]).all() and len(lit) > MIN_POINTS)


def trouble_with(
    best: Candidate, exact: Candidate, found: list[Candidate], dock: Dock, scene: Scene, tolerance: float
) -> str | None:
    """Why it is open whether the best ring, ``exact`` without outliers, is the dock; None where it is not."""
    unit = places_of(best.sides, dock)
    within = reach_px(best, tolerance)
    if goes_on(best.polygon, unit, scene.points_px, within):
        return f"The groups repeat as in a lattice. {SEVERAL}"
    if is_part_of_more(best, exact, scene, within):
        return f"More lights lie on one ring than a part of {best.sides}, so it is not the dock's."
    if is_every_nth(best):
        return f"{len(best.members)} lights are evenly spaced, and the dock has {best.sides}: another ring."
    for other in found:
        if other is best or other.log_chance > AS_CONVINCING * best.log_chance:
            continue
        if not other.members & best.members:
            if _on_same_ellipse(best.polygon, other.polygon):
                more = len(best.members) + len(other.members)
                return f"{more} lights lie on one ring, but the dock has {best.sides}."
        elif not _is_same(other, best):
            return SEVERAL
    return None


def reach_px(one: Candidate, tolerance: float) -> float:
    """How far from its place on a ring a light may lie."""
    return max(tolerance, TOLERANCE_OF_RADIUS * one.polygon.semi_axes_px[1])


def is_part_of_more(best: Candidate, exact: Candidate, scene: Scene, within_px: float) -> bool:
    """Whether more lights lie on a ring's ellipse than the dock has, and than chance would put there."""
    members, points_px = exact.polygon.members, scene.points_px
    # Specks are no lights, and what is near a light is a part of it.
    is_light = scene.brightness > _SPECK * np.median(scene.brightness[members])
    is_light[best.polygon.members] = False
    is_light &= distances(points_px, points_px[best.polygon.members]).min(axis=1) > 2 * within_px
    is_light[np.setdiff1d(best.polygon.members, members)] = True
    radius = exact.polygon.semi_axes_px[0]
    others = np.flatnonzero(is_light & (np.hypot(*(points_px - exact.polygon.centre_px).T) < 2 * radius))
    try:
        ellipse = fit_ellipse(points_px[members])
    except NoEllipseError:
        return False
    is_on = ellipse.distances(points_px[others]) < within_px
    count, on = len(members), int(is_on.sum())
    # No more than the dock has are its own: where some run together, groups stand between their places.
    if count + on <= best.sides or on < max(_FEWEST_OTHERS, _UNEXPLAINED * count):
        return False
    from scipy.special import pdtrc  # takes a third of a second to import, which few pictures need

    # The band along the ellipse, of the disc in which the others are counted.
    expected = float((~is_on).sum()) * min(1.0, within_px / radius)
    return float(pdtrc(on - 1, max(expected, _LEAST_EXPECTED))) < ACCEPTED


def _is_same(one: Candidate, other: Candidate) -> bool:
    """Whether two rings are one, but for lights that one of them misses."""
    size = max(one.polygon.semi_axes_px[0], other.polygon.semi_axes_px[0])
    return _on_same_ellipse(one.polygon, other.polygon, _SAME_RING) and (
        one.members <= other.members or other.members <= one.members or size < 2 * TOLERANCE_PX
    )


def _on_same_ellipse(one: Polygon, other: Polygon, within: float = _SAME_ELLIPSE) -> bool:
    """Whether the centres and axes of two rings' images are the same, within this share of the radius."""
    radius = max(one.semi_axes_px[0], other.semi_axes_px[0])
    differ = math.dist(one.centre_px, other.centre_px), *np.subtract(one.semi_axes_px, other.semi_axes_px)
    return all(abs(value) < within * radius for value in differ)
