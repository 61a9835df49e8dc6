"""Refinement: the pose with the least reprojection error, and its covariance."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points

MAX_STEPS = 15
# Stop after a step that lowers the sum of squares by less than this share or this much; what remains is far less.
_SETTLED, _SETTLED_PX2 = 1e-3, 1e-6
# A pose whose sum of squares exceeds this multiple of the best one's plus this much is certainly wrong.
_HOPELESS, _HOPELESS_PX2 = 30.0, 2.0
_LONGEST = 0.3  # radians, or a share of the range, in one step
_DAMPING = 1e-9
# The cross-product matrix of half a vector w is w @ _HALF_CROSS, read as 3 x 3.
_HALF_CROSS = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]]) / 2
_IDENTITY = np.eye(3)
_DIAGONAL = np.arange(6)


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
    R, t, free = rotations, positions_m, angles_rad is None
    model, turning = _model(angles_on_planes(rays, R, t) if angles_rad is None else angles_rad, radius_m)
    for last in range(1 - MAX_STEPS, 1):
        J = _linearised(R, t, model, turning, rays)
        if free:
            J = _across(J)
        # With the residuals as a seventh column, one product gives everything that a step needs.
        A = J.reshape(len(R), -1, 7)
        products = A.transpose(0, 2, 1) @ A
        covariance = np.linalg.inv(_damped(products[:, :6, :6].copy(), free))
        gradient = products[:, :6, 6:]
        step = covariance @ gradient
        gain = (gradient.transpose(0, 2, 1) @ step)[:, 0, 0]
        squares = products[:, 6, 6] - gain
        step = _shortened(step[..., 0], t)
        t = t + step[:, :3]
        R = R @ _turn(step[:, 3:])
        if last == 0 or _is_done(gain.tolist(), squares.tolist()):
            return Fit(R, t, np.maximum(squares, 0.0), covariance, A.shape[1], len(rays.tangents))
        if free:
            model, turning = _model(angles_on_planes(rays, R, t), radius_m)
    raise AssertionError("the last step returns")


def squares_at(
    rotation: np.ndarray, position_m: np.ndarray, angles_rad: np.ndarray, radius_m: float, rays: LightRays
) -> float:
    """Sum of the squared reprojection errors, in pixels squared, of lights at angles (N,) on one dock."""
    model, turning = _model(angles_rad[None], radius_m)
    residuals = _linearised(rotation[None], position_m[None], model, turning, rays)[..., 6]
    return float((residuals * residuals).sum())


def angles_on_planes(rays: LightRays, rotations: np.ndarray, positions_m: np.ndarray) -> np.ndarray:
    """Angles (K, N) in radians of the lights around each of K docks, from its x axis towards its y axis."""
    flat = on_planes(rays, rotations, positions_m)
    return np.arctan2(flat[..., 1], flat[..., 0])


def _model(angles_rad: np.ndarray, radius_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Lights (K, N, 3) in the dock's frame, and their derivatives by a rotation of the dock (K, N, 3, 3)."""
    model = np.zeros((*angles_rad.shape, 3))
    x, y = radius_m * np.cos(angles_rad), radius_m * np.sin(angles_rad)
    model[..., 0], model[..., 1] = x, y
    turning = np.zeros((*angles_rad.shape, 3, 3))
    turning[..., 0, 2], turning[..., 1, 2] = -y, x
    turning[..., 2, 0], turning[..., 2, 1] = y, -x
    return model, turning


def _linearised(R: np.ndarray, t: np.ndarray, model: np.ndarray, turning: np.ndarray, rays: LightRays) -> np.ndarray:
    """Derivatives (K, N, 2, 6) of the lights' image points, in pixels, and the residuals as a seventh column."""
    points = model @ R.transpose(0, 2, 1)
    points += t[:, None]
    nearness = 1 / points[..., 2:]
    tangents = points[..., :2] * nearness
    seen, turned = rays.tangents, tangents
    if rays.starts_m is not None:
        shift = rays.starts_m[:, None] * nearness
        seen, turned = rays.tangents * (1 - shift), tangents + rays.tangents * shift
    J = np.empty((*model.shape[:2], 2, 7))
    np.multiply(rays.slopes_px, nearness[..., None], out=J[..., :2])
    np.matmul(J[..., :2], -turned[..., None], out=J[..., 2:3])
    np.matmul(J[..., :3], R[:, None] @ turning, out=J[..., 3:6])
    np.matmul(rays.slopes_px, (seen - tangents)[..., None], out=J[..., 6:])
    return J


def _across(J: np.ndarray) -> np.ndarray:
    """Derivatives and residuals normal to the circle's image, along which the lights are free to move.

    A rotation about the dock's own axis moves every light along the circle, so that column gives the direction.
    """
    along = J[..., 5]
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1) / np.linalg.norm(along, axis=-1, keepdims=True)
    J = (across[..., None, :] @ J)[..., 0, :]
    J[..., 5] = 0.0
    return J


def _shortened(step: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Steps (K, 6), scaled by a common factor such that none exceeds what the linearisation can be trusted for."""
    share = np.abs(step)
    share[:, :3] /= t[:, 2:]
    longest = float(share.max())
    return step if longest <= _LONGEST else step * (_LONGEST / longest)


def _is_done(gains_px2: list[float], squares_px2: list[float]) -> bool:
    """Whether every pose has converged, or is so much worse than the best one that it need not."""
    hopeless = _HOPELESS * min(squares_px2) + _HOPELESS_PX2
    return all(
        gain <= _SETTLED * abs(squares) + _SETTLED_PX2 or squares > hopeless
        for gain, squares in zip(gains_px2, squares_px2, strict=True)
    )


def _damped(information: np.ndarray, free: bool) -> np.ndarray:
    """The information matrix with a slightly larger diagonal, so that it can be inverted; changed in place."""
    information[:, _DIAGONAL, _DIAGONAL] *= 1 + _DAMPING
    if free:
        information[:, 5, 5] = 1.0
    return information


def _turn(vectors: np.ndarray) -> np.ndarray:
    """Rotations (K, 3, 3) by small vectors (K, 3) in radians: the Cayley transform, exact to the third order."""
    half = (vectors @ _HALF_CROSS).reshape(-1, 3, 3)
    squared = half @ half
    scale = 2 / (1 + 0.25 * (vectors * vectors).sum(axis=1))
    return _IDENTITY + scale[:, None, None] * (half + squared)
