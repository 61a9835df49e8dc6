"""Where parts of an estimate lie in the picture, in pixels: the ellipse, the dock's circle and axes by each pose."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from dockpose.pose.circle import CirclePose, rotation_from_angles

if TYPE_CHECKING:
    from dockpose.estimate.result import Estimate

_NORMAL_RADII = 1.3  # long enough to end outside the ring


def in_picture(estimate: Estimate, points_px: np.ndarray) -> np.ndarray:
    """Where points (N, 2) of the undistorted picture appear in the picture; behind a port, in the chosen plane."""
    camera, pose = estimate.camera, estimate.selected
    if camera.port is None or pose is None:
        return camera.distort(points_px)
    rays = camera.pinhole_rays(points_px)
    return camera.project(rays * ((pose.position_m @ pose.normal) / (rays @ pose.normal))[:, None])


def outline(estimate: Estimate) -> np.ndarray | None:
    """Return points (240, 2) on the ellipse; None where there is none."""
    return None if estimate.ellipse is None else in_picture(estimate, estimate.ellipse.points(240))


def centres(estimate: Estimate) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the ellipse's centre and the dock's centre by the chosen pose, each (2,) or None."""
    ellipse, pose = estimate.ellipse, estimate.selected
    return (
        None if ellipse is None else in_picture(estimate, np.array([ellipse.centre_px]))[0],
        None if pose is None else estimate.camera.project([pose.position_m])[0],
    )


def axes(pose: CirclePose, estimate: Estimate) -> np.ndarray:
    """Return the ends (2, 2, 2) of two diameters of the dock; NaN for what is behind the camera."""
    rotation = rotation_from_angles(pose.theta_x_rad, pose.theta_y_rad)
    ends = [pose.position_m + estimate.dock.radius * np.outer([-1, 1], axis) for axis in rotation.T[:2]]
    return np.array([estimate.camera.project(pair) for pair in ends])


def dock_outline(pose: CirclePose, estimate: Estimate, points: int = 120) -> np.ndarray:
    """Return so many points (N, 2) on the dock's circle by a pose; NaN for what is behind the camera."""
    right, down = rotation_from_angles(pose.theta_x_rad, pose.theta_y_rad).T[:2]
    angles = np.linspace(0, 2 * np.pi, points, endpoint=False)[:, None]
    circle = pose.position_m + estimate.dock.radius * (np.cos(angles) * right + np.sin(angles) * down)
    return estimate.camera.project(circle)


def normal(pose: CirclePose, estimate: Estimate) -> np.ndarray:
    """Return the ends (2, 2) of the dock's normal, 1.3 radii long; NaN for what is behind the camera."""
    tip = pose.position_m + _NORMAL_RADII * estimate.dock.radius * pose.normal
    return estimate.camera.project(np.array([pose.position_m, tip]))


def on_ring(estimate: Estimate) -> np.ndarray:
    """Return for each group (N,) bool whether it is a light on the ring."""
    if estimate.markers is None:
        return np.zeros(0, dtype=bool)
    return np.zeros(len(estimate.markers), dtype=bool) if estimate.ring is None else estimate.ring.on_ring
