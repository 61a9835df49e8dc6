"""A pose as ROS 2's ``geometry_msgs/PoseWithCovarianceStamped``, in YAML that ``ros2 topic pub`` takes."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import yaml
from dockpose import Estimate
from dockpose.pose.circle import CirclePose, rotation_from_angles
from scipy.spatial.transform import Rotation

FRAME_ID = "camera_optical_frame"
# An unknown angle is uniform over a full turn, with the variance (2 pi)^2 / 12.
UNKNOWN_ANGLE_RAD2 = math.pi**2 / 3
UNKNOWN_LENGTH_M2 = 1e6  # a kilometre, squared: farther than any camera sees under water


def pose_message(found: Estimate, time_s: float = 0.0, frame_id: str = FRAME_ID) -> dict[str, Any] | None:
    """Return the chosen pose as the message's fields; None without a pose.

    Parameters
    ----------
    found : Estimate
        Only the chosen pose is kept; the message has no place for the other candidate.
    time_s : float
        Time of the stamp, in seconds since 1970.
    frame_id : str
        Name of the camera's optical frame: x right, y down, z ahead (REP 103).

    Returns
    -------
    dict or None
        ``pose.pose`` is the dock's frame in the camera's: z into the dock, away from the camera, x level.
        ``pose.covariance`` is 6 x 6, row by row: x, y, z, then rotations about the camera's fixed axes x, y and z.

    Notes
    -----
    The rotation is Ry(theta_y) Rx(theta_x): theta_y turns about the camera's y axis, theta_x about the x axis as
    rotated by theta_y. Roll, about the dock's own axis, is unobservable since all lights look alike; it gets the
    variance of a uniform distribution over a full turn, pi^2 / 3. Correlations of position and angles are left out.
    """
    pose = found.selected
    if pose is None:
        return None
    second = math.floor(time_s)
    x, y, z, w = Rotation.from_matrix(_rotation(pose)).as_quat().tolist()
    return {
        "header": {
            "stamp": {"sec": second, "nanosec": min(999_999_999, round(1e9 * (time_s - second)))},
            "frame_id": frame_id,
        },
        "pose": {
            "pose": {
                "position": dict(zip("xyz", pose.position_m.tolist(), strict=True)),
                "orientation": {"x": x, "y": y, "z": z, "w": w},
            },
            "covariance": covariance(pose).ravel().tolist(),
        },
    }


def pose_yaml(found: Estimate, time_s: float = 0.0, frame_id: str = FRAME_ID) -> str | None:
    """Return the message as YAML; None without a pose."""
    message = pose_message(found, time_s, frame_id)
    return None if message is None else yaml.safe_dump(message, sort_keys=False, default_flow_style=None)


def covariance(pose: CirclePose) -> np.ndarray:
    """Return the covariance (6, 6) in square metres and square radians; see :func:`pose_message`."""
    matrix = np.zeros((6, 6))
    sigmas_m = pose.sigma_position_m or (math.inf,) * 3
    matrix[:3, :3] = np.diag([_variance(sigma, UNKNOWN_LENGTH_M2) for sigma in sigmas_m])
    about_x, about_y = pose.sigma_theta_rad or (math.inf,) * 2
    rotation = _rotation(pose)
    turns = (
        (rotation[:, 0], _variance(about_x, UNKNOWN_ANGLE_RAD2)),
        (np.array([0.0, 1.0, 0.0]), _variance(about_y, UNKNOWN_ANGLE_RAD2)),
        (rotation[:, 2], UNKNOWN_ANGLE_RAD2),
    )
    for axis, variance in turns:
        matrix[3:, 3:] += variance * np.outer(axis, axis)
    return matrix


def _rotation(pose: CirclePose) -> np.ndarray:
    return rotation_from_angles(pose.theta_x_rad, pose.theta_y_rad)


def _variance(sigma: float, most: float) -> float:
    return min(sigma * sigma, most)
