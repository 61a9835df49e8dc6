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
    """The rays of N lights, in terms of a pinhole at the camera's centre.

    Attributes
    ----------
    tangents : (N, 2) float array
        x / z and y / z of the rays in the water.
    starts_m : (N,) float array or None, metres
        z where each ray, followed backwards, meets the camera's axis; None where that is 0 for all.
    slopes_px : (N, 2, 2) or (1, 2, 2) float array, pixels
        How far the picture point moves per step of the tangents.
    """

    tangents: np.ndarray
    starts_m: np.ndarray | None
    slopes_px: np.ndarray


@dataclass(frozen=True)
class Fit:
    """K refined poses.

    Attributes
    ----------
    rotations : (K, 3, 3) float array
        From the dock's frame to the camera's, roll included.
    positions_m : (K, 3) float array, metres
        The dock's centres.
    squares_px2 : (K,) float array, pixels squared
        Sums of the squared reprojection errors.
    covariances : (K, 6, 6) float array
        (J^T J)^-1 for a step of the position (metres) and a rotation about the dock's axes (radians), for lights known
        to one pixel.
    numbers : int
        Number of residuals.
    points : int
        Number of lights.
    """

    rotations: np.ndarray
    positions_m: np.ndarray
    squares_px2: np.ndarray
    covariances: np.ndarray
    numbers: int
    points: int


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
    rotations: np.ndarray, positions_m: np.ndarray, angles_rad: np.ndarray | None, radius_m: float, rays: LightRays
) -> Fit:
    """Minimise the reprojection error of the lights, for K starting poses at once, by Gauss-Newton steps.

    Parameters
    ----------
    rotations : (K, 3, 3) float array
        Where to start: from each dock's frame to the camera's.
    positions_m : (K, 3) float array, metres
        Where to start: the docks' centres.
    angles_rad : (K, N) float array or None, radians
        Angle of each light in its dock's own frame. None where the spacing is not known: then each light is free to
        move along its circle, and only its distance from the circle's image counts.
    radius_m : float, metres
        Radius of the circle.
    rays : LightRays
        Rays of the N lights.

    Returns
    -------
    Fit
        The refined poses.

    Notes
    -----
    A point p of the dock appears at (X/Z, Y/Z) of X = R p + t. For a step dt and a rotation w about the dock's axes it
    moves by dX = dt + R (w x p), from which the derivatives follow by the quotient rule. Behind a port the measured
    point of the pinhole itself depends on Z: tangent * (1 - start / Z). Residuals are mapped to pixels of the picture,
    where the noise arises.
    """
    angles, free = angles_rad, angles_rad is None
    if angles is None:
        angles = angles_on_planes(rays, rotations, positions_m)
    tangents, starts, slopes = _as_arrays(rays)
    fitted = _minimised(rotations, positions_m, angles, free, radius_m, tangents, starts, slopes)
    points = len(rays.tangents)
    R, t, squares, covariances = fitted
    return Fit(R, t, squares, covariances, points if free else 2 * points, points)


def squares_at(
    rotation: np.ndarray, position_m: np.ndarray, angles_rad: np.ndarray, radius_m: float, rays: LightRays
) -> float:
    """Sum of the squared reprojection errors, in pixels squared, of lights at angles (N,) on one dock."""
    products = _products(rotation, position_m, angles_rad, False, radius_m, *_as_arrays(rays))
    return float(products[6, 6])


def angles_on_planes(rays: LightRays, rotations: np.ndarray, positions_m: np.ndarray) -> np.ndarray:
    """Angles (K, N) in radians of the lights around each of K docks, from its x axis towards its y axis."""
    flat = on_planes(rays, rotations, positions_m)
    return np.arctan2(flat[..., 1], flat[..., 0])


