"""Rings that hands have built: lights off their places along the rim, and less across it, as far as chance allows."""

import math
from collections.abc import Sequence
from dataclasses import replace
from operator import attrgetter

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.chance import LEAST_CROWD, Candidate, Scene, accepted
from dockpose.lights.conics import conics_through, fives_of
from dockpose.lights.ellipse import MIN_POINTS, NoEllipseError, fit_ellipse
from dockpose.lights.growing import NARROWEST, SMALLEST_RADIUS_PX
from dockpose.lights.polygon import Polygon, refitted, regular, without_worst
from dockpose.lights.whole import angles_on

_TRIALS = 3003  # fives of points: all of fifteen
_OF_ANY_NUMBER = 150  # of these: those near most points, which are tried with many numbers of lights
_KEPT = 16  # ellipses, the most promising
_ROUNDS = 3  # of fitting a pose and looking which points are its lights
# In radii: how far off the circle a light may lie, and points along the rim, which tell the roll; the least offsets
# that tell anything.
_BAND, ON_RIM, _LEAST_ACROSS, _LEAST_ALONG = 0.25, 0.15, 0.01, 0.02


def handmade_rings(scene: Scene, chosen: np.ndarray, numbers: Sequence[int]) -> list[Candidate]:
    """Rings of evenly meant lights among the chosen points that chance would hardly make; the surest first."""
    if len(chosen) < MIN_POINTS:
        return []
    points = np.ascontiguousarray(scene.points_px[chosen])
    best: dict[frozenset[int], Candidate] = {}
    whole = _of_all(points, scene.focal_px) if len(points) in numbers else None
    if whole is not None and (ring := _least_likely(whole, chosen, len(points), scene)) is not None:
        best[ring.members] = ring
    corners, mappings = _begun(points, np.array(numbers))
    for row, mapping in zip(corners, mappings, strict=True):
        sides = int(row[0])
        polygon = _settled(row[1 : sides + 1], mapping, points, sides, scene.focal_px)
        ring = None if polygon is None else _least_likely(polygon, chosen, sides, scene)
        if ring is not None:
            best.setdefault(ring.members, ring)
    return sorted(best.values(), key=lambda candidate: candidate.log_chance)


def _of_all(points: np.ndarray, focal_px: float) -> Polygon | None:
    """The polygon of all points (N, 2) in their order around the ellipse through them; None where there is none."""
    try:
        ellipse = fit_ellipse(points)
    except NoEllipseError:
        return None
    angles = angles_on(points, ellipse)
    order = np.argsort(angles)
    roll = float((angles[order] - 2 * math.pi / len(points) * np.arange(len(points))).mean())
    mapping = _turned(ellipse.angle_rad) @ np.diag([*ellipse.semi_axes_px, 1.0]) @ _turned(roll)
    mapping[:2, 2] = ellipse.centre_px
    return refitted(order, mapping, points, regular(len(points)), focal_px)


@compiled
def _turned(roll: float) -> np.ndarray:
    """Map (3, 3) that turns a plane by an angle."""
    cos, sin = np.cos(roll), np.sin(roll)
    return np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])


