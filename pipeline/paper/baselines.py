"""Simpler methods that the paper compares with, to measure what the exact ones gain."""

from __future__ import annotations

import math

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import check_number
from dockpose.estimate import Estimate
from dockpose.lights.ellipse import Ellipse
from dockpose.pose.circle import CirclePose


def centres(points_px: np.ndarray, ellipse: Ellipse, pose: CirclePose) -> np.ndarray:
    """The dock's centre (3, 2) by mass moment, ellipse and pose, from lights (N, 2) in the undistorted picture."""
    return np.array([points_px.mean(axis=0), ellipse.centre_px, pose.centre_px])


def centre_errors_px(found: Estimate, centre_px: np.ndarray) -> np.ndarray:
    """Distance (3,) in pixels of each of :func:`centres` from the dock's centre (2,) (Fig. 14 of the paper)."""
    if found.selected is None or found.ellipse is None or found.markers is None or found.ring is None:
        return np.full(3, np.nan)
    points = found.markers.points_px[found.ring.on_ring]
    undistorted = found.camera.virtual_pixels(points, float(found.selected.position_m[2]))
    return np.linalg.norm(centres(undistorted, found.ellipse, found.selected) - centre_px, axis=1)


def hong_poses(ellipse: Ellipse, camera: Camera, diameter: float) -> tuple[CirclePose, CirclePose]:
    """Both poses of a circle of ``diameter`` metres by the assumption of Hong et al., which is weak perspective.

    The ellipse's major axis is the diameter, its centre the dock's, tilted about that axis by acos(minor / major).
    """
    check_number("diameter", diameter, above=0)
    focal = math.sqrt(camera.fx * camera.fy)
    major, minor = ellipse.semi_axes_px
    z = focal * diameter / (2 * major)
    x, y = ellipse.centre_px
    position = np.array([(x - camera.cx) / camera.fx * z, (y - camera.cy) / camera.fy * z, z])
    tilt = math.acos(min(1.0, minor / major))
    across = np.array([-math.sin(ellipse.angle_rad), math.cos(ellipse.angle_rad), 0.0])
    first, second = (
        CirclePose(position, np.array([0, 0, -math.cos(tilt)]) + side * math.sin(tilt) * across, np.array([x, y]))
        for side in (-1.0, 1.0)
    )
    return first, second
