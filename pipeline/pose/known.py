"""Poses known from a scene's truth or a measurement, and the errors of estimates against them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import msgspec
import numpy as np
from dockpose.checks import check_number, make_plain
from dockpose.pose.circle import CirclePose, angles_of, rotation_from_angles

AGREES_SHARE = 0.02  # of the distance: the largest error of a position that agrees with the truth
AGREES_RAD = math.radians(3.0)  # the largest error of an attitude that agrees


class KnownPose(msgspec.Struct, frozen=True, dict=True):
    """The known pose of a dock."""

    position_m: tuple[float, float, float]  # centre of the dock in the camera frame
    theta_x_deg: float  # pitch of its face
    theta_y_deg: float  # yaw of its face

    def __post_init__(self) -> None:
        make_plain(self)
        for value in (*self.position_m, self.theta_x_deg, self.theta_y_deg):
            check_number("a known pose", value)

    @cached_property
    def rotation(self) -> np.ndarray:
        """Rotation (3, 3) from the dock's frame to the camera's, without roll."""
        return rotation_from_angles(math.radians(self.theta_x_deg), math.radians(self.theta_y_deg))

    def rotated(self, degrees: int) -> KnownPose:
        """The same pose in the camera of the picture turned clockwise, see :meth:`Camera.rotated`."""
        pose = self
        for _ in range(degrees // 90):
            (x, y, z), normal = pose.position_m, -pose.rotation[:, 2]
            theta_x, theta_y = angles_of(normal[[1, 0, 2]] * [-1, 1, 1])
            pose = KnownPose((-y, x, z), math.degrees(theta_x), math.degrees(theta_y))
        return pose


def read_known_pose(content: Any) -> KnownPose | None:
    """Read the pose from the ``truth`` of a YAML file, ignoring other keys; None where it lacks position or angles."""
    try:
        return msgspec.convert(content, KnownPose)
    except msgspec.ValidationError:
        return None


@dataclass(frozen=True)
class PoseError:
    """How far an estimated pose is from a known one."""

    distance_m: float  # distance between the two positions
    angle_rad: float  # angle between the two normals
    agrees: bool  # whether they agree within 2 % of the distance and 3 degrees

    def __str__(self) -> str:
        return f"off by {100 * self.distance_m:.1f} cm, {math.degrees(self.angle_rad):.1f} deg"


def pose_error(pose: CirclePose | None, known: KnownPose | None) -> PoseError | None:
    """Compare an estimated pose with a known one; None where either is missing."""
    if pose is None or known is None:
        return None
    position = np.array(known.position_m)
    distance = float(np.linalg.norm(pose.position_m - position))
    normal = -known.rotation[:, 2]
    # The arc cosine near 1 would lose half the digits.
    angle = 2 * math.asin(min(1.0, float(np.linalg.norm(pose.normal - normal)) / 2))
    agrees = distance <= AGREES_SHARE * float(np.linalg.norm(position)) and angle <= AGREES_RAD
    return PoseError(distance, angle, agrees)
