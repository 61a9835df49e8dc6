"""Pose of what is fixed to a dock: its entrance."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock, Vector, frame_of
from dockpose.pose.circle import CirclePose, rotation_from_angles


def upright_roll_rad(pose: CirclePose, dock: Dock) -> float:
    """Roll of a dock; of those that lights alike cannot tell apart the smallest, as of a dock that stands upright."""
    is_known = dock.lights is None or bool(dock.angles_deg or dock.offsets_m)
    period = 2 * math.pi if is_known else 2 * math.pi / (dock.lights or 1)
    return math.remainder(pose.roll_rad or 0.0, period)


def rotation_with_roll(pose: CirclePose, dock: Dock) -> np.ndarray:
    """Rotation (3, 3) from the dock's frame, upright roll included, to the camera's."""
    return pose.rotation @ rotation_from_angles(0.0, 0.0, upright_roll_rad(pose, dock))


def fixed_to(pose: CirclePose, dock: Dock, position_m: Vector, normal: Vector, camera: Camera) -> CirclePose:
    """Pose of what sits at a place of the dock's frame and faces along a normal there, with its errors."""
    rotation = rotation_with_roll(pose, dock)
    lever_m, turned = rotation @ position_m, rotation @ frame_of(normal)
    moved = CirclePose.at(pose.position_m + lever_m, -turned[:, 2], camera, probability=pose.probability)
    along_x, along_y = moved.rotation[:, :2].T @ turned[:, 0]
    known: dict[str, Any] = {"roll_rad": math.atan2(along_y, along_x), "rms_px": pose.rms_px}
    if pose.errors is not None:
        errors = pose.errors.carried(lever_m, moved.rotation)
        sigmas = errors.sigmas["picture"]
        known |= {"errors": errors, "sigma_position_m": sigmas[0], "sigma_theta_rad": sigmas[1]}
    return replace(moved, **known)
