"""Docks in the scene that were not estimated: the truth of a simulated picture, and the pose measured by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import viser
from dockpose.pose.circle import rotation_from_angles
from viser import transforms


def known_pose(known: dict[str, Any] | None) -> tuple[np.ndarray, np.ndarray] | None:
    """Position (3,) in metres and rotation (3, 3) of a known pose; None where it is not told."""
    if known is None or not {"position_m", "theta_x_deg", "theta_y_deg"} <= known.keys():
        return None
    angles = math.radians(known["theta_x_deg"]), math.radians(known["theta_y_deg"])
    return np.array(known["position_m"], dtype=float), rotation_from_angles(*angles)


def cross_and_ring() -> np.ndarray:
    """Pieces (N, 2, 3) of a dotted circle of radius 1, two diameters and a normal: like no estimated dock."""
    angles = np.linspace(0, 2 * np.pi, 121)
    points = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    ring = np.stack([points[:-1], points[1:]], axis=1)[::3]
    across = np.array([[[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, -1]]])
    return np.concatenate([ring, across])


class KnownDock:
    """Draws one known pose, or nothing where it is not known."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: tuple[int, int, int]) -> None:
        path = f"/known_{name}"
        self._frame = scene.add_frame(path, show_axes=False, visible=False)
        self._lines = scene.add_line_segments(
            f"{path}/lines", cross_and_ring(), colour, thickness=1.8, thickness_units="screen"
        )
        self._label = scene.add_label(f"{path}/label", name, anchor="center-left", font_screen_scale=0.8)

    def show(self, known: dict[str, Any] | None, radius_m: float) -> None:
        """Draw the pose with the dock's radius."""
        pose = known_pose(known)
        self._frame.visible = pose is not None
        if pose is None:
            return
        position, rotation = pose
        self._frame.position = position
        self._frame.wxyz = transforms.SO3.from_matrix(rotation).wxyz
        self._lines.scale = radius_m
        self._label.position = (radius_m, 0.0, 0.0)
