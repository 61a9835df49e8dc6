"""A dock's pose as autopilots take it: the vehicle in the dock's frame, and the dock in the vehicle's."""
# Axes are x ahead, y right, z down (FRD), of the vehicle (MAV_FRAME_BODY_FRD) and of the dock (as MAV_FRAME_LOCAL_FRD),
# whose x goes into it, and whose y is level where the camera is: a ring of like lights does not show its roll.

import math
from typing import NamedTuple

import numpy as np
from dockpose.app.export.recordings.ros import covariance
from dockpose.pose.circle import CirclePose
from dockpose.vehicle import Mount, Vehicle
from scipy.spatial.transform import Rotation

AHEAD = Vehicle(T_body_camera=Mount())  # its camera in its middle, and looking ahead
_FRD = AHEAD.rotation  # of axes right, down, ahead
_LEAST_FLAT = 0.2  # sine of the angle between the way into a dock and up or down, below which it has no heading


class Placed(NamedTuple):
    """A pose in a frame: where, and the rotation that takes its own axes to those of the frame."""

    position_m: np.ndarray  # (3,)
    rotation: np.ndarray  # (3, 3)

    @property
    def roll_pitch_yaw_rad(self) -> tuple[float, float, float]:
        """Angles about x, then y, then z of the frame."""
        turned = self.rotation
        pitch = math.asin(max(-1.0, min(1.0, -turned[2, 0])))
        return math.atan2(turned[2, 1], turned[2, 2]), pitch, math.atan2(turned[1, 0], turned[0, 0])


def dock_in_body(pose: CirclePose, vehicle: Vehicle = AHEAD) -> Placed:
    """Where the dock is to the vehicle, both with axes x ahead, y right, z down."""
    found = vehicle.in_frame("frd").pose(pose)
    return Placed(found.position_m, found.rotation @ _FRD.T)


def vehicle_in_dock(pose: CirclePose, vehicle: Vehicle = AHEAD) -> Placed:
    """Where the vehicle is in the dock's frame; ahead of the dock its x is negative."""
    dock = dock_in_body(pose, vehicle)
    return Placed(-dock.rotation.T @ dock.position_m, dock.rotation.T)


def vehicle_covariance(pose: CirclePose, vehicle: Vehicle = AHEAD) -> np.ndarray:
    """Total covariance (6, 6) of x, y, z, roll, pitch, yaw of :func:`vehicle_in_dock`, in m and rad."""
    # The roll is as unknown as to the pose. Nothing of it goes to the position, whose axes are level with the camera.
    here, from_camera = vehicle_in_dock(pose, vehicle), _FRD @ pose.rotation.T
    arm = from_camera.T @ here.position_m
    # A small rotation in the camera's axes, as one that changes theta_y, one of theta_x, and a roll of the dock.
    parts = np.linalg.pinv(np.column_stack([[0.0, 1.0, 0.0], pose.rotation[:, 0], pose.rotation[:, 2]]))
    seen = np.column_stack([[0.0, 1.0, 0.0], pose.rotation[:, 0]]) @ parts[:2]
    _, pitch, yaw = here.roll_pitch_yaw_rad
    cos_yaw, sin_yaw = math.cos(yaw), math.sin(yaw)
    about = np.array(
        [
            [cos_yaw * math.cos(pitch), -sin_yaw, 0.0],
            [sin_yaw * math.cos(pitch), cos_yaw, 0.0],
            [-math.sin(pitch), 0.0, 1.0],
        ]
    )
    to_angles = np.linalg.pinv(about)
    change = np.zeros((6, 6))
    change[:3, :3] = -from_camera
    change[:3, 3:] = from_camera @ np.cross(np.eye(3), arm) @ seen
    change[3:, 3:] = -to_angles @ from_camera @ seen
    found = covariance(pose)
    total = change @ found @ change.T
    total[3, 3] += parts[2] @ found[3:, 3:] @ parts[2]
    mount = vehicle.in_frame("frd").T_body_camera
    turns = math.radians(mount.angle_sigma_deg) * here.rotation
    off = np.zeros((6, 6))  # what the mount may be off
    off[:3, :3] = mount.position_sigma_m * here.rotation
    off[:3, 3:] = turns @ np.cross(np.eye(3), mount.position_m)
    off[3:, 3:] = to_angles @ turns
    return total + off @ off.T


def level_in_dock(
    pose: CirclePose, vehicle: Vehicle, roll_rad: float, pitch_rad: float
) -> tuple[Placed, np.ndarray] | None:
    """The vehicle in the dock's frame with z down by gravity, of known roll and pitch, and the total covariance (6, 6).

    None where the dock faces up or down, so that it shows no heading. Roll and pitch, which are given, vary by nothing.
    """
    dock, body = dock_in_body(pose, vehicle), vehicle.in_frame("frd")
    level = Rotation.from_euler("YX", [pitch_rad, roll_rad]).as_matrix()
    into, mount = level @ dock.rotation[:, 0], body.T_body_camera
    flat_squared = float(into[0] ** 2 + into[1] ** 2)
    if flat_squared < _LEAST_FLAT**2:
        return None
    turned = Rotation.from_euler("Z", -math.atan2(into[1], into[0])).as_matrix() @ level
    here = Placed(-turned @ dock.position_m, turned)
    by_turn = np.cross(np.eye(3), into).T  # what a small rotation does to the way into the dock
    to_yaw = (into[1] * by_turn[0] - into[0] * by_turn[1]) / flat_squared @ level
    total, across = np.zeros((6, 6)), np.cross([0.0, 0.0, 1.0], here.position_m)
    arm = np.cross(np.eye(3), dock.position_m - mount.position_m).T
    for spread, axes, swing in (
        (covariance(pose), body.rotation, np.zeros((3, 3))),
        (np.diag(3 * [mount.position_sigma_m**2] + 3 * [math.radians(mount.angle_sigma_deg) ** 2]), np.eye(3), arm),
    ):
        change = np.zeros((6, 6))
        change[5, 3:] = to_yaw @ axes
        change[:3, :3], change[:3, 3:] = -turned @ axes, -turned @ swing
        change[:3] += np.outer(across, change[5])
        total += change @ spread @ change.T
    return here, total


def moved(before: Placed, now: Placed) -> tuple[np.ndarray, np.ndarray]:
    """Rotation vector from the vehicle's axes before to those of now, and its way along the latter, (3,) each."""
    turned = Rotation.from_matrix(before.rotation.T @ now.rotation).as_rotvec()
    return turned, now.rotation.T @ (now.position_m - before.position_m)


def quaternion_wxyz(rotation: np.ndarray) -> list[float]:
    """A rotation (3, 3) as the quaternion whose w is not negative."""
    x, y, z, w = Rotation.from_matrix(rotation).as_quat(canonical=True).tolist()
    return [w, x, y, z]
