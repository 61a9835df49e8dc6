"""What came of one picture whose truth is known, also by the plain chain, which judges the threshold alone."""

from __future__ import annotations

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate
from dockpose.lights.ellipse import MIN_POINTS, NoEllipseError, fit_ellipse
from dockpose.pose.circle import CirclePose, circle_poses
from dockpose.simulate.truth import Truth
from dockpose.study.judge import pose_errors
from dockpose.thresholds import LEVELS, Histogram

SAME_LIGHT_PX = 4.0  # a group so near to a light is that light
RIGHT_DEG, RIGHT_SHARE = 5.0, 0.03  # of the angle, and of the range


def are_the_lights(points_px: np.ndarray, lights_px: np.ndarray) -> bool:
    """Whether points (N, 2) are the lights (M, 2), each once, and nothing else."""
    if len(points_px) != len(lights_px):
        return False
    near = np.linalg.norm(points_px[:, None] - lights_px[None], axis=2) < SAME_LIGHT_PX
    return bool((near.sum(axis=0) == 1).all() and (near.sum(axis=1) == 1).all())


def group_centres(histogram: Histogram, level: int, min_area_px: int) -> np.ndarray:
    """Mass moments (N, 2) in pixels of the groups that a level leaves; none is split, merged or left out."""
    if level >= LEVELS or (pixels := histogram.bright(level)).is_empty:
        return np.empty((0, 2))
    count, labels = pixels.groups()
    area = np.bincount(labels, minlength=count)
    y, x = np.divmod(pixels.index, pixels.width)
    centres = np.column_stack([np.bincount(labels, x, count), np.bincount(labels, y, count)]) / area[:, None]
    return centres[area >= min_area_px]


def poses_of_all(points_px: np.ndarray, camera: Camera, dock: Dock) -> tuple[CirclePose, ...]:
    """Both poses of the ellipse through all points (N, 2), as the paper reads; none where there is no ellipse."""
    if len(points_px) < MIN_POINTS:
        return ()
    try:
        return circle_poses(fit_ellipse(camera.undistort(points_px)), camera, dock.diameter)
    except NoEllipseError:
        return ()


def is_right(pose: CirclePose, truth: Truth) -> bool:
    """Whether a pose is the true one, within ``RIGHT_DEG`` and ``RIGHT_SHARE`` of the range."""
    distance_m, angle_deg = pose_errors(pose, truth)
    return distance_m < RIGHT_SHARE * float(truth.position_m[2]) and angle_deg < RIGHT_DEG


def pose_is_right(found: Estimate, truth: Truth) -> bool:
    """Whether the chosen pose is right; not where there is none."""
    return found.selected is not None and is_right(found.selected, truth)


def any_level_shows_the_lights(histogram: Histogram, lights_px: np.ndarray, min_area_px: int) -> bool:
    """Whether at any level that keeps at most a fifth of the picture the groups are exactly the lights."""
    shares = histogram.counts.cumsum() / histogram.counts.sum()
    floor = int(np.searchsorted(shares, 0.8)) + 1
    counts = histogram.bright(floor).groups_at_every_level(min_area_px)
    levels = np.flatnonzero(counts == len(lights_px)).tolist()
    return any(are_the_lights(group_centres(histogram, level, min_area_px), lights_px) for level in levels)
