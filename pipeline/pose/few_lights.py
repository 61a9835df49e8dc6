"""The dock's pose from a few lights, too few for a certain ellipse, where their spacing is known."""

import math
from itertools import combinations
from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points
from dockpose.dock import Dock
from dockpose.lights.ellipse import NoEllipseError
from dockpose.pose.assignments import FEWEST, assignments, basis_of, plane_of, squares_of
from dockpose.pose.choice import Choice, choice_of
from dockpose.pose.placement import Placement
from dockpose.pose.refine import HOPELESS, HOPELESS_PX2, Fit, LightRays, light_rays, refine
from dockpose.pose.uncertainty import WORTH_OF_EVIDENCE, log_evidence

_COLLINEAR = 1e-3  # smaller to larger spread of the points
_DIFFERENT_RAD = math.radians(1.0)  # poses that differ by less are shown as one
_DIFFERENT_SHARE = 0.01  # of the range
_SAME = 0.1  # of either: two starts that came so close to each other found the same pose
# Assignments that are refined: some whatever their squares, which are to first order, and of those that are at all as
# likely (by e^-7) a few more. All others count in the probabilities by these squares.
_LEAST_REFINED, _MOST_REFINED, _UNLIKELY = 6, 24, 7.0
_NEGLIGIBLE_PX2 = 100.0  # and as many times the best one's: too much to count


def poses_from_few_lights(points_px: Any, camera: Camera, dock: Dock) -> Choice:
    """Find the pose by three or more lights (N, 2); see docs/method.md."""
    points = as_points("points_px", points_px, 2)
    _check(points, dock)
    middle = points.mean(axis=0)
    order = np.argsort(np.arctan2(*(points - middle).T[::-1]), kind="stable")
    rows = assignments(len(points), dock)
    rays = light_rays(points[order], camera)
    if len(points) == FEWEST:
        best, squares = np.arange(len(rows)), np.zeros(len(rows))
        which, rotations, positions = _starts_of_three(rays.tangents, dock.light_angles_rad()[rows], dock.radius)
    else:
        rays, best, squares = _best(rays, points[order], camera, dock)
        which, rotations, positions = _starts(rays.tangents, dock.light_angles_rad()[rows[best]], dock.radius)
    if not len(which):
        raise NoEllipseError("no pose of the dock explains the lights")
    if camera.port is not None:
        rays = light_rays(points[order], camera, float(np.median(positions[:, 2])))
    which = best[which]
    fit = _refined(rotations, positions, which, dock.light_angles_rad()[rows[which]], dock.radius, rays)
    fit, which = _distinct(fit, which)
    weights = _weights(fit)
    kept = _different(fit, weights)
    rest = np.delete(squares, best)
    total = weights.sum() + _weight_of_rest(fit, weights, rest)
    chosen = kept[:2]
    lights = np.empty((len(chosen), len(points)), dtype=int)
    lights[:, order] = rows[which[chosen]]
    known = dock.light_angles_rad()
    period = 2 * math.pi if dock.angles_deg else 2 * math.pi / len(known)
    placement = Placement(lights, np.zeros(len(chosen)), known[lights], [True] * len(chosen), period)
    return choice_of(fit.taken(chosen), (weights[chosen] / total).tolist(), placement, "spacing", camera, dock, rays)


def _refined(
    rotations: np.ndarray,
    positions_m: np.ndarray,
    which: np.ndarray,
    angles_rad: np.ndarray,
    radius_m: float,
    rays: LightRays,
) -> Fit:
    """Refined poses; those of the best one's assignment that were given up as far worse are refined to their end."""
    fit = refine(rotations, positions_m, angles_rad, radius_m, rays)
    best = int(np.argmin(fit.squares_px2))
    worse = fit.squares_px2 > HOPELESS * fit.squares_px2[best] + HOPELESS_PX2
    for row in np.flatnonzero(worse & (which == which[best])).tolist():
        only = [row]
        again = refine(fit.rotations[only], fit.positions_m[only], angles_rad[only], radius_m, rays)
        for name in ("rotations", "positions_m", "squares_px2", "covariances"):
            getattr(fit, name)[only] = getattr(again, name)
    return fit


def _check(points: np.ndarray, dock: Dock) -> None:
    if not np.isfinite(points).all():
        raise NoEllipseError("a point is not finite")
    if dock.lights is None:
        raise NoEllipseError("the number of lights is not known, without which an ellipse needs 5 of them")
    different = len(set(map(tuple, points.tolist())))
    if different < max(FEWEST, len(points)):
        raise NoEllipseError(f"a pose needs {FEWEST} different lights, there are {different} in {len(points)}")
    if len(points) > dock.lights:
        raise NoEllipseError(f"there are {len(points)} lights, but the dock has {dock.lights}")
    small, large = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[::-1]
    if small < _COLLINEAR * large:
        raise NoEllipseError("the points lie on a line")


