"""Viewpoints from which the camera and all docks are visible."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from dockpose import Camera

OVERVIEW, FROM_CAMERA, FROM_ABOVE, FROM_SIDE, CLOSE_UP = "Fit", "Camera", "Above", "Side", "Dock close-up"
NAMES = (OVERVIEW, FROM_CAMERA, FROM_ABOVE, FROM_SIDE, CLOSE_UP)
# Directions from the scene's middle to the eye; the camera frame's y points down. From straight above there would be
# no up direction, so the eye is a little to the side.
_DIRECTIONS = {
    OVERVIEW: (0.62, -0.55, -0.75),
    FROM_SIDE: (1.0, -0.12, 0.0),
    FROM_ABOVE: (0.0, -1.0, -0.02),
    CLOSE_UP: (0.45, -0.35, -0.85),
}
_FOV_RAD = math.radians(50)
_ASPECT = 0.6  # width to height of the space between the panels on a small laptop
_MARGIN = 1.25  # for the labels at its edges


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
        sides = np.array([self.low, self.high])
        return np.array([[sides[i, 0], sides[j, 1], sides[k, 2]] for i in (0, 1) for j in (0, 1) for k in (0, 1)])


@dataclass(frozen=True)
class Viewpoint:
    """Where the eye is, what it looks at (metres) and its vertical field of view (radians)."""

    position: np.ndarray
    look_at: np.ndarray
    fov_rad: float


def viewpoint(name: str, extent: Extent, camera: Camera, aspect: float | None) -> Viewpoint:
    """Return a viewpoint that shows the whole extent."""
    aspect = aspect or _ASPECT
    if name == FROM_CAMERA:
        wide, high = camera.field_of_view_rad
        fov = 2 * math.atan(max(math.tan(high / 2), math.tan(wide / 2) / aspect))
        return Viewpoint(np.zeros(3), np.array([0, 0, extent.depth_m]), fov)
    middle = (extent.low + extent.high) / 2
    direction = np.array(_DIRECTIONS[name])
    direction = direction / np.linalg.norm(direction)
    return Viewpoint(middle + _distance(extent.corners() - middle, direction, aspect) * direction, middle, _FOV_RAD)


def shows(place: Viewpoint, extent: Extent, aspect: float) -> bool:
    """Whether the whole extent is in view."""
    ahead = place.look_at - place.position
    ahead = ahead / np.linalg.norm(ahead)
    towards, right, up = _parts(extent.corners() - place.position, ahead)
    half_up = math.tan(place.fov_rad / 2) * towards
    return bool((towards > 0).all() and (np.abs(right) <= half_up * aspect).all() and (np.abs(up) <= half_up).all())


def _distance(corners: np.ndarray, direction: np.ndarray, aspect: float) -> float:
    """Distance of the eye at which every corner is inside its field of view."""
    away, right, up = _parts(corners, direction)
    half_up = math.tan(_FOV_RAD / 2)
    needed = np.maximum(np.abs(right) / (half_up * aspect), np.abs(up) / half_up)
    return _MARGIN * float((needed + away).max())


def _parts(points: np.ndarray, direction: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Parts of points (N, 3) along a direction of length 1, across it and upwards."""
    right = np.cross(direction, [0, -1.0, 0])
    right = right / np.linalg.norm(right)
    return points @ direction, points @ right, points @ np.cross(right, direction)
