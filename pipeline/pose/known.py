"""How far a pose is from the truth, where the YAML beside a picture tells it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from dockpose.pose.circle import CirclePose, rotation_from_angles

AGREES_SHARE = 0.02  # of the distance, by which a position that agrees with the truth may be off
AGREES_RAD = math.radians(3.0)


class _Truth(msgspec.Struct, frozen=True):
    position_m: tuple[float, float, float]
    theta_x_deg: float
    theta_y_deg: float


@dataclass(frozen=True)
class PoseError:
    """How far a pose is from the truth.

    Attributes
    ----------
    distance_m : between the two positions.
    angle_rad : between the two normals.
    agrees : within 2 % of the distance and 3 degrees.
    """

    distance_m: float
    angle_rad: float
    agrees: bool

    def __str__(self) -> str:
        """Say it as people read it."""
        return f"off by {100 * self.distance_m:.1f} cm, {math.degrees(self.angle_rad):.1f} deg"


def pose_error(pose: CirclePose, truth: Any) -> PoseError | None:
    """Compare a pose with what a sidecar calls the truth; None where that does not tell position and angles."""
    try:
        known = msgspec.convert(truth, _Truth)
    except msgspec.ValidationError:
        return None
    position = np.array(known.position_m)
    distance = float(np.linalg.norm(pose.position_m - position))
    theta = math.radians(known.theta_x_deg), math.radians(known.theta_y_deg)
    normal = -rotation_from_angles(*theta)[:, 2]
    # The arc cosine of nearly 1 would lose half the digits.
    angle = 2 * math.asin(min(1.0, float(np.linalg.norm(pose.normal - normal)) / 2))
    agrees = distance <= AGREES_SHARE * float(np.linalg.norm(position)) and angle <= AGREES_RAD
    return PoseError(distance, angle, agrees)
