"""What a simulated picture shows, and the truth that belongs to it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np

from pipeline.camera import Camera
from pipeline.checks import check_number, check_whole
from pipeline.circle_pose import rotation_from_angles
from pipeline.dock import Dock


class Scene(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """One picture to simulate: camera, dock, its pose, the lights, the water's glow and the sensor.

    Parameters
    ----------
    camera, dock : the dock needs a known number of lights.
    position_m : (x, y, z) of the dock's centre in the camera frame, z above 0.
    theta_x_deg, theta_y_deg, roll_deg : attitude of the dock; roll turns the ring in its own plane.
    light_radius_m : of one lamp.
    light_level : grey levels that a lamp's centre would show 1 m away in clear water, unclipped.
    attenuation_per_m : of the direct light, Beer-Lambert.
    scattered_per_m : of the light that scattering turns into glow, at most the attenuation.
    glow_width_deg : angle within which half of the glow arrives.
    blur_px : standard deviation of the lens blur.
    background_level : grey level of the water.
    noise_levels : standard deviation of the sensor noise, in grey levels.
    seed : of the noise; the same scene with the same seed gives the same picture.
    """

    camera: Camera
    dock: Dock
    position_m: tuple[float, float, float]
    theta_x_deg: float = 0.0
    theta_y_deg: float = 0.0
    roll_deg: float = 0.0
    light_radius_m: float = 0.004
    light_level: float = 400.0
    attenuation_per_m: float = 0.4
    scattered_per_m: float = 0.2
    glow_width_deg: float = 1.5
    blur_px: float = 0.8
    background_level: float = 12.0
    noise_levels: float = 1.5
    seed: int = 0

    def __post_init__(self) -> None:
        for name in ("theta_x_deg", "theta_y_deg", "roll_deg"):
            check_number(name, getattr(self, name))
        for axis, value in zip("xyz", self.position_m, strict=True):
            check_number(f"position_m {axis}", value)
        check_number("position_m z", self.position_m[2], above=0)
        for name in ("light_radius_m", "light_level", "glow_width_deg", "blur_px"):
            check_number(name, getattr(self, name), above=0)
        for name in ("attenuation_per_m", "scattered_per_m", "background_level", "noise_levels"):
            check_number(name, getattr(self, name))
            if getattr(self, name) < 0:
                raise ValueError(f"{name} is {getattr(self, name)!r}; it must be at least 0")
        if self.scattered_per_m > self.attenuation_per_m:
            raise ValueError(
                f"scattered_per_m is {self.scattered_per_m!r}; it must be at most attenuation_per_m, "
                f"which is {self.attenuation_per_m!r}"
            )
        check_whole("seed", self.seed, least=0)
        if self.dock.lights is None:
            raise ValueError("dock.lights is None; a simulated dock needs its number of lights")


@dataclass(frozen=True)
class Truth:
    """What a simulated picture really shows.

    Attributes
    ----------
    position_m, normal : (3,) of the dock, in the camera frame.
    lights_m : (N, 3) the lights in the camera frame.
    lights_px : (N, 2) their images; NaN behind the camera.
    visible : (N,) bool, lights in front of the camera, inside the picture, on a dock that faces the camera.
    centre_px : (2,) image of the dock's centre.
    """

    position_m: np.ndarray
    normal: np.ndarray
    lights_m: np.ndarray
    lights_px: np.ndarray
    visible: np.ndarray
    centre_px: np.ndarray


def truth_of(scene: Scene) -> Truth:
    """Work out what the picture of ``scene`` shows, without rendering it."""
    rotation = rotation_from_angles(math.radians(scene.theta_x_deg), math.radians(scene.theta_y_deg))
    roll = math.radians(scene.roll_deg)
    turn = np.array([[math.cos(roll), -math.sin(roll), 0], [math.sin(roll), math.cos(roll), 0], [0, 0, 1]])
    position = np.array(scene.position_m)
    lights_m = position + scene.dock.light_points() @ (rotation @ turn).T
    lights_px = scene.camera.project(lights_m)
    normal = -rotation[:, 2]
    inside = (lights_px > -0.5) & (lights_px < np.array([scene.camera.width, scene.camera.height]) - 0.5)
    visible = inside.all(axis=1) & (lights_m @ normal < 0)
    return Truth(position, normal, lights_m, lights_px, visible, scene.camera.project(position[None])[0])


def truth_dict(scene: Scene, truth: Truth) -> dict[str, Any]:
    """The truth as plain values with their units in the names, for a file."""
    return {
        "position_m": truth.position_m.tolist(),
        "normal": truth.normal.tolist(),
        "theta_x_deg": scene.theta_x_deg,
        "theta_y_deg": scene.theta_y_deg,
        "roll_deg": scene.roll_deg,
        "centre_px": truth.centre_px.tolist(),
        "lights_px": truth.lights_px.tolist(),
        "visible": truth.visible.tolist(),
    }
