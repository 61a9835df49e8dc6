"""Which of the two poses is the right one."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from pipeline.camera import Camera
from pipeline.circle_pose import CirclePose, rotation_from_angles
from pipeline.dock import Dock

# Until the lights' own scatter says otherwise, their centres are taken to be this precise. It counts as much as
# this many lights.
PRIOR_NOISE_PX = 0.2
PRIOR_LIGHTS = 2
EVEN_WITHIN = 0.25  # of the spacing: lights further than this from every place are not evenly spaced


@dataclass(frozen=True)
class Choice:
    """The two candidates, the likelier first, and why.

    Attributes
    ----------
    candidates : the two poses with their probabilities and reprojection errors.
    selected : index of the chosen one.
    selected_by : "spacing", or "none" where nothing tells them apart.
    lights : (N,) number of the light that each point is, counted around the ring; None without even spacing.
    """

    candidates: tuple[CirclePose, CirclePose]
    selected: int
    selected_by: str
    lights: np.ndarray | None


@dataclass(frozen=True)
class _Spacing:
    """How well evenly spaced lights on one candidate explain the picture."""

    squares_px2: float
    roll_rad: float
    lights: np.ndarray
    is_even: bool


def choose_by_spacing(
    poses: tuple[CirclePose, CirclePose], points_px: np.ndarray, camera: Camera, dock: Dock
) -> Choice:
    """Choose the candidate on which the lights are evenly spaced.

    Parameters
    ----------
    poses : the two candidates.
    points_px : (N, 2) centres of the lights, undistorted.
    dock : where its number of lights is None, the points are taken to be all of them.

    Notes
    -----
    The lights are back-projected onto each candidate's plane; their angles' common phase places the evenly spaced
    model, and the model's reprojection error tells how well it fits. With the noise s of a light's centre, the
    log-odds are half the difference of the two sums of squares over s^2. s is estimated from the better candidate,
    together with a weak prior, because ten lights alone do not fix it.
    """
    spacing = dock.lights if dock.lights is not None else len(points_px)
    fits = [_fit_spacing(pose, points_px, camera, dock.radius, spacing) for pose in poses]
    if not any(fit.is_even for fit in fits):
        undecided = replace(poses[0], probability=0.5), replace(poses[1], probability=0.5)
        return Choice(undecided, 0, "none", None)
    squares = [fit.squares_px2 for fit in fits]
    freedom = max(1, len(points_px) - 3)
    variance = (min(squares) + PRIOR_LIGHTS * PRIOR_NOISE_PX**2) / (freedom + PRIOR_LIGHTS)
    first = float(expit((squares[1] - squares[0]) / (2 * variance)))
    judged = [
        replace(
            pose,
            probability=probability,
            rms_px=math.sqrt(fit.squares_px2 / len(points_px)),
            roll_rad=fit.roll_rad,
        )
        for pose, fit, probability in zip(poses, fits, (first, 1 - first), strict=True)
    ]
    likelier = 0 if first >= 0.5 else 1
    return Choice((judged[likelier], judged[1 - likelier]), 0, "spacing", fits[likelier].lights)


def _fit_spacing(pose: CirclePose, points_px: np.ndarray, camera: Camera, radius: float, spacing: int) -> _Spacing:
    """Place evenly spaced lights on a candidate's ring, as close to the points as they come."""
    rotation = rotation_from_angles(pose.theta_x_rad, pose.theta_y_rad)
    rays = camera.pinhole_rays(points_px)
    on_plane = rays * ((pose.position_m @ pose.normal) / (rays @ pose.normal))[:, None]
    in_dock = (on_plane - pose.position_m) @ rotation
    angles = np.arctan2(in_dock[:, 1], in_dock[:, 0])
    step = 2 * math.pi / spacing
    roll = float(np.angle(np.exp(1j * spacing * angles).sum())) / spacing % step
    slots = (angles - roll) / step
    lights = np.rint(slots).astype(int)
    ring = roll + step * lights
    model = pose.position_m + radius * np.column_stack([np.cos(ring), np.sin(ring), 0 * ring]) @ rotation.T
    seen = model @ camera.matrix.T
    squares = float(((seen[:, :2] / seen[:, 2:] - points_px) ** 2).sum())
    numbered = lights % spacing
    is_even = len(np.unique(numbered)) == len(numbered) and np.abs(slots - lights).max() < EVEN_WITHIN
    return _Spacing(squares, roll, numbered, bool(is_even))