def _best(
    rays: LightRays, points_px: np.ndarray, camera: Camera, dock: Dock
) -> tuple[LightRays, np.ndarray, np.ndarray]:
    """The rays, the assignments that explain them best, and the squares (K,) of all."""
    squares = squares_of(dock, rays.tangents, rays.slopes_px)
    best = _likeliest(squares, 2 * len(points_px) - 6)
    if camera.port is None or not len(best):
        return rays, best, squares
    angles = dock.light_angles_rad()[assignments(len(points_px), dock)[best]]
    for _ in range(2):
        positions = _starts(rays.tangents, angles, dock.radius)[2]
        if not len(positions):
            break
        rays = light_rays(points_px, camera, float(np.median(positions[:, 2])))
        meeting = rays.tangents * (1 - rays.starts_m / np.median(positions[:, 2]))[:, None]
        rays = LightRays(meeting, np.zeros(len(meeting)), rays.slopes_px)
    squares = squares_of(dock, rays.tangents, rays.slopes_px)
    return rays, _likeliest(squares, 2 * len(points_px) - 6), squares


def _likeliest(squares: np.ndarray, freedom: int) -> np.ndarray:
    """Numbers of the assignments to refine, by their squares (K,)."""
    count = min(_MOST_REFINED, len(squares))
    best = np.argpartition(squares, count - 1)[:count]
    best = best[np.isfinite(squares[best])]
    best = best[np.argsort(squares[best], kind="stable")]
    evidence = log_evidence(squares[best], freedom)
    return best[(evidence > evidence[:1] - _UNLIKELY) | (np.arange(len(best)) < _LEAST_REFINED)]