def _as_arrays(rays: LightRays) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rays for compiled code: tangents, starts of 0 where there are none, slopes."""
    starts = np.zeros(len(rays.tangents)) if rays.starts_m is None else rays.starts_m
    return np.ascontiguousarray(rays.tangents), starts, np.ascontiguousarray(rays.slopes_px, dtype=float)


@compiled
def _minimised(
    rotations: np.ndarray,
    positions: np.ndarray,
    angles: np.ndarray,
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
    for round_ in range(MAX_STEPS):
        longest = 0.0
        for k in range(count):
            if free and round_ > 0:
                _move_along(angles[k], R[k], t[k], tangents, starts)
            products = _products(R[k], t[k], angles[k], free, radius, tangents, starts, slopes)
            information, gradient = products[:6, :6].copy(), products[:6, 6].copy()
            for number in range(6):
                information[number, number] *= 1 + _DAMPING
            if free:
                information[5, 5] = 1.0
            covariances[k] = np.linalg.inv(information)
            steps[k] = covariances[k] @ gradient
            gains[k] = (gradient * steps[k]).sum()
            squares[k] = products[6, 6] - gains[k]
            longest = max(longest, np.abs(steps[k, :3]).max() / t[k, 2], np.abs(steps[k, 3:]).max())
        # No step exceeds what the linearisation can be trusted for.
        share = min(1.0, _LONGEST / longest) if longest > 0 else 1.0
        for k in range(count):
            t[k] += share * steps[k, :3]
            R[k] = R[k] @ _turn(share * steps[k, 3:])
        # A pose has converged, or is so much worse than the best one that it need not.
        hopeless = HOPELESS * squares.min() + HOPELESS_PX2
        if np.all((gains <= _SETTLED * np.abs(squares) + _SETTLED_PX2) | (squares > hopeless)):
            break
    return R, t, np.maximum(squares, 0.0), covariances


@compiled
def _products(
    R: np.ndarray,
    t: np.ndarray,
    angles: np.ndarray,
    free: bool,
    radius: float,
    tangents: np.ndarray,
    starts: np.ndarray,
    slopes: np.ndarray,
) -> np.ndarray:
    """J^T J (7, 7) of the derivatives J of the lights' image points, in pixels, with the residuals as a last column."""
    products, J = np.zeros((7, 7)), np.zeros((2, 7))
    for light in range(len(angles)):
        x, y = radius * np.cos(angles[light]), radius * np.sin(angles[light])
        X, Y, Z = R[:, 0] * x + R[:, 1] * y + t
        u, v = tangents[light]
        shift = starts[light] / Z
        slope = slopes[min(light, len(slopes) - 1)]
        for row in range(2):
            J[row, 0], J[row, 1] = slope[row, 0] / Z, slope[row, 1] / Z
            J[row, 2] = -J[row, 0] * (X / Z + u * shift) - J[row, 1] * (Y / Z + v * shift)
            along_x, along_y, along_z = J[row, :3] @ R
            J[row, 3], J[row, 4], J[row, 5] = y * along_z, -x * along_z, x * along_y - y * along_x
            J[row, 6] = slope[row, 0] * (u * (1 - shift) - X / Z) + slope[row, 1] * (v * (1 - shift) - Y / Z)
        rows = 2
        if free:
            # A rotation about the dock's own axis moves a light along the circle; only what is across it counts.
            along = np.hypot(J[0, 5], J[1, 5])
            J[0] = (J[1] * J[0, 5] - J[0] * J[1, 5]) / along
            J[0, 5] = 0.0
            rows = 1
        for row in range(rows):
            for one in range(7):
                for other in range(one, 7):
                    products[one, other] += J[row, one] * J[row, other]
    for one in range(7):
        for other in range(one):
            products[one, other] = products[other, one]
    return products


@compiled
def _move_along(angles: np.ndarray, R: np.ndarray, t: np.ndarray, tangents: np.ndarray, starts: np.ndarray) -> None:
    """Put the lights, in place, at the angles at which their rays meet the dock's plane."""
    normal = R[:, 2].copy()
    for light in range(len(angles)):
        u, v = tangents[light]
        ahead = (normal * t).sum() - normal[2] * starts[light]
        depth = ahead / (normal[0] * u + normal[1] * v + normal[2])
        x, y, z = depth * u - t[0], depth * v - t[1], depth + starts[light] - t[2]
        along_x = x * R[0, 0] + y * R[1, 0] + z * R[2, 0]
        along_y = x * R[0, 1] + y * R[1, 1] + z * R[2, 1]
        angles[light] = np.arctan2(along_y, along_x)


@compiled
def _turn(vector: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) by a small vector (3,) in radians: the Cayley transform, exact to the third order."""
    x, y, z = vector / 2
    half = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + 2 / (1 + x * x + y * y + z * z) * (half + half @ half)
