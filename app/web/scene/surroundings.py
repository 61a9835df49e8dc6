"""What the 3D scene shows beside the estimated docks: known ones, and the window in front of the camera."""

import math

import numpy as np
import viser
from dockpose import Camera
from dockpose.pose.known import KnownPose
from viser import transforms

_LEAST = 0.04  # of the way to the dock: a smaller disc would not be seen
_BEYOND = 1.15  # how far the disc reaches beyond the camera's view
_CORNERS = 48
_COLOUR = (64, 160, 200)


def cross_and_ring() -> np.ndarray:
    """Segments (N, 2, 3) of a dotted circle of radius 1, two diameters and a normal: unlike any estimated dock."""
    angles = np.linspace(0, 2 * np.pi, 121)
    points = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
    ring = np.stack([points[:-1], points[1:]], axis=1)[::3]
    across = np.array([[[-1, 0, 0], [1, 0, 0]], [[0, -1, 0], [0, 1, 0]], [[0, 0, 0], [0, 0, -1]]])
    return np.concatenate([ring, across])


class KnownDock:
    """Draws one known pose, if there is one."""

    def __init__(self, scene: viser.SceneApi, name: str, colour: tuple[int, int, int]) -> None:
        path = f"/known_{name}"
        self._frame = scene.add_frame(path, show_axes=False, visible=False)
        self._lines = scene.add_line_segments(
            f"{path}/lines", cross_and_ring(), colour, thickness=1.8, thickness_units="screen"
        )

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
        angles = np.linspace(0, 2 * np.pi, _CORNERS + 1)
        rim = np.column_stack([np.cos(angles), np.sin(angles), np.zeros_like(angles)])
        numbers = np.arange(_CORNERS)
        faces = np.column_stack([np.full(_CORNERS, _CORNERS + 1), numbers, numbers + 1])
        self._frame = scene.add_frame("/port", show_axes=False, visible=False)
        self._glass = scene.add_mesh_simple(
            "/port/glass", np.vstack([rim, np.zeros(3)]), faces, color=_COLOUR, opacity=0.35, side="double"
        )
        edges = np.stack([rim[:-1], rim[1:]], axis=1)
        self._rims = [
            scene.add_line_segments(f"/port/{face}", edges, _COLOUR, thickness=1.5, thickness_units="screen")
            for face in ("inner", "outer")
        ]
        for node in (self._glass, *self._rims):
            node.scale = _LEAST  # a browser may show it before it hears of its size

    def show(self, camera: Camera, depth_m: float) -> None:
        """Draw the port of the camera at its true distance."""
        radius, port = port_radius_m(camera, depth_m), camera.port
        self._frame.visible = port is not None
        if port is None or radius is None:
            return
        faces_m = port.air_gap_m, port.air_gap_m + port.glass_m
        self._glass.position, self._glass.scale = (0.0, 0.0, sum(faces_m) / 2), radius
        for rim, face_m in zip(self._rims, faces_m, strict=True):
            rim.position, rim.scale = (0.0, 0.0, face_m), radius