def _starts(tangents: np.ndarray, angles_rad: np.ndarray, radius_m: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """For K assignments (K, N) of angles to the points both poses of the homography of four of them."""
    four = _widest(tangents)
    A = basis_of(np.column_stack([tangents[four], np.ones(4)])[None])
    if A is None:
        return np.empty(0, dtype=int), np.empty((0, 3, 3)), np.empty((0, 3))
    lights = np.stack([np.cos(angles_rad[:, four]), np.sin(angles_rad[:, four])], axis=-1)
    centre = lights.mean(axis=1)
    H = A @ plane_of(np.concatenate([lights - centre[:, None], np.ones((*lights.shape[:2], 1))], axis=2))
    H = H / H[:, 2:, 2:]
    # A point of the plane and its surroundings, as they are seen; turned so that the line of sight is the axis.
    seen = H[:, :2, 2]
    slopes = H[:, :2, :2] - seen[:, :, None] * H[:, 2:, :2]
    ahead = np.concatenate([seen, np.ones((len(seen), 1))], axis=1)
    sight = ahead / np.linalg.norm(ahead, axis=1, keepdims=True)
    x, y, z = sight.T
    c = 1 / (1 + z)
    turned = [1 - c * x * x, -c * x * y, x, -c * x * y, 1 - c * y * y, y, -x, -y, z]  # the shortest way
    turned = np.stack(turned, axis=1).reshape(-1, 3, 3)
    local = np.linalg.solve(turned[:, :2, :2] - seen[:, :, None] * turned[:, 2:, :2], slopes)
    xx, xy, yy = ((local[:, i] * local[:, j]).sum(axis=1) for i, j in ((0, 0), (0, 1), (1, 1)))
    nearness = np.sqrt((xx + yy) / 2 + np.hypot((xx - yy) / 2, xy))
    flat = local / nearness[:, None, None]
    lengths = np.maximum(0.0, 1 - (flat * flat).sum(axis=1))
    x, y = np.sqrt(lengths).T
    y = np.where((flat[:, :, 0] * flat[:, :, 1]).sum(axis=1) > 0, -y, y)
    which, rotations, positions = [], [], []
    for sign in (1.0, -1.0):
        columns = np.concatenate([flat, sign * np.stack([x, y], axis=-1)[:, None]], axis=1)
        R = turned @ np.concatenate([columns, np.cross(columns[:, :, 0], columns[:, :, 1])[:, :, None]], axis=2)
        t = radius_m * (ahead / nearness[:, None] - (R[:, :, :2] @ centre[:, :, None])[..., 0])
        with np.errstate(invalid="ignore"):
            good = np.isfinite(R).all(axis=(1, 2)) & (t[:, 2] > radius_m) & ((R[:, :, 2] * t).sum(axis=1) > 0)
        which.append(np.flatnonzero(good))
        rotations.append(R[good])
        positions.append(t[good])
    return np.concatenate(which), np.concatenate(rotations), np.concatenate(positions)


def _widest(tangents: np.ndarray) -> list[int]:
    """The four of the points, in order, whose smallest triangle is largest: they tell the homography best."""
    corners, fours = np.column_stack([tangents, np.ones(len(tangents))]), list(combinations(range(len(tangents)), 4))
    triangles = np.array([list(combinations(four, 3)) for four in fours])
    return list(fours[int(np.abs(np.linalg.det(corners[triangles])).min(axis=1).argmax())])


def _starts_of_three(
    tangents: np.ndarray, angles_rad: np.ndarray, radius_m: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The same of three points, that fit every assignment in up to four poses."""
    which, rotations, positions = [], [], []
    for row, angles in enumerate(angles_rad):
        model = radius_m * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(len(angles))])
        _, turns, shifts = cv2.solveP3P(model, tangents, np.eye(3), None, cv2.SOLVEPNP_AP3P)
        for turn, shift in zip(turns, shifts, strict=True):
            R, t = cv2.Rodrigues(turn)[0], shift.ravel()
            if np.isfinite(t).all() and np.isfinite(R).all() and t[2] > radius_m and R[:, 2] @ t > 0:
                which.append(row)
                rotations.append(R)
                positions.append(t)
    return np.array(which, dtype=int), np.array(rotations), np.array(positions)


def _apart(fit: Fit) -> np.ndarray:
    """How different (K, K) poses are: 1 where they differ by as much as two that are shown as different ones."""
    normals, positions = fit.rotations[:, :, 2], fit.positions_m
    turned = np.linalg.norm(normals[:, None] - normals, axis=2) / _DIFFERENT_RAD
    moved = np.linalg.norm(positions[:, None] - positions, axis=2) / (_DIFFERENT_SHARE * positions[:, None, 2])
    return np.maximum(turned, moved)


def _distinct(fit: Fit, which: np.ndarray) -> tuple[Fit, np.ndarray]:
    """Refined poses in front of the camera that face it, best first, each of an assignment's poses once."""
    good = np.isfinite(fit.positions_m).all(axis=1) & np.isfinite(fit.covariances).all(axis=(1, 2))
    good &= (fit.positions_m[:, 2] > 0) & ((fit.rotations[:, :, 2] * fit.positions_m).sum(axis=1) > 0)
    rows = np.flatnonzero(good)
    if not len(rows):
        raise NoEllipseError("no pose of the dock explains the lights")
    rows = rows[np.argsort(fit.squares_px2[rows], kind="stable")]
    fit, which = fit.taken(rows), which[rows]
    again = (_apart(fit) < _SAME) & (which[:, None] == which)
    once = ~np.tril(again, -1).any(axis=1)
    return fit.taken(np.flatnonzero(once)), which[once]


def _weights(fit: Fit) -> np.ndarray:
    """How likely each pose is, up to a factor that all share."""
    freedom = fit.numbers - 6
    range_m = np.linalg.norm(fit.positions_m, axis=1)
    facing = (fit.rotations[:, :, 2] * fit.positions_m).sum(axis=1) / range_m
    determined = np.linalg.slogdet(fit.covariances)[1] / 2
    logs = WORTH_OF_EVIDENCE * log_evidence(fit.squares_px2, freedom) + determined
    logs += 2 * np.log(np.maximum(facing, 1e-3)) - 3 * np.log(range_m)
    return np.exp(logs - logs.max())


def _weight_of_rest(fit: Fit, weights: np.ndarray, squares: np.ndarray) -> float:
    """What assignments that were not refined weigh together: as those refined, but for their squares."""
    squares = squares[squares < _NEGLIGIBLE_PX2 * (1 + fit.squares_px2.min())]
    if not len(squares):
        return 0.0
    freedom = fit.numbers - 6
    usual = np.median(np.log(np.maximum(weights, 1e-300)) - WORTH_OF_EVIDENCE * log_evidence(fit.squares_px2, freedom))
    return float(np.exp(usual + WORTH_OF_EVIDENCE * log_evidence(squares, freedom)).sum())


def _different(fit: Fit, weights: np.ndarray) -> np.ndarray:
    """Numbers of the poses, likeliest first, each different from those before."""
    left, kept = np.argsort(-weights, kind="stable"), []
    apart = _apart(fit)
    while len(left):
        kept.append(left[0])
        left = left[apart[left[0], left] >= 1]
    return np.array(kept)
