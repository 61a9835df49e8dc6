"""Labels of the 3D scene: what they say, and where they stand so that none covers another."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.state.view import View
from dockpose.pose.circle import CirclePose

Anchor = Literal["top-center", "bottom-center", "center-left", "center-right", "center-center"]
AXES_TO = 0.15  # of the way to the dock: where the letters of the camera's axes stand
_CAMERA_AT = np.array([0.0, -0.08, -0.06])  # above and behind the camera, of the way to the dock
_PORT_AT = np.array([0.0, 0.09, -0.03])  # beside and below it


@dataclass(frozen=True)
class Label:
    """Words at a position (metres); the anchor is the part of the words that stands there."""

    text: str
    position: np.ndarray
    anchor: Anchor


def pose_label(name: str, pose: CirclePose) -> str:
    """Label of a pose: its letter, and how likely it is."""
    return name if pose.probability is None else f"{name} {100 * pose.probability:.0f} %"


def labels(found: Estimate, view: View, depth_m: float, port_radius_m: float | None) -> dict[str, Label]:
    """Return the labels by name.

    The docks of one picture lie nearly in one place, so each of their labels has a side to itself: of the poses, the
    higher has the one above, and the other that below; the true dock has the right, and the measured one the left.
    Anchors hold on the screen, so the sides stay apart from wherever the scene is seen, as long as up is up.
    """
    radius, axes = found.dock.radius, AXES_TO * depth_m * np.eye(3)
    placed = {axis: Label(axis, axes[index], "center-center") for index, axis in enumerate("xyz")}
    placed["camera"] = Label("camera", _CAMERA_AT * depth_m, "bottom-center")
    if port_radius_m is not None:
        placed["port"] = Label("port", _PORT_AT * depth_m - (port_radius_m, 0.0, 0.0), "center-right")
    heights = [pose.position_m[1] for pose in found.candidates]
    upper = int(np.argmin(heights)) if heights else 0
    for index, pose in enumerate(found.candidates):
        side, anchor = (-radius, "bottom-center") if index == upper else (radius, "top-center")
        text = pose_label(POSE_NAMES[index], pose)
        placed[POSE_NAMES[index]] = Label(text, np.asarray(pose.position_m) + (0.0, side, 0.0), anchor)
    if view.truth is not None:
        placed["truth"] = Label("truth", np.asarray(view.truth.position_m) + (radius, 0.0, 0.0), "center-left")
    if view.measured_pose is not None:
        position = np.asarray(view.measured_pose.position_m) - (radius, 0.0, 0.0)
        placed["measured"] = Label("measured", position, "center-right")
    return placed
