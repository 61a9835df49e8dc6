"""Groups that repeat in a lattice: rings can be laid through them that are exact, and no dock."""

import math

import cv2
import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.chance import ACCEPTED_AMONG_OTHERS
from dockpose.lights.growing import TOLERANCE_PX
from dockpose.lights.polygon import Polygon

_NEIGHBOURS = 8  # of a lattice's point: the nearest of a square one
_TOLERANCE = 0.05  # of a step, by which perspective and lens change it from one point to the next
_CLOSE = 0.25  # of how far off a light may be: more than its centre's error, mostly
_MOST_SHIFTED = 16  # lights of a ring, whose third power is looked at: steps between so many show any lattice
_LEAST_ANGLE = math.sin(math.radians(20))  # between a lattice's two directions, as steeply as it may be seen


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
    shifted = shifted[shifted @ mapping[2, :2] + mapping[2, 2] > 0.1]
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