def _begun(points: np.ndarray, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of lights with the points at their corners (K, 1 + N), homographies (K, 3, 3), of the best ellipses."""
    count = len(points)
    middle, scale = points.mean(axis=0), max(float(points.std()), 1e-9)
    places = np.column_stack([(points - middle) / scale, np.ones(count)])
    conics = conics_through(places[fives_of(count, _TRIALS)])
    corners, mappings = _best_of(conics, places, numbers, SMALLEST_RADIUS_PX / scale, _KEPT)
    return corners, np.array([[scale, 0, middle[0]], [0, scale, middle[1]], [0, 0, 1]]) @ mappings


@compiled
def _best_of(
    conics: np.ndarray, places: np.ndarray, numbers: np.ndarray, least_radius: float, most: int
) -> tuple[np.ndarray, np.ndarray]:
    """As ``_begun``, of conics (T, 6) among homogeneous places (M, 3)."""
    width = 1 + max(numbers.max(), 1)
    corners, mappings = np.full((most, width), -1), np.zeros((most, 3, 3))
    worths = np.zeros(most)
    own = np.full(width, -1)
    flat = np.empty((len(places), 2))
    if len(numbers) > 1:
        conics = conics[np.argsort(_off_all(conics, places, least_radius))[:_OF_ANY_NUMBER]]
    for t in range(len(conics)):
        is_ellipse, mapping = _affine_of(conics[t], least_radius)
        if not is_ellipse:
            continue
        around = _flatten(mapping, places, flat)
        for sides in numbers:
            least = np.argmax(worths)
            worth, roll = _placed(flat, around, sides, own)
            is_new = worth < worths[least]
            for k in range(most):
                is_new = is_new and not (own == corners[k]).all()
            if is_new:
                worths[least], corners[least] = worth, own
                mappings[least] = mapping @ _turned(roll)
    order = np.argsort(worths)[: np.count_nonzero(worths < 0)]
    return corners[order], mappings[order]


@compiled
def _off_all(conics: np.ndarray, places: np.ndarray, least_radius: float) -> np.ndarray:
    """Log (T,) of how often chance lays places (M, 3) so near each of conics (T, 6); 0 of one that is no ring."""
    logs, flat = np.zeros(len(conics)), np.empty((len(places), 2))
    for t in range(len(conics)):
        is_ellipse, mapping = _affine_of(conics[t], least_radius)
        near = _flatten(mapping, places, flat) if is_ellipse else 1.0
        for k in range(len(places) if is_ellipse else 0):
            logs[t] += np.log(min(1.0, near * max(abs(flat[k, 0]), _LEAST_ACROSS)))
    return logs


@compiled
def _affine_of(conic: np.ndarray, least_radius: float) -> tuple[bool, np.ndarray]:
    """Whether a conic (6,) is an ellipse that a ring may have, and the map (3, 3) of the unit circle to it."""
    A, B, C, D, E, F = conic
    mapping = np.eye(3)
    apart = 4 * A * C - B * B
    if apart <= 0:
        return False, mapping
    x, y = (B * E - 2 * C * D) / apart, (B * D - 2 * A * E) / apart
    inside = -(F + (D * x + E * y) / 2)
    mean, half = (A + C) / 2, np.hypot((A - C) / 2, B / 2)
    if inside < 0:
        inside, mean, turn = -inside, -mean, np.arctan2(-B, C - A) / 2
    else:
        turn = np.arctan2(B, A - C) / 2
    if mean <= half:
        return False, mapping
    minor, major = np.sqrt(inside / (mean + half)), np.sqrt(inside / (mean - half))
    cos, sin = np.cos(turn), np.sin(turn)
    mapping[0, 0], mapping[0, 1], mapping[0, 2] = minor * cos, -major * sin, x
    mapping[1, 0], mapping[1, 1], mapping[1, 2] = minor * sin, major * cos, y
    return minor > NARROWEST * major and minor > least_radius, mapping


@compiled
def _flatten(mapping: np.ndarray, places: np.ndarray, flat: np.ndarray) -> float:
    """Fill in radius less 1 and angle (M, 2) of homogeneous places (M, 3) in a circle's plane; how many are near it."""
    inverse = np.linalg.inv(mapping)
    near = 1.0
    for k in range(len(places)):
        x = inverse[0, 0] * places[k, 0] + inverse[0, 1] * places[k, 1] + inverse[0, 2]
        y = inverse[1, 0] * places[k, 0] + inverse[1, 1] * places[k, 1] + inverse[1, 2]
        w = inverse[2, 0] * places[k, 0] + inverse[2, 1] * places[k, 1] + inverse[2, 2]
        x, y = x / w, y / w
        flat[k, 0], flat[k, 1] = np.hypot(x, y) - 1, np.arctan2(y, x)
        near += flat[k, 0] < 1
    return near


@compiled
def _placed(flat: np.ndarray, near: float, sides: int, corners: np.ndarray) -> tuple[float, float]:
    """Fill in N and the likeliest point of each corner; log of how often chance lays them so near, and the roll."""
    corners[:] = -1
    corners[0] = sides
    sine, cosine = 0.0, 0.0
    for k in range(len(flat)):
        if abs(flat[k, 0]) < ON_RIM:
            sine += np.sin(sides * flat[k, 1])
            cosine += np.cos(sides * flat[k, 1])
    roll, step = np.arctan2(sine, cosine) / sides, 2 * np.pi / sides
    logs = np.zeros(sides)
    for k in range(len(flat)):
        across = abs(flat[k, 0])
        if across > _BAND:
            continue
        slot = (flat[k, 1] - roll) / step
        corner = int(np.rint(slot))
        along = step * abs(slot - corner)
        # The share of the disc of two radii in which points are counted that is as near to a corner.
        log = np.log(min(1.0, near * max(along, _LEAST_ALONG) * max(across, _LEAST_ACROSS) / np.pi))
        if log < logs[corner % sides]:
            logs[corner % sides] = log
            corners[1 + corner % sides] = k
    return logs.sum(), roll


def _settled(
    corners: np.ndarray, mapping: np.ndarray, points: np.ndarray, sides: int, focal_px: float
) -> Polygon | None:
    """The polygon that points at corners (N,) begin, fitted as a pose; None where too few of them stay."""
    unit, row, flat = regular(sides), np.full(sides + 1, -1), np.empty((len(points), 2))
    places = np.column_stack([points, np.ones(len(points))])
    polygon = None
    for _ in range(_ROUNDS):
        if np.count_nonzero(corners >= 0) < MIN_POINTS:
            return None
        polygon = refitted(corners, mapping, points, unit, focal_px)
        if abs(np.linalg.det(polygon.mapping)) < 1e-9:
            return None
        near = _flatten(polygon.mapping, places, flat)
        _, roll = _placed(flat, near, sides, row)
        if (row[1:] == corners).all():
            break
        corners, mapping = row[1:].copy(), polygon.mapping @ _turned(roll)
    return polygon


def _least_likely(polygon: Polygon, chosen: np.ndarray, sides: int, scene: Scene) -> Candidate | None:
    """The ring of a polygon among the chosen points without those that make it likelier to be chance; None of none."""
    polygon = replace(polygon, corners=np.where(polygon.corners >= 0, chosen[polygon.corners], -1))
    rings = [accepted(polygon, sides, scene, is_exact=False)]
    while len(polygon.members) > LEAST_CROWD:
        polygon = without_worst(polygon, scene.points_px, regular(sides))
        rings.append(accepted(polygon, sides, scene, is_exact=False))
    return min(filter(None, rings), key=attrgetter("log_chance"), default=None)
