"""Viewpoints from which the camera and all docks are visible, and which of them each browser is at."""

import itertools
import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import viser
from dockpose import Camera
from numpy.typing import ArrayLike

OVERVIEW, FROM_CAMERA, FROM_ABOVE, FROM_SIDE, CLOSE_UP = "Fit", "Camera", "Above", "Side", "Dock close-up"
NAMES = (OVERVIEW, FROM_CAMERA, FROM_ABOVE, FROM_SIDE, CLOSE_UP)
# Directions from the scene's middle to the eye; the camera frame's y points down. From straight above there would be
# no up direction, so the eye is a little to the side.
_DIRECTIONS = {
    OVERVIEW: (0.8, -0.42, -0.6),
    FROM_SIDE: (1.0, -0.12, 0.0),
    FROM_ABOVE: (0.0, -1.0, -0.02),
    CLOSE_UP: (0.45, -0.35, -0.85),
}
_FOV_RAD = math.radians(50)
_ASPECT = 1.9  # width to height of the 3D view on a small laptop
_SIDEWAYS, _DOWN = 0.77, 0.85  # of half the view, for what is shown: labels need the rest
_LEAST_UP, _MOST_UP, _BUTTONS = 0.4, 0.8, 0.22  # and buttons, which take more of a low one
_MOVED = 0.01  # of the distance to what is looked at: less is rounding
_FARTHER = 1.6  # times the distance that would do: from there the scene is small
_RESHAPED = 1.05


@dataclass(frozen=True)
class Extent:
    """A box in metres: its lowest and its highest x, y, z."""

    low: np.ndarray
    high: np.ndarray

    @cached_property
    def depth_m(self) -> float:
        """How far it reaches from the camera."""
        return max(1e-3, float(self.high[2]))

    def corners(self) -> np.ndarray:
        """Its corners (8, 3)."""
        return np.array(list(itertools.product(*zip(self.low, self.high, strict=True))))


@dataclass(frozen=True)
class Viewpoint:
    """Where the eye is, what it looks at (metres) and its vertical field of view (radians), in a view of ``aspect``."""

    position: np.ndarray
    look_at: np.ndarray
    fov_rad: float
    aspect: float
    name: str = ""


def viewpoint(name: str, extent: Extent, camera: Camera, aspect: float | None) -> Viewpoint:
    """Return a viewpoint that shows the whole extent."""
    aspect = aspect or _ASPECT
    if name == FROM_CAMERA:
        wide, high = camera.field_of_view_rad
        fov = 2 * math.atan(max(math.tan(high / 2), math.tan(wide / 2) / aspect))
        return Viewpoint(np.zeros(3), np.array([0, 0, extent.depth_m]), fov, aspect, name)
    middle, direction = (extent.low + extent.high) / 2, _unit(_DIRECTIONS[name])
    look_at, distance = _nearest(extent.corners() - middle, direction, aspect)
    return Viewpoint(middle + look_at + distance * direction, middle + look_at, _FOV_RAD, aspect, name)


def shows(place: Viewpoint, extent: Extent) -> bool:
    """Whether the whole extent is in view."""
    towards, right, up = _parts(extent.corners() - place.position, _unit(place.look_at - place.position))
    half_up = math.tan(place.fov_rad / 2) * towards
    half_wide = half_up * place.aspect
    return bool((towards > 0).all() and (np.abs(right) <= half_wide).all() and (np.abs(up) <= half_up).all())


def _unit(vector: ArrayLike) -> np.ndarray:
    return np.asarray(vector) / np.linalg.norm(vector)


def _nearest(corners: np.ndarray, direction: np.ndarray, aspect: float) -> tuple[np.ndarray, float]:
    """Return what to look at (3,), and from how far at the least, to have every corner in the free part of the view."""
    away, right, up = _parts(corners, direction)
    half_up = math.tan(_FOV_RAD / 2)

    def along(values: np.ndarray, low: float, high: float) -> tuple[float, float]:
        below, above = float((away - values / low).max()), float((away + values / high).max())
        shift = (above - below) / (1 / low + 1 / high)
        return shift, above - shift / high

    across, least = along(right, *[_SIDEWAYS * half_up * aspect] * 2)
    share_up = min(max(1 - _BUTTONS * aspect, _LEAST_UP), _MOST_UP)
    upwards, least_up = along(up, _DOWN * half_up, share_up * half_up)
    to_right, to_up = _axes(direction)
    return across * to_right + upwards * to_up, max(least, least_up)


def _axes(direction: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The directions across one of length 1, and upwards."""
    right = _unit(np.cross(direction, [0, -1.0, 0]))
    return right, np.cross(right, direction)


def _parts(points: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Parts of points (N, 3) along a direction of length 1, across it and upwards."""
    right, up = _axes(direction)
    return points @ direction, points @ right, points @ up


class Viewpoints:
    """Moves browsers to viewpoints, and keeps in view what is drawn for those who have not turned the scene since."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._placed: dict[int, Viewpoint] = {}
        self._all, self._docks = Extent(np.zeros(3), np.ones(3)), None
        self._camera = Camera(1.0, 1.0, 0.0, 0.0, 1, 1)
        server.on_client_connect(self._welcome)
        server.on_client_disconnect(self._forget)

    def show(self, everything: Extent, docks: Extent | None, camera: Camera, *, is_other: bool) -> None:
        """Take note of what is drawn; ``is_other`` says that it is of another picture than before."""
        self._all, self._docks, self._camera = everything, docks, camera
        if is_other:
            place, initial = self._place(OVERVIEW, None), self._server.initial_camera
            initial.fov, initial.position, initial.look_at = place.fov_rad, place.position, place.look_at
        for client in self._server.get_clients().values():
            placed = self._placed.get(client.client_id)
            if placed is None or (self._was_turned(client, placed) and not (is_other and self._lost_dock(client))):
                continue
            if is_other or self._is_due(client, placed):
                self.look_from(client, OVERVIEW if self._was_turned(client, placed) else placed.name)

    def look_from(self, client: viser.ClientHandle, name: str) -> None:
        """Move one browser's viewpoint to one of ``viewpoints.NAMES``."""
        place = self._placed[client.client_id] = self._place(name, client.camera.aspect)
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

    def _was_turned(self, client: viser.ClientHandle, place: Viewpoint) -> bool:
        """Whether somebody turned, shifted or zoomed the scene since the browser was moved to a viewpoint."""
        camera = client.camera
        moved = camera.position - place.position, camera.look_at - place.look_at
        return bool(np.linalg.norm(moved, axis=1).max() > _MOVED * np.linalg.norm(place.look_at - place.position))

    def _is_due(self, client: viser.ClientHandle, old: Viewpoint) -> bool:
        """Whether a viewpoint of ours no longer shows what it should, or shows it much too small."""
        new = self._place(old.name, old.aspect)
        if old.name == FROM_CAMERA:
            return not math.isclose(new.fov_rad, old.fov_rad, rel_tol=0.01)
        needed = self._docks if old.name == CLOSE_UP and self._docks is not None else self._all
        far, near = (float(np.linalg.norm(place.position - place.look_at)) for place in (old, new))
        return far > _FARTHER * near or not shows(replace(old, aspect=client.camera.aspect), needed)

    def _lost_dock(self, client: viser.ClientHandle) -> bool:
        camera = client.camera
        seen_from = Viewpoint(camera.position, camera.look_at, camera.fov, camera.aspect)
        return self._docks is not None and not shows(seen_from, self._docks)
