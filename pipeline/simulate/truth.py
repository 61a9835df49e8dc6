"""The truth of a simulated picture."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
from dockpose.lights.ellipse import Ellipse, NoEllipseError, fit_ellipse
from dockpose.pose.circle import rotation_from_angles
from dockpose.simulate.parts import Occluder
from dockpose.simulate.scene import Scene

_CIRCLE_POINTS = 360  # of which the ellipse is fitted
_DECIMALS = 9  # in files; leaves out the last digits, which differ between machines' linear algebra


@dataclass(frozen=True)
class Truth:
    """The truth of a picture.

    Attributes
    ----------
    position_m : (3,) float array, metres
        The dock's centre in the camera frame.
    normal : (3,) float array
        Unit normal of the dock's face in the camera frame.
    lights_m, lights_px : (N, 3) and (N, 2) float arrays, metres and pixels
        The lights in the camera frame, and their images; NaN for those behind the camera.
    lit, visible : (N,) bool arrays
        Neither missing nor off in this picture; lit, facing the camera, inside the picture and not hidden.
    centre_px : (2,) float array, pixels
        Image of the dock's centre.
    ellipse : Ellipse or None
        Image of the circle through the lights, in pixels of the undistorted picture, computed from the circle itself;
        None where the circle is not entirely in front of the camera.
    """

    position_m: np.ndarray
    normal: np.ndarray
    lights_m: np.ndarray
    lights_px: np.ndarray
    lit: np.ndarray
    visible: np.ndarray
    centre_px: np.ndarray
    ellipse: Ellipse | None


def truth_of(scene: Scene) -> Truth:
    """Compute what the picture of ``scene`` shows, without rendering it.

    Parameters
    ----------
    scene : Scene
        The scene.

    Returns
    -------
    Truth
        Where the dock, its lights and their ellipse are, in space and in the picture.
    """
    rotation = dock_rotation(scene)
    position = np.array(scene.pose.position_m)
    ring_m = position + scene.dock.lamp_depth_m * rotation[:, 2]
    if scene.dock.rings:
        lights_m = position + scene.dock.every_light_point() @ rotation.T
    else:
        lights_m = _on_ring(scene, np.array(scene.light_angles_rad), ring_m, rotation)
        lights_m += np.array(scene.dock.offsets_m or np.zeros(3)) @ rotation.T
    lights_px = scene.camera.project(lights_m)
    normal = -rotation[:, 2]
    lit = _lit(scene)
    facing = lights_m @ normal < 0
    visible = lit & facing & _inside(lights_px, scene) & ~_hidden(lights_px, scene.occluders)
    ellipse = _circle_image(scene, ring_m, rotation)
    centre_px = scene.camera.project(position[None])[0]
    return Truth(position, normal, lights_m, lights_px, lit, visible, centre_px, ellipse)


def dock_rotation(scene: Scene) -> np.ndarray:
    """Rotation (3, 3) from the dock's frame to the camera's, roll included."""
    pose = scene.pose
    return rotation_from_angles(*map(math.radians, (pose.theta_x_deg, pose.theta_y_deg, pose.roll_deg)))


def truth_dict(scene: Scene, truth: Truth) -> dict[str, Any]:
    """The truth as plain values with their units in the names, for a file; None for what has no image."""
    ellipse = truth.ellipse
    return {
        "position_m": _numbers(truth.position_m),
        "normal": _numbers(truth.normal),
        "theta_x_deg": scene.pose.theta_x_deg,
        "theta_y_deg": scene.pose.theta_y_deg,
        "roll_deg": scene.pose.roll_deg,
        "centre_px": _numbers(truth.centre_px),
        "lights_px": [_numbers(point) for point in truth.lights_px],
        "visible": truth.visible.tolist(),
        "ellipse": None
        if ellipse is None
        else {
            "centre_px": _numbers(ellipse.centre_px),
            "semi_axes_px": _numbers(ellipse.semi_axes_px),
            "angle_deg": round(math.degrees(ellipse.angle_rad), _DECIMALS),
        },
    }


def random_stream(scene: Scene, name: str) -> np.random.Generator:
    """Random numbers for one part of a scene; changing one part leaves the others' numbers unchanged."""
    return np.random.default_rng([scene.seed, *name.encode()])


def _on_ring(scene: Scene, angles: np.ndarray, position: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    ring = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    return position + scene.dock.radius * ring @ rotation.T


def _circle_image(scene: Scene, position: np.ndarray, rotation: np.ndarray) -> Ellipse | None:
    angles = np.linspace(0, 2 * np.pi, _CIRCLE_POINTS, endpoint=False)
    image = scene.camera.project(_on_ring(scene, angles, position, rotation))
    if not np.isfinite(image).all():
        return None
    try:
        return fit_ellipse(scene.camera.undistort(image))
    except NoEllipseError:
        return None


def _lit(scene: Scene) -> np.ndarray:
    count = scene.light_count
    lit = random_stream(scene, "flicker").random(count) >= scene.lights.flicker
    lit[list(scene.lights.missing)] = False
    return lit


def _inside(points_px: np.ndarray, scene: Scene) -> np.ndarray:
    size = np.array([scene.camera.width, scene.camera.height])
    return np.all((points_px > -0.5) & (points_px < size - 0.5), axis=1)


def _hidden(points_px: np.ndarray, occluders: tuple[Occluder, ...]) -> np.ndarray:
    hidden = np.zeros(len(points_px), dtype=bool)
    for bar in occluders:
        angle = math.radians(bar.angle_deg)
        turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
        local = np.abs((points_px - [bar.x_px, bar.y_px]) @ turn.T)
        hidden |= (local <= [bar.width_px / 2, bar.height_px / 2]).all(axis=1)
    return hidden


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [round(float(value), _DECIMALS) if math.isfinite(value) else None for value in values]
