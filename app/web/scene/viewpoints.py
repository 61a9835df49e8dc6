"""The viewpoint from which camera and docks fill the 3D view; who has not turned the scene is kept there."""

import math
from dataclasses import dataclass

import numpy as np
import viser

_TO_THE_EYE = np.array([0.8, -0.2, -0.6])  # the camera's y points down
FOV_RAD = math.radians(50)
_ASPECT = 1.7  # width to height of the 3D view on a small laptop
_SIDEWAYS, _DOWN, _UP = 0.8, 0.85, 0.7  # of half the view, for what is shown: labels and buttons need the rest
_MOVED, _DUE = 0.01, 0.1  # of the distance to what is looked at: less is rounding; from here on the view is set anew


@dataclass(frozen=True)
class Viewpoint:
    """Where the eye is and what it looks at, in metres."""

    position: np.ndarray
    look_at: np.ndarray

    def is_near(self, other: "Viewpoint | viser.CameraHandle", share: float) -> bool:
        """Whether another one differs by less than a share of the distance to what is looked at."""
        moved = np.array([other.position - self.position, other.look_at - self.look_at])
        return bool(np.linalg.norm(moved, axis=1).max() < share * np.linalg.norm(self.look_at - self.position))


def viewpoint(points: np.ndarray, aspect: float | None = None) -> Viewpoint:
    """Return the nearest viewpoint that has all points (N, 3) in the free part of the view."""
    aspect, half_up = aspect or _ASPECT, math.tan(FOV_RAD / 2)
    away = _TO_THE_EYE / np.linalg.norm(_TO_THE_EYE)
    right = np.cross(away, [0, -1.0, 0]) / np.hypot(away[0], away[2])
    axes = np.array([right, np.cross(right, away)])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    corners = points - middle
    wide, high = _SIDEWAYS * half_up * aspect, _UP * half_up
    look_at, distance = middle, 0.0
    for axis, before, beyond in zip(axes, (wide, _DOWN * half_up), (wide, high), strict=True):
        # From where the lowest corner stands at the lower edge, and the highest one at the upper.
        low, top = (corners @ (away - axis / before)).max(), (corners @ (away + axis / beyond)).max()
        shift = (top - low) / (1 / before + 1 / beyond)
        look_at, distance = look_at + shift * axis, max(distance, top - shift / beyond)
    return Viewpoint(look_at + distance * away, look_at)


class Viewpoints:
    """Moves browsers to viewpoints, and keeps in view what is drawn for those who have not turned the scene since."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._placed: dict[int, Viewpoint] = {}
        self._shown = np.eye(3)
        server.on_client_connect(self.fit)
        server.on_client_disconnect(self._forget)

    def show(self, everything: np.ndarray, *, is_other: bool) -> None:
        """Take note of the points (N, 3) that are to be seen; ``is_other`` says that they are of another picture."""
        self._shown = everything
        if is_other:
            place, initial = viewpoint(everything), self._server.initial_camera
            initial.fov, initial.position, initial.look_at = FOV_RAD, place.position, place.look_at
        for client in self._server.get_clients().values():
            old = self._placed.get(client.client_id)
            if old is not None and old.is_near(client.camera, _MOVED):
                place = viewpoint(everything, client.camera.aspect)
                if is_other or not place.is_near(old, _DUE):
                    self.fit(client)

    def _forget(self, client: viser.ClientHandle) -> None:
        self._placed.pop(client.client_id, None)

    def fit(self, client: viser.ClientHandle) -> None:
        """Move one browser's viewpoint to where it sees all."""
        place = self._placed[client.client_id] = viewpoint(self._shown, client.camera.aspect)
        with client.atomic():
            client.camera.fov = FOV_RAD
            client.camera.position, client.camera.look_at = place.position, place.look_at
