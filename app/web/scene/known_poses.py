"""Known docks in the 3D scene: the truth of a simulated picture, and a pose measured by hand."""

import numpy as np
import viser
from dockpose.pose.known import KnownPose
from viser import transforms


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
