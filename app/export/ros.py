"""A pose as ROS 2's ``geometry_msgs/PoseWithCovarianceStamped``, in YAML that ``ros2 topic pub`` takes."""

from __future__ import annotations

from typing import Any

import numpy as np
import yaml
from dockpose import Estimate
from dockpose.pose.circle import UNKNOWN_ANGLE_RAD2, UNKNOWN_LENGTH_M2, CirclePose

FRAME_ID = "camera_optical_frame"


def pose_message(pose: CirclePose, time_s: float, frame_id: str = FRAME_ID) -> dict[str, Any]:
    """Return a pose as the message's fields.

    Parameters
    ----------
    pose : CirclePose
        The pose.
    time_s : float, seconds
        Time of the stamp, since 1970.
    frame_id : str
        Name of the camera's optical frame: x right, y down, z ahead (REP 103).

    Returns
    -------
    dict
        ``pose.pose`` is the dock's frame in the camera's: z into the dock, away from the camera, x level.
        ``pose.covariance`` is 6 x 6, row by row: x, y, z, then rotations about the camera's fixed axes x, y and z.

    Notes
    -----
    The rotation is Ry(theta_y) Rx(theta_x). Roll, about the dock's own axis, is unobservable where all lights look
    alike; it gets the variance of a uniform distribution over a full turn, pi^2 / 3.
    """
    x, y, z, w = pose.quaternion_xyzw
    return {
        "header": header(time_s, frame_id),
        "pose": {
            "pose": {
                "position": dict(zip("xyz", pose.position_m.tolist(), strict=True)),
                "orientation": {"x": x, "y": y, "z": z, "w": w},
            },
            "covariance": covariance(pose).ravel().tolist(),
        },
    }


def header(time_s: float, frame_id: str = FRAME_ID) -> dict[str, Any]:
    """Return a message's header; ``time_s`` is in seconds since 1970."""
    nanoseconds = round(1e9 * time_s)
    return {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}, "frame_id": frame_id}


def pose_yaml(found: Estimate, time_s: float | None, frame_id: str = FRAME_ID) -> str | None:
    """Return the message of the chosen pose as YAML; None without a pose.

    ``time_s`` is in seconds since 1970; where it is None the stamp is 0, and a comment says so.
    """
    if found.selected is None:
        return None
    message = pose_message(found.selected, 0.0 if time_s is None else time_s, frame_id)
    unknown = "# When the picture was taken is not known: the stamp is 0.\n" if time_s is None else ""
    return unknown + yaml.safe_dump(message, sort_keys=False, default_flow_style=None)


def covariance(pose: CirclePose) -> np.ndarray:
    """Return the covariance (6, 6) in square metres and square radians; see :func:`pose_message`.

    Where the errors of a pose are not known, each of its numbers has the variance of one of which nothing is known.
    """
    found = pose.covariance
    if found is not None:
        return found
    return np.diag([UNKNOWN_LENGTH_M2] * 3 + [UNKNOWN_ANGLE_RAD2] * 3)
