"""Rings that hands have built: lights off their places along the rim, and less across it, as far as chance allows."""

import math
from collections.abc import Sequence
from operator import attrgetter

import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.lights.chance import Scene
from dockpose.lights.conics import conics_through, fives_of
from dockpose.lights.ellipse import MIN_POINTS, NoEllipseError, fit_ellipse
from dockpose.lights.growing import NARROWEST, SMALLEST_RADIUS_PX
from dockpose.lights.polygon import Candidate, least_likely_part
from dockpose.lights.reprojection import RingTemplate, as_pose, flatten
from dockpose.lights.spacing import angles_on, phase_of, regular

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
    whole = _of_all(points) if len(points) in numbers else None
    begun = [] if whole is None else [(*whole, 1)]
    for row, mapping in zip(*_begun(points, np.array(numbers)), strict=True):
        begun.append((row[1 : row[0] + 1].copy(), mapping, _ROUNDS))
    best: dict[frozenset[int], Candidate] = {}
    for corners, mapping, rounds in begun:
        ring = _settled_ring(corners, mapping, rounds, points, chosen, scene)
        if ring is not None:
            best.setdefault(ring.members, ring)
    return sorted(best.values(), key=attrgetter("log_chance"))


def _settled_ring(
    corners: np.ndarray, mapping: np.ndarray, rounds: int, points: np.ndarray, chosen: np.ndarray, scene: Scene
) -> Candidate | None:
    """The ring that points (M, 2), those chosen of a scene, begin at corners (N,); None where it may be chance."""
    template = RingTemplate(points, regular(len(corners)), scene.focal_px, 0.0)
    corners, mapping = _settled(template, corners, mapping, rounds)
    if np.count_nonzero(corners >= 0) < MIN_POINTS:
        return None
    corners = np.where(corners >= 0, chosen[corners], -1)
    return least_likely_part(template._replace(points=scene.points_px), corners, mapping, scene, is_exact=False)


