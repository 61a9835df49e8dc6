"""Refinement: the pose whose lights fall closest to where the picture shows them, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points

MAX_STEPS = 15
# A step that lowers the sum of squares by less than this share, or this much, is the last; what it leaves is far less.
_SETTLED, _SETTLED_PX2 = 1e-3, 1e-6
# A pose whose sum of squares is this many times the best one's, and this much more, is wrong beyond any doubt.
_HOPELESS, _HOPELESS_PX2 = 30.0, 2.0
_LONGEST = 0.3  # radians, or a share of the range, in one step
_DAMPING = 1e-9
# The cross-product matrix of half a vector w is w @ _HALF_CROSS, read as 3 x 3.
_HALF_CROSS = np.array([[0, 0, 0, 0, 0, -1, 0, 1, 0], [0, 0, 1, 0, 0, 0, -1, 0, 0], [0, -1, 0, 1, 0, 0, 0, 0, 0]]) / 2
_IDENTITY = np.eye(3)
_DIAGONAL = np.arange(6)


@dataclass(frozen=True)
class LightRays:
    """What the camera says about N lights, in the terms of a pinhole at its centre.

    Attributes
    ----------
    tangents : (N, 2) x / z and y / z of the rays in the water.
    starts_m : (N,) z where each ray, followed backwards, meets the camera's axis; None where that is 0 for all.
    slopes_px : (N, 2, 2) or (1, 2, 2) how far the picture point moves for a step of the tangents.
    """

    tangents: np.ndarray
    starts_m: np.ndarray | None
    slopes_px: np.ndarray


@dataclass(frozen=True)
class Fit:
    """K refined poses.

    Attributes
    ----------
    rotations : (K, 3, 3) from the dock's frame to the camera's, roll included.
    positions_m : (K, 3).
    squares_px2 : (K,) sums of the squared reprojection errors.
    covariances : (K, 6, 6) (J^T J)^-1 for a step of the position (metres) and a turn about the dock's axes (radians),
        for lights known to a pixel.
    numbers, points : how many residuals went in, and of how many lights.
    """

    rotations: np.ndarray
    positions_m: np.ndarray
    squares_px2: np.ndarray
    covariances: np.ndarray
    numbers: int
    points: int


def light_rays(points_px: Any, camera: Camera, depth_m: float = 1.0) -> LightRays:
    """Trace picture points (N, 2) into the water; ``depth_m`` is roughly where their lights are."""
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
    """Minimise the reprojection error of the lights for K starting poses at once, by Gauss-Newton steps.

    Parameters
    ----------
    rotations, positions_m : (K, 3, 3) and (K, 3), where to start.
    angles_rad : (K, N) of each light in its dock's own frame; None where the spacing is not known: then each light may
        lie anywhere on its circle, and only its distance from the circle's image counts.
    radius_m : of the circle.
    rays : of the N lights.

    Notes
    -----
    A point p of the dock appears at (X/Z, Y/Z) of X = R p + t; for a step dt and a turn w about the dock's axes it
    moves by dX = dt + R (w x p), from which the derivatives follow by the quotient rule. Behind a port the pinhole's
    measured point itself depends on Z: tangent * (1 - start / Z). Residuals are carried to pixels of the picture, where
    the noise arises.
    """
    R, t, free = rotations, positions_m, angles_rad is None
    model, turning = _model(angles_on_planes(rays, R, t) if angles_rad is None else angles_rad, radius_m)
    for last in range(1 - MAX_STEPS, 1):
        J = _linearised(R, t, model, turning, rays)
        if free:
            J = _across(J)
        # The residuals ride along as a seventh column, so that one product gives all that a step needs.
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
    """Sum of the squared reprojection errors, in pixels, of lights at angles (N,) on one dock."""
    model, turning = _model(angles_rad[None], radius_m)
    residuals = _linearised(rotation[None], position_m[None], model, turning, rays)[..., 6]
    return float((residuals * residuals).sum())


def angles_on_planes(rays: LightRays, rotations: np.ndarray, positions_m: np.ndarray) -> np.ndarray:
    """Angles (K, N) in radians of the lights around each of K docks, from its x towards its y axis."""
    flat = on_planes(rays, rotations, positions_m)
    return np.arctan2(flat[..., 1], flat[..., 0])


def _model(angles_rad: np.ndarray, radius_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Lights (K, N, 3) in the dock's frame, and how they move when the dock turns: (K, N, 3, 3)."""
    model = np.zeros((*angles_rad.shape, 3))
    x, y = radius_m * np.cos(angles_rad), radius_m * np.sin(angles_rad)
    model[..., 0], model[..., 1] = x, y
    turning = np.zeros((*angles_rad.shape, 3, 3))
    turning[..., 0, 2], turning[..., 1, 2] = -y, x
    turning[..., 2, 0], turning[..., 2, 1] = y, -x
    return model, turning


def _linearised(R: np.ndarray, t: np.ndarray, model: np.ndarray, turning: np.ndarray, rays: LightRays) -> np.ndarray:
    """Derivatives (K, N, 2, 6) of where lights are seen, in pixels, and as a seventh column how far off they are."""
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
    """What derivatives and residuals amount to at right angles to the circle's image, along which lights move freely.

    A turn about the dock's own axis moves every light along it: that column of the derivatives tells where to.
    """
    along = J[..., 5]
    across = np.stack([-along[..., 1], along[..., 0]], axis=-1) / np.linalg.norm(along, axis=-1, keepdims=True)
    J = (across[..., None, :] @ J)[..., 0, :]
    J[..., 5] = 0.0
    return J


def _shortened(step: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Steps (K, 6), all by the same factor, so that none is longer than the linear terms can be trusted."""
    share = np.abs(step)
    share[:, :3] /= t[:, 2:]
    longest = float(share.max())
    return step if longest <= _LONGEST else step * (_LONGEST / longest)


def _is_done(gains_px2: list[float], squares_px2: list[float]) -> bool:
    """Whether every pose has settled, or is so much worse than the best one that it need not."""
    hopeless = _HOPELESS * min(squares_px2) + _HOPELESS_PX2
    return all(
        gain <= _SETTLED * abs(squares) + _SETTLED_PX2 or squares > hopeless
        for gain, squares in zip(gains_px2, squares_px2, strict=True)
    )


def _damped(information: np.ndarray, free: bool) -> np.ndarray:
    """The information with its diagonal a trace larger, so that it can be inverted; changed in place."""
    information[:, _DIAGONAL, _DIAGONAL] *= 1 + _DAMPING
    if free:
        information[:, 5, 5] = 1.0
    return information


def _turn(vectors: np.ndarray) -> np.ndarray:
    """Rotations (K, 3, 3) by small vectors (K, 3) in radians: Cayley's, exact to the third order."""
    half = (vectors @ _HALF_CROSS).reshape(-1, 3, 3)
    squared = half @ half
    scale = 2 / (1 + 0.25 * (vectors * vectors).sum(axis=1))
    return _IDENTITY + scale[:, None, None] * (half + squared)
