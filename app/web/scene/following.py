"""Where each browser looks from: at a viewpoint of ours, which follows the dock, or where somebody turned the scene."""

import math
from dataclasses import dataclass

import numpy as np
import viser
from dockpose import Camera
from dockpose.app.web.scene.viewpoints import CLOSE_UP, FROM_CAMERA, OVERVIEW, Extent, Viewpoint, shows, viewpoint

_MOVED = 0.01  # of the distance to what is looked at: less is rounding
_FARTHER = 1.6  # times the distance that would do: from there the scene is small
_RESHAPED = 1.05


@dataclass(frozen=True)
class _Placed:
    name: str
    viewpoint: Viewpoint
    aspect: float


class Viewpoints:
    """Moves browsers to viewpoints, and keeps in view what is drawn for those who have not turned the scene since."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._placed: dict[int, _Placed] = {}
        self._all, self._docks = Extent(np.zeros(3), np.ones(3)), None
        self._camera = Camera(1.0, 1.0, 0.0, 0.0, 1, 1)
        server.on_client_connect(self._welcome)
        server.on_client_disconnect(self._forget)

    def show(self, everything: Extent, docks: Extent | None, camera: Camera, *, is_other: bool) -> None:
        """Take note of what is drawn; ``is_other`` says that it is of another picture than before."""
        self._all, self._docks, self._camera = everything, docks, camera
        place, initial = self._place(OVERVIEW, None), self._server.initial_camera
        if is_other:
            initial.fov, initial.position, initial.look_at = place.fov_rad, place.position, place.look_at
        for client in self._server.get_clients().values():
            placed = self._placed.get(client.client_id)
            if placed is None or (self._was_turned(client, placed) and not (is_other and self._lost_dock(client))):
                continue
            if is_other or self._is_due(client, placed):
                self.look_from(client, OVERVIEW if self._was_turned(client, placed) else placed.name)

    def look_from(self, client: viser.ClientHandle, name: str) -> None:
        """Move one browser's viewpoint to one of ``viewpoints.NAMES``."""
        aspect = client.camera.aspect
        place = self._place(name, aspect)
        self._placed[client.client_id] = _Placed(name, place, aspect)
        with client.atomic():
            client.camera.fov = place.fov_rad
            client.camera.position = place.position
            client.camera.look_at = place.look_at

    def _place(self, name: str, aspect: float | None) -> Viewpoint:
        extent = self._docks if name == CLOSE_UP and self._docks is not None else self._all
        return viewpoint(name, extent, self._camera, aspect)

    def _welcome(self, client: viser.ClientHandle) -> None:
        """Fit the scene to the browser's window now, and whenever that changes its shape."""
        self.look_from(client, OVERVIEW)

        def reshaped(camera: viser.CameraHandle) -> None:
            placed = self._placed.get(client.client_id)
            if placed is None or self._was_turned(client, placed):
                return
            if abs(math.log(camera.aspect / placed.aspect)) > math.log(_RESHAPED):
                self.look_from(client, placed.name)

        client.camera.on_update(reshaped)

    def _forget(self, client: viser.ClientHandle) -> None:
        self._placed.pop(client.client_id, None)

    def _was_turned(self, client: viser.ClientHandle, placed: _Placed) -> bool:
        """Whether somebody turned, shifted or zoomed the scene since the browser was moved to a viewpoint."""
        place, camera = placed.viewpoint, client.camera
        moved = max(
            np.linalg.norm(camera.position - place.position), float(np.linalg.norm(camera.look_at - place.look_at))
        )
        return bool(moved > _MOVED * np.linalg.norm(place.look_at - place.position))

    def _is_due(self, client: viser.ClientHandle, placed: _Placed) -> bool:
        """Whether a viewpoint of ours no longer shows what it should, or shows it much too small."""
        new, old = self._place(placed.name, placed.aspect), placed.viewpoint
        if placed.name == FROM_CAMERA:
            return not math.isclose(new.fov_rad, old.fov_rad, rel_tol=0.01)
        needed = self._docks if placed.name == CLOSE_UP and self._docks is not None else self._all
        far, near = (float(np.linalg.norm(place.position - place.look_at)) for place in (old, new))
        return far > _FARTHER * near or not shows(old, needed, client.camera.aspect)

    def _lost_dock(self, client: viser.ClientHandle) -> bool:
        camera = client.camera
        seen_from = Viewpoint(camera.position, camera.look_at, camera.fov)
        return self._docks is not None and not shows(seen_from, self._docks, camera.aspect)