def _of_all(points: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """All points (N, 2) in order around the ellipse through them, and its map (3, 3); None where there is none."""
    try:
        ellipse = fit_ellipse(points)
    except NoEllipseError:
        return None
    angles = angles_on(points, ellipse)
    order = np.argsort(angles)
    roll = phase_of(angles[order] - 2 * math.pi / len(points) * np.arange(len(points)), 1)
    mapping = _turned(_turned(np.eye(3), ellipse.angle_rad) @ np.diag([*ellipse.semi_axes_px, 1.0]), roll)
    mapping[:2, 2] = ellipse.centre_px
    return order, mapping


@compiled
def _turned(mapping: np.ndarray, roll: float) -> np.ndarray:
    """A map (3, 3) of a plane that is turned by an angle before."""
    cos, sin, turned = np.cos(roll), np.sin(roll), mapping.copy()
    for row in range(3):
        turned[row, 0] = cos * mapping[row, 0] + sin * mapping[row, 1]
        turned[row, 1] = cos * mapping[row, 1] - sin * mapping[row, 0]
    return turned


def _begun(points: np.ndarray, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of lights with the points at their corners (K, 1 + N), homographies (K, 3, 3), of the best ellipses."""
    middle, scale = points.mean(axis=0), max(float(points.std()), 1e-9)
    places = (points - middle) / scale
    conics = conics_through(np.column_stack([places, np.ones(len(points))])[fives_of(len(points), _TRIALS)])
    corners, mappings = _best_of(conics, places, numbers, SMALLEST_RADIUS_PX / scale, _KEPT)
    return corners, np.array([[scale, 0, middle[0]], [0, scale, middle[1]], [0, 0, 1]]) @ mappings


@compiled
def _best_of(
    conics: np.ndarray, places: np.ndarray, numbers: np.ndarray, least_radius: float, most: int
) -> tuple[np.ndarray, np.ndarray]:
    """As ``_begun``, of conics (T, 6) among places (M, 2)."""
    width = 1 + max(numbers.max(), 1)
    corners, mappings = np.full((most, width), -1), np.zeros((most, 3, 3))
    worths = np.zeros(most)
    own, logs, mapping = np.full(width, -1), np.empty(width), np.empty((3, 3))
    flat = np.empty((len(places), 2))
    if len(numbers) > 1:
        conics = conics[np.argsort(_off_all(conics, places, least_radius))[:_OF_ANY_NUMBER]]
    for t in range(len(conics)):
        if not _set_affine(conics, t, least_radius, mapping):
            continue
        around = flatten(mapping, places, flat)
        for sides in numbers:
            least = np.argmax(worths)
            worth, roll = _placed(flat, around, sides, own, logs)
            if worth < worths[least] and not _is_among(corners, own):
                worths[least], corners[least] = worth, own
                mappings[least] = _turned(mapping, roll)
    order = np.argsort(worths)[: np.count_nonzero(worths < 0)]
    return corners[order], mappings[order]


@compiled_bare
def _is_among(rows: np.ndarray, own: np.ndarray) -> bool:
    """Whether a row (N,) is one of rows (K, N)."""
    for k in range(len(rows)):
        same = 0
        while same < len(own) and rows[k, same] == own[same]:
            same += 1
        if same == len(own):
            return True
    return False


@compiled
def _off_all(conics: np.ndarray, places: np.ndarray, least_radius: float) -> np.ndarray:
    """Log (T,) of how often chance lays places (M, 2) so near each of conics (T, 6); 0 of one that is no ring."""
    logs, flat, mapping = np.zeros(len(conics)), np.empty((len(places), 2)), np.empty((3, 3))
    for t in range(len(conics)):
        is_ellipse = _set_affine(conics, t, least_radius, mapping)
        near = flatten(mapping, places, flat) if is_ellipse else 1.0
        for k in range(len(places) if is_ellipse else 0):
            logs[t] += np.log(min(1.0, near * max(abs(flat[k, 0]), _LEAST_ACROSS)))
    return logs


@compiled_bare
def _set_affine(conics: np.ndarray, t: int, least_radius: float, mapping: np.ndarray) -> bool:
    """Fill in the map (3, 3) of the unit circle to one of conics (T, 6), if that is an ellipse that a ring may have."""
    A, B, C, D, E, F = conics[t, 0], conics[t, 1], conics[t, 2], conics[t, 3], conics[t, 4], conics[t, 5]
    apart = 4 * A * C - B * B
    if apart <= 0:
        return False
    x, y = (B * E - 2 * C * D) / apart, (B * D - 2 * A * E) / apart
    inside = -(F + (D * x + E * y) / 2)
    mean, half = (A + C) / 2, np.hypot((A - C) / 2, B / 2)
    if inside < 0:
        inside, mean, turn = -inside, -mean, np.arctan2(-B, C - A) / 2
    else:
        turn = np.arctan2(B, A - C) / 2
    if mean <= half:
        return False
    minor, major = np.sqrt(inside / (mean + half)), np.sqrt(inside / (mean - half))
    cos, sin = np.cos(turn), np.sin(turn)
    mapping[0, 0], mapping[0, 1], mapping[0, 2] = minor * cos, -major * sin, x
    mapping[1, 0], mapping[1, 1], mapping[1, 2] = minor * sin, major * cos, y
    mapping[2, 0], mapping[2, 1], mapping[2, 2] = 0.0, 0.0, 1.0
    return minor > NARROWEST * major and minor > least_radius


@compiled_bare
def _placed(flat: np.ndarray, near: float, sides: int, corners: np.ndarray, logs: np.ndarray) -> tuple[float, float]:
    """Fill in N and the likeliest point of each corner; log of how often chance lays them so near, and the roll."""
    corners[:] = -1
    corners[0] = sides
    sine, cosine = 0.0, 0.0
    for k in range(len(flat)):
        if abs(flat[k, 0]) < ON_RIM:
            sine += np.sin(sides * flat[k, 1])
            cosine += np.cos(sides * flat[k, 1])
    roll, step = np.arctan2(sine, cosine) / sides, 2 * np.pi / sides
    logs[:], total = 0.0, 0.0
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
            total += log - logs[corner % sides]
            logs[corner % sides] = log
            corners[1 + corner % sides] = k
    return total, roll


@compiled
def _settled(
    template: RingTemplate, corners: np.ndarray, mapping: np.ndarray, rounds: int
) -> tuple[np.ndarray, np.ndarray]:
    """Corners (N,) and homography of the pose that points at corners (N,) begin; of no corners where too few stay."""
    sides, points = len(corners), template.points
    row, logs, flat = np.full(sides + 1, -1), np.empty(sides), np.empty((len(points), 2))
    fitted = corners
    for _ in range(rounds):
        if np.count_nonzero(corners >= 0) < MIN_POINTS:
            return np.full(sides, -1), mapping
        fitted = corners
        mapping = as_pose(template, corners, mapping)[1]
        if not abs(np.linalg.det(mapping)) >= 1e-9:
            return np.full(sides, -1), mapping
        roll = _placed(flat, flatten(mapping, points, flat), sides, row, logs)[1]
        if (row[1:] == corners).all():
            break
        corners = row[1:].copy()
        mapping = _turned(mapping, roll)
    return fitted, mapping
