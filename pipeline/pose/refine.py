"""Refinement: the pose with the least reprojection error, and its covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points
from dockpose.thresholds.compiled import compiled

MAX_STEPS = 15
# Stop after a step that lowers the sum of squares by less than this share or this much; what remains is far less.
_SETTLED, _SETTLED_PX2 = 1e-3, 1e-6
# A pose whose sum of squares exceeds this multiple of the best one's plus this much is certainly wrong.
HOPELESS, HOPELESS_PX2 = 30.0, 2.0
_LONGEST = 0.3  # radians, or a share of the range, in one step
_DAMPING = 1e-9


@dataclass(frozen=True)
class LightRays:
    """The rays of N lights, in terms of a pinhole at the camera's centre."""

    tangents: np.ndarray  # (N, 2): x / z and y / z of the rays in the water
    starts_m: np.ndarray | None  # (N,): z where each ray, followed backwards, meets the camera's axis
    slopes_px: np.ndarray  # (N, 2, 2): how far the picture point moves per step of the tangents


@dataclass(frozen=True)
class Fit:
    """K refined poses."""

    rotations: np.ndarray  # (K, 3, 3): from the dock's frame to the camera's, roll included
    positions_m: np.ndarray  # (K, 3): the dock's centres
    squares_px2: np.ndarray  # (K,): sums of the squared reprojection errors
    # (K, 6, 6): (J^T J)^-1 for a step of the position (metres) and a rotation about the dock's axes (radians), for
    # lights known to one pixel
    covariances: np.ndarray
    numbers: int  # number of residuals
    points: int  # number of lights


def light_rays(points_px: Any, camera: Camera, depth_m: float = 1.0) -> LightRays:
    """Trace picture points (N, 2) into the water; ``depth_m`` is roughly the depth of their lights."""
    points = as_points("points_px", points_px, 2)
    focal, centre = np.array([camera.fx, camera.fy]), np.array([camera.cx, camera.cy])
    if camera.port is None and not camera.fisheye and not any(camera.distortion):
        return LightRays((points - centre) / focal, None, np.diag(focal)[None])
    if camera.port is None:
        slopes = camera.picture_slopes(points, depth_m) * focal
        return LightRays((camera.undistort(points) - centre) / focal, None, slopes)
    rays = camera.rays(points)
    slopes = camera.picture_slopes(points, depth_m) * focal
    return LightRays(rays[:, :2] / rays[:, 2:], camera.ray_starts(points)[:, 2], slopes)


def on_planes(rays: LightRays, rotations: np.ndarray, positions_m: np.ndarray) -> np.ndarray:
    """Where the rays meet the planes of K docks: (K, N, 2) in metres, along each dock's own x and y."""
    normals = rotations[:, :, 2]
    directions = np.ones((len(rays.tangents), 3))
    directions[:, :2] = rays.tangents
    ahead = (normals * positions_m).sum(axis=1)[:, None]
    if rays.starts_m is not None:
        ahead = ahead - normals[:, 2:] * rays.starts_m
    reached = (ahead / (normals @ directions.T))[..., None] * directions
    if rays.starts_m is not None:
        reached[..., 2] += rays.starts_m
    return (reached - positions_m[:, None]) @ rotations[:, :, :2]


def refine(
    rotations: np.ndarray,
    positions_m: np.ndarray,
    angles_rad: np.ndarray | None,
    radius_m: float,
    rays: LightRays,
    offsets_m: np.ndarray | None = None,
) -> Fit:
    """Minimise the reprojection error of the lights, for K starting poses at once, by Gauss-Newton steps.

    ``angles_rad`` and ``offsets_m`` are (K, N) and (K, N, 3); without angles the lights are free to move along the
    circle.

    A point p of the dock appears at (X/Z, Y/Z) of X = R p + t. For a step dt and a rotation w about the dock's axes it
    moves by dX = dt + R (w x p), from which the derivatives follow by the quotient rule. Behind a port the measured
    point of the pinhole itself depends on Z: tangent * (1 - start / Z). Residuals are mapped to pixels of the picture,
    where the noise arises.
    """
    angles, free = angles_rad, angles_rad is None
    if angles is None:
        angles = angles_on_planes(rays, rotations, positions_m)
    offsets = np.zeros((*angles.shape, 3)) if offsets_m is None else offsets_m
    tangents, starts, slopes = _as_arrays(rays)
    fitted = _minimised(rotations, positions_m, angles, offsets, free, radius_m, tangents, starts, slopes)
    points = len(rays.tangents)
    R, t, squares, covariances = fitted
    return Fit(R, t, squares, covariances, points if free else 2 * points, points)


