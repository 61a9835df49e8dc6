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
# An angle about which nothing is known is spread evenly over the whole turn, whose variance is (2 pi)^2 / 12.
UNKNOWN_ANGLE_RAD2 = math.pi**2 / 3
UNKNOWN_LENGTH_M2 = 1e6  # a kilometre, squared: further off than any camera sees under water


def pose_message(found: Estimate, time_s: float = 0.0, frame_id: str = FRAME_ID) -> dict[str, Any] | None:
    """The chosen pose as the message's fields; None where there is no pose.

    Parameters
    ----------
    found : of which the chosen pose is told; that there is another candidate has no place in the message.
    time_s : for the stamp, since 1970.
    frame_id : of the camera's optical frame, x right, y down, z ahead (REP 103).

    Returns
    -------
    ``pose.pose`` is where the dock's frame lies in the camera's: z into the dock, away from the camera, x level.
    ``pose.covariance`` is 6 x 6, row by row, in the order of the message: x, y, z, then turns about the fixed axes x, y
    and z of the camera's frame.

    Notes
    -----
    The rotation is Ry(theta_y) Rx(theta_x): a step of theta_y is a turn about the camera's y axis, one of theta_x
    a turn about x after it was turned by theta_y. About the dock's own axis its turn (roll) is not known at all, as all
    lights look alike: that direction has the variance of an even spread, pi^2 / 3. What position and angles
    have to do with each other is not kept, hence the zeros between them.
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
    """The message as YAML text; None where there is no pose."""
    message = pose_message(found, time_s, frame_id)
    return None if message is None else yaml.safe_dump(message, sort_keys=False, default_flow_style=None)


def covariance(pose: CirclePose) -> np.ndarray:
    """Covariance (6, 6) in square metres and square radians, see :func:`pose_message`."""
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
