"""What the 3D scene shows beside the estimated docks: known ones, and labels."""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import viser
from dockpose import Estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.state.view import View
from dockpose.pose.known import KnownPose
from viser import transforms

Anchor = Literal["top-center", "bottom-center", "bottom-left", "center-left", "center-right", "center-center"]
AXES_TO = 0.15  # of the way to the dock: where the letters of the camera's axes stand
_CAMERA_AT = np.array([-0.25, -0.18, 0.0])  # above the camera, of the way to the dock


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
        path = f"/docks/known_{name}"
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


@dataclass(frozen=True)
class Label:
    """Words at a position (metres); the anchor is the part of the words that stands there."""

    text: str
    position: np.ndarray
    anchor: Anchor


def labels(found: Estimate, view: View, depth_m: float, shift: np.ndarray) -> dict[str, Label]:
    """Return the labels by name; those of docks, drawn ``shift`` (3,) from their places, have a side each."""
    radius, axes = found.dock.radius, AXES_TO * depth_m * np.eye(3)
    placed = {axis: Label(axis, axes[index], "center-center") for index, axis in enumerate("xyz")}
    pose = found.selected
    words = "camera" if pose is None else f"camera, {np.linalg.norm(pose.position_m):.2f} m"
    placed["camera"] = Label(words, _CAMERA_AT * depth_m, "bottom-left")
    heights = [pose.position_m[1] for pose in found.candidates]
    upper = int(np.argmin(heights)) if heights else 0
    for index, pose in enumerate(found.candidates):
        side, anchor = (-radius, "bottom-center") if index == upper else (radius, "top-center")
        text = POSE_NAMES[index] + ("" if pose.probability is None else f" {100 * pose.probability:.0f} %")
        text += "" if found.by_hand is None else ", lights by hand"
        placed[POSE_NAMES[index]] = Label(text, np.asarray(pose.position_m) + shift + (0.0, side, 0.0), anchor)
    if view.truth is not None:
        placed["truth"] = Label("truth", np.asarray(view.truth.position_m) + shift + (radius, 0.0, 0.0), "center-left")
    if view.measured_pose is not None:
        position = np.asarray(view.measured_pose.position_m) + shift - (radius, 0.0, 0.0)
        placed["measured"] = Label("measured", position, "center-right")
    return placed
