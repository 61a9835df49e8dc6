"""Simpler methods that the paper compares with, to measure what the exact ones gain."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points, check_number
from dockpose.estimate import Estimate
from dockpose.lights.ellipse import Ellipse
from dockpose.pose.circle import CirclePose


@dataclass(frozen=True)
class Centres:
    """Three estimates of the dock's centre in the undistorted picture."""

    mass_moment_px: np.ndarray  # (2,): mean of the lights' centroids
    ellipse_px: np.ndarray  # (2,): centre of the ellipse
    true_px: np.ndarray  # (2,): image of the circle's centre, which requires the pose


def centres(points_px: np.ndarray, ellipse: Ellipse, pose: CirclePose) -> Centres:
    """Compare the dock's centre by mass moment, ellipse and pose, from lights (N, 2) in the undistorted picture."""
    points = as_points("points_px", points_px, 2)
    return Centres(points.mean(axis=0), np.array(ellipse.centre_px), pose.centre_px)


def centre_errors_px(found: Estimate, centre_px: np.ndarray) -> np.ndarray:
    """Distance (3,) in pixels of each of :class:`Centres` from the dock's centre (2,) (Fig. 14 of the paper)."""
    if found.selected is None or found.ellipse is None or found.markers is None or found.ring is None:
        return np.full(3, np.nan)
    points = found.markers.points_px[found.ring.on_ring]
    undistorted = found.camera.virtual_pixels(points, float(found.selected.position_m[2]))
    three = centres(undistorted, found.ellipse, found.selected)
    return np.linalg.norm(np.array([three.mass_moment_px, three.ellipse_px, three.true_px]) - centre_px, axis=1)


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