def squares_at(
    R: np.ndarray, t: np.ndarray, angles_rad: np.ndarray, radius_m: float, rays: LightRays, offsets_m: np.ndarray | None
) -> float:
    """Sum of the squared reprojection errors, in pixels squared, of lights at angles (N,) on one dock at R and t."""
    products = np.empty((7, 7))
    offsets = np.zeros((len(angles_rad), 3)) if offsets_m is None else offsets_m
    _sum_products(products, R, t, angles_rad, offsets, False, radius_m, *_as_arrays(rays))
    return float(products[6, 6])


def angles_on_planes(rays: LightRays, rotations: np.ndarray, positions_m: np.ndarray) -> np.ndarray:
    """Angles (K, N) in radians of the lights around each of K docks, from its x axis towards its y axis."""
    return _angles(rotations, positions_m, *_as_arrays(rays)[:2])


@compiled
def _angles(rotations: np.ndarray, positions: np.ndarray, tangents: np.ndarray, starts: np.ndarray) -> np.ndarray:
    angles = np.empty((len(rotations), len(tangents)))
    for k in range(len(rotations)):
        _move_along(angles[k], rotations[k], positions[k], tangents, starts)
    return angles


def _as_arrays(rays: LightRays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays for compiled code: tangents, starts of 0 where there are none, slopes."""
    starts = np.zeros(len(rays.tangents)) if rays.starts_m is None else rays.starts_m
    return np.ascontiguousarray(rays.tangents), starts, np.ascontiguousarray(rays.slopes_px, dtype=float)


@compiled
def _minimised(
    rotations: np.ndarray,
    positions: np.ndarray,
    angles: np.ndarray,
    offsets: np.ndarray,
    free: bool,
    radius: float,
    tangents: np.ndarray,
    starts: np.ndarray,
    slopes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rotations, positions, sums of squares and covariances of K poses, as in :func:`refine`."""
    count = len(rotations)
    R, t, angles = rotations.copy(), positions.copy(), angles.copy()
    covariances, steps = np.empty((count, 6, 6)), np.empty((count, 6))
    gains, squares = np.empty(count), np.empty(count)
    products = np.empty((7, 7))
    for round_ in range(MAX_STEPS):
        longest = 0.0
        for k in range(count):
            if free and round_ > 0:
                _move_along(angles[k], R[k], t[k], tangents, starts)
            _sum_products(products, R[k], t[k], angles[k], offsets[k], free, radius, tangents, starts, slopes)
            for number in range(6):
                products[number, number] *= 1 + _DAMPING
            if free:
                products[5, 5] = 1.0
            _invert(products, covariances[k])
            gains[k] = 0.0
            for one in range(6):
                step = 0.0
                for other in range(6):
                    step += covariances[k, one, other] * products[other, 6]
                steps[k, one] = step
                gains[k] += step * products[one, 6]
                longest = max(longest, abs(step) / t[k, 2] if one < 3 else abs(step))
            squares[k] = products[6, 6] - gains[k]
        # No step exceeds what the linearisation can be trusted for.
        share = min(1.0, _LONGEST / longest) if longest > 0 else 1.0
        for k in range(count):
            for axis in range(3):
                t[k, axis] += share * steps[k, axis]
            _turn(R[k], share * steps[k, 3], share * steps[k, 4], share * steps[k, 5])
        # A pose has converged, or is so much worse than the best one that it need not.
        hopeless = HOPELESS * squares.min() + HOPELESS_PX2
        settled = True
        for k in range(count):
            enough = _SETTLED * abs(squares[k]) + _SETTLED_PX2
            settled = settled and (gains[k] <= enough or squares[k] > hopeless)
        if settled:
            break
    return R, t, np.maximum(squares, 0.0), covariances


@compiled
def _sum_products(
    products: np.ndarray,
    R: np.ndarray,
    t: np.ndarray,
    angles: np.ndarray,
    offsets: np.ndarray,
    free: bool,
    radius: float,
    tangents: np.ndarray,
    starts: np.ndarray,
    slopes: np.ndarray,
) -> None:
    """Write J^T J (7, 7) of the derivatives J of the lights' image points, in pixels; its last column: residuals."""
    products[:] = 0.0
    J = np.zeros((2, 7))
    for light in range(len(angles)):
        x = radius * np.cos(angles[light]) + offsets[light, 0]
        y = radius * np.sin(angles[light]) + offsets[light, 1]
        z = offsets[light, 2]
        X = R[0, 0] * x + R[0, 1] * y + R[0, 2] * z + t[0]
        Y = R[1, 0] * x + R[1, 1] * y + R[1, 2] * z + t[1]
        Z = R[2, 0] * x + R[2, 1] * y + R[2, 2] * z + t[2]
        u, v = tangents[light, 0], tangents[light, 1]
        shift = starts[light] / Z
        slope = slopes[min(light, len(slopes) - 1)]
        for row in range(2):
            a, b = slope[row, 0] / Z, slope[row, 1] / Z
            c = -a * (X / Z + u * shift) - b * (Y / Z + v * shift)
            J[row, 0], J[row, 1], J[row, 2] = a, b, c
            along_x = a * R[0, 0] + b * R[1, 0] + c * R[2, 0]
            along_y = a * R[0, 1] + b * R[1, 1] + c * R[2, 1]
            along_z = a * R[0, 2] + b * R[1, 2] + c * R[2, 2]
            J[row, 3], J[row, 4] = y * along_z - z * along_y, z * along_x - x * along_z
            J[row, 5] = x * along_y - y * along_x
            J[row, 6] = slope[row, 0] * (u * (1 - shift) - X / Z) + slope[row, 1] * (v * (1 - shift) - Y / Z)
        rows = 2
        if free:
            # A rotation about the dock's own axis moves a light along the circle; only what is across it counts.
            across_u, across_v = J[1, 5], J[0, 5]
            along = np.hypot(across_u, across_v)
            for column in range(7):
                J[0, column] = (J[1, column] * across_v - J[0, column] * across_u) / along
            J[0, 5] = 0.0
            rows = 1
        for row in range(rows):
            for one in range(7):
                for other in range(one, 7):
                    products[one, other] += J[row, one] * J[row, other]
    for one in range(7):
        for other in range(one):
            products[one, other] = products[other, one]


@compiled
def _invert(matrix: np.ndarray, inverse: np.ndarray) -> None:
    """Write the inverse (6, 6) of the upper left part of a symmetric matrix, by Gauss-Jordan elimination.

    Where lights leave a parameter open, the damped pivot is as good as nothing, and the variance as good as infinite.
    """
    work = np.zeros((6, 12))
    for row in range(6):
        for column in range(6):
            work[row, column] = matrix[row, column]
        work[row, 6 + row] = 1.0
    for pivot in range(6):
        largest = pivot
        for row in range(pivot + 1, 6):
            if abs(work[row, pivot]) > abs(work[largest, pivot]):
                largest = row
        for column in range(12):
            work[pivot, column], work[largest, column] = work[largest, column], work[pivot, column]
        by = work[pivot, pivot]
        for column in range(12):
            work[pivot, column] /= by
        for row in range(6):
            if row != pivot and work[row, pivot] != 0.0:
                factor = work[row, pivot]
                for column in range(12):
                    work[row, column] -= factor * work[pivot, column]
    for row in range(6):
        for column in range(6):
            inverse[row, column] = work[row, 6 + column]


@compiled
def _move_along(angles: np.ndarray, R: np.ndarray, t: np.ndarray, tangents: np.ndarray, starts: np.ndarray) -> None:
    """Put the lights, in place, at the angles at which their rays meet the dock's plane."""
    for light in range(len(angles)):
        u, v = tangents[light, 0], tangents[light, 1]
        ahead = R[0, 2] * t[0] + R[1, 2] * t[1] + R[2, 2] * (t[2] - starts[light])
        depth = ahead / (R[0, 2] * u + R[1, 2] * v + R[2, 2])
        x, y, z = depth * u - t[0], depth * v - t[1], depth + starts[light] - t[2]
        along_x = x * R[0, 0] + y * R[1, 0] + z * R[2, 0]
        along_y = x * R[0, 1] + y * R[1, 1] + z * R[2, 1]
        angles[light] = np.arctan2(along_y, along_x)


@compiled
def _turn(R: np.ndarray, x: float, y: float, z: float) -> None:
    """Rotate in place by a small vector in radians, about the dock's axes: the Cayley transform, of third order."""
    x, y, z = x / 2, y / 2, z / 2
    by = 2 / (1 + x * x + y * y + z * z)
    for row in range(3):
        a, b, c = R[row, 0], R[row, 1], R[row, 2]
        # a row times the cross-product matrix, twice
        p, q, r = b * z - c * y, c * x - a * z, a * y - b * x
        R[row, 0] = a + by * (p + q * z - r * y)
        R[row, 1] = b + by * (q + r * x - p * z)
        R[row, 2] = c + by * (r + p * y - q * x)
