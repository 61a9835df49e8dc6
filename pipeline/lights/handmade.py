"""Rings that hands have built: lights off their places along the rim, and less across it, as far as chance allows."""

import math
from collections.abc import Sequence
from operator import attrgetter

import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.lights.chance import Scene
from dockpose.lights.conics import conics_of_fives
from dockpose.lights.ellipse import MIN_POINTS, NoEllipseError, axes_of, fit_ellipse
from dockpose.lights.growing import NARROWEST, SMALLEST_RADIUS_PX
from dockpose.lights.polygon import Candidate, least_likely_part
from dockpose.lights.reprojection import RingTemplate, as_pose, flatten, turned
from dockpose.lights.spacing import phase_of, regular

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
    mapping, flat = np.empty((3, 3)), np.empty((len(points), 2))
    _set_affine(ellipse.conic, 0.0, mapping)
    flatten(mapping, points, flat)
    order = np.argsort(flat[:, 1])
    return order, turned(mapping, phase_of(flat[order, 1] - 2 * math.pi / len(points) * np.arange(len(points)), 1))


def _begun(points: np.ndarray, numbers: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Numbers of lights with the points at their corners (K, 1 + N), homographies (K, 3, 3), of the best ellipses."""
    conics, places, middle, scale = conics_of_fives(points, _TRIALS)
    corners, mappings = _best_of(conics, places, numbers, SMALLEST_RADIUS_PX / scale, _KEPT)
    return corners, np.array([[scale, 0, middle[0]], [0, scale, middle[1]], [0, 0, 1]]) @ mappings


@compiled
def _best_of(
    conics: np.ndarray, places: np.ndarray, numbers: np.ndarray, least_radius: float, most: int
) -> tuple[np.ndarray, np.ndarray]:
    """As ``_begun``, of conics (T, 6) among places (M, 2)."""
    width = 1 + max(numbers.max(), 1)
    corners, mappings, worths = np.full((most, width), -1), np.zeros((most, 3, 3)), np.zeros(most)
    own, logs, mapping = np.full(width, -1), np.empty(width), np.empty((3, 3))
    flat = np.empty((len(places), 2))
    if len(numbers) > 1:
        conics = conics[np.argsort(_off_all(conics, places, least_radius))[:_OF_ANY_NUMBER]]
    for t in range(len(conics)):
        if not _set_affine(conics[t], least_radius, mapping):
            continue
        around = flatten(mapping, places, flat)
        for sides in numbers:
            least = np.argmax(worths)
            worth, roll = _placed(flat, around, sides, own, logs)
            if worth < worths[least] and not _is_among(corners, own):
                worths[least], corners[least] = worth, own
                mappings[least] = turned(mapping, roll)
    order = np.argsort(worths)[: np.count_nonzero(worths < 0)]
    return corners[order], mappings[order]


@compiled
def _is_among(rows: np.ndarray, own: np.ndarray) -> bool:
    """Whether a row (N,) is one of rows (K, N)."""
    found = False
    for row in rows:
        found |= (row == own).all()
    return found


@compiled
def _off_all(conics: np.ndarray, places: np.ndarray, least_radius: float) -> np.ndarray:
    """Log (T,) of how often chance lays places (M, 2) so near each of conics (T, 6); 0 of one that is no ring."""
    logs, flat, mapping = np.zeros(len(conics)), np.empty((len(places), 2)), np.empty((3, 3))
    for t in range(len(conics)):
        is_ellipse = _set_affine(conics[t], least_radius, mapping)
        near = flatten(mapping, places, flat) if is_ellipse else 1.0
        for k in range(len(places) if is_ellipse else 0):
            logs[t] += np.log(min(1.0, near * max(abs(flat[k, 0]), _LEAST_ACROSS)))
    return logs


@compiled_bare
def _set_affine(conic: np.ndarray, least_radius: float, mapping: np.ndarray) -> bool:
    """Fill in the map (3, 3) of the unit circle to a conic (6,), if that is an ellipse that a ring may have."""
    x, y, major, minor, turn = axes_of(conic)
    turn -= np.copysign(np.pi / 2, turn)  # corners are numbered from the minor axis
    cos, sin = np.cos(turn), np.sin(turn)
    mapping[0, 0], mapping[0, 1], mapping[0, 2] = minor * cos, -major * sin, x
    mapping[1, 0], mapping[1, 1], mapping[1, 2] = minor * sin, major * cos, y
    mapping[2, 0], mapping[2, 1], mapping[2, 2] = 0.0, 0.0, 1.0
    return minor > NARROWEST * major and minor > least_radius


@compiled
def _placed(flat: np.ndarray, near: float, sides: int, corners: np.ndarray, logs: np.ndarray) -> tuple[float, float]:
    """Fill in N and the likeliest point of each corner; log of how often chance lays them so near, and the roll."""
    corners[:] = -1
    corners[0] = sides
    roll, step = phase_of(flat[:, 1][np.abs(flat[:, 0]) < ON_RIM], sides), 2 * np.pi / sides
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
        mapping = turned(mapping, roll)
    return fitted, mapping
