"""Groups that repeat in a lattice: rings can be laid through them that are exact, and no dock."""

import math

import cv2
import numpy as np
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
    from scipy.spatial import KDTree  # takes a third of a second to import, which few pictures need

    tree = KDTree(points_px)
    steps_px, near = (np.asarray(found)[:, 1:] for found in tree.query(points_px, k=_NEIGHBOURS + 1))
    away = points_px[near] - points_px[:, None]
    off_px, opposite = (np.asarray(found) for found in tree.query(points_px[:, None] - away))
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
    from scipy.spatial import KDTree  # takes a third of a second to import, which few pictures need
    from scipy.special import bdtrc

    some = np.linspace(0, len(on_ring) - 1, min(len(on_ring), _MOST_SHIFTED)).round().astype(int)
    flat = cv2.perspectiveTransform(on_ring[None, some], np.linalg.inv(mapping))[0]
    shifted = (flat[:, None, None] + flat[None, :, None] - flat[None, None, :]).reshape(-1, 2)
    shifted = shifted[shifted @ mapping[2, :2] + mapping[2, 2] > 0.1]
    places = cv2.perspectiveTransform(shifted[None], mapping)[0]
    places = places[KDTree(on_ring).query(places)[0] > 2 * tolerance_px]
    middle = on_ring.mean(axis=0)
    reach = np.linalg.norm(places - middle, axis=1).max(initial=1.0)
    others = others[np.linalg.norm(others - middle, axis=1) < reach]
    if not len(others) or not len(places):
        return False
    off_px = KDTree(places).query(others)[0]
    # Of a small ring only a few are near, which say more where they are as exact as its lights.
    within_px = np.array([tolerance_px, _CLOSE * tolerance_px])
    met = (off_px[:, None] < within_px).sum(axis=0)
    chance = np.minimum(1.0, len(places) * (within_px / reach) ** 2)
    return bool((bdtrc(met - 1.0, len(others), chance) < ACCEPTED_AMONG_OTHERS / 2).any())
