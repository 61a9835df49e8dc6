"""What the 3D scene shows beside the estimated docks: known ones, the camera's window, and labels."""

import math
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import viser
from dockpose import Camera, Estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.state.view import View
from dockpose.pose.known import KnownPose
from viser import transforms

_LEAST = 0.04  # of the way to the dock: a smaller disc would not be seen
_BEYOND = 1.15  # how far the disc reaches beyond the camera's view
_CORNERS = 48
_COLOUR = (64, 160, 200)
Anchor = Literal["top-center", "bottom-center", "center-left", "center-right", "center-center"]
AXES_TO = 0.15  # of the way to the dock: where the letters of the camera's axes stand
_CAMERA_AT = np.array([0.0, -0.06, -0.045])  # above and behind the camera, of the way to the dock
_PORT_AT = np.array([0.0, 0.09, -0.03])  # beside and below it


def circle(corners: int) -> np.ndarray:
    """Segments (N, 2, 3) of a circle of radius 1 in the dock's plane."""
    angles = np.linspace(0, 2 * np.pi, corners + 1)
    points = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    return np.stack([points[:-1], points[1:]], axis=1)


def add_lines(scene: viser.SceneApi, path: str, lines: np.ndarray, colour: Any, wide: float) -> Any:
    """Add segments (N, 2, 3) of a width in the screen's pixels."""
    return scene.add_line_segments(path, lines, colour, thickness=wide, thickness_units="screen")


class KnownDock:
    """Draws one known pose, if there is one."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: tuple[int, int, int]) -> None:
        path = f"/known_{name}"
        self._frame = scene.add_frame(path, show_axes=False, visible=False)
        # A dotted circle of radius 1, two diameters and a normal: unlike any estimated dock.
        across = np.array([[[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, -1]]])
        self._lines = add_lines(scene, f"{path}/lines", np.concatenate([circle(120)[::3], across]), colour, 1.8)

    def show(self, known: KnownPose | None, radius_m: float) -> None:
        """Draw the pose with the dock's radius."""
        self._frame.visible = known is not None
        if known is None:
            return
        self._frame.position = known.position_m
        self._frame.wxyz = transforms.SO3.from_matrix(known.rotation).wxyz
        self._lines.scale = radius_m


def port_radius_m(camera: Camera, depth_m: float) -> float | None:
    """Radius of the disc that stands for the camera's port; None where it has none."""
    if camera.port is None:
        return None
    face_m = camera.port.air_gap_m + camera.port.glass_m
    corner = math.hypot(*(math.tan(angle / 2) for angle in camera.field_of_view_rad))
    return max(_BEYOND * face_m * corner, _LEAST * depth_m)


class PortDisc:
    """Draws the port, if the camera has one: its glass, and the rim of either face."""

    def __init__(self, scene: viser.SceneApi) -> None:
        edges = circle(_CORNERS)
        corners = np.vstack([edges.reshape(-1, 3), np.zeros(3)])
        numbers = np.arange(0, 2 * _CORNERS, 2)
        faces = np.column_stack([np.full(_CORNERS, 2 * _CORNERS), numbers, numbers + 1])
        self._frame = scene.add_frame("/port", show_axes=False, visible=False)
        self._glass = scene.add_mesh_simple("/port/glass", corners, faces, color=_COLOUR, opacity=0.35, side="double")
        self._rims = [add_lines(scene, f"/port/{face}", edges, _COLOUR, 1.5) for face in ("inner", "outer")]
        for node in (self._glass, *self._rims):
            node.scale = _LEAST  # a browser may show it before it hears of its size

    def show(self, camera: Camera, radius: float | None) -> None:
        """Draw the port of the camera at its true distance."""
        port = camera.port
        self._frame.visible = port is not None
        if port is None or radius is None:
            return
        faces_m = port.air_gap_m, port.air_gap_m + port.glass_m
        self._glass.position, self._glass.scale = (0.0, 0.0, sum(faces_m) / 2), radius
        for rim, face_m in zip(self._rims, faces_m, strict=True):
            rim.position, rim.scale = (0.0, 0.0, face_m), radius


@dataclass(frozen=True)
class Label:
    """Words at a position (metres); the anchor is the part of the words that stands there."""

    text: str
    position: np.ndarray
    anchor: Anchor


def labels(found: Estimate, view: View, depth_m: float, port_radius_m: float | None) -> dict[str, Label]:
    """Return the labels by name; those of docks, which lie nearly in one place, have a side each to themselves."""
    radius, axes = found.dock.radius, AXES_TO * depth_m * np.eye(3)
    placed = {axis: Label(axis, axes[index], "center-center") for index, axis in enumerate("xyz")}
    placed["camera"] = Label("camera", _CAMERA_AT * depth_m, "bottom-center")
    if port_radius_m is not None:
        placed["port"] = Label("port", _PORT_AT * depth_m - (port_radius_m, 0.0, 0.0), "center-right")
    heights = [pose.position_m[1] for pose in found.candidates]
    upper = int(np.argmin(heights)) if heights else 0
    for index, pose in enumerate(found.candidates):
        side, anchor = (-radius, "bottom-center") if index == upper else (radius, "top-center")
        text = POSE_NAMES[index] + ("" if pose.probability is None else f" {100 * pose.probability:.0f} %")
        text += "" if found.by_hand is None else ", lights by hand"
        placed[POSE_NAMES[index]] = Label(text, np.asarray(pose.position_m) + (0.0, side, 0.0), anchor)
    if view.truth is not None:
        placed["truth"] = Label("truth", np.asarray(view.truth.position_m) + (radius, 0.0, 0.0), "center-left")
    if view.measured_pose is not None:
        position = np.asarray(view.measured_pose.position_m) - (radius, 0.0, 0.0)
        placed["measured"] = Label("measured", position, "center-right")
    return placed
