"""Views of a dock: the lights that were seen, their numbers, and how they depend on pose and places."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.pose.circle import CirclePose
from dockpose.pose.refine import Fit, LightRays, angles_on_planes, light_rays, refine
from dockpose.pose.spacing import Placement, place, refine_with_offsets

FEWEST_LIGHTS = 5  # in a view; fewer leave too little beside its pose


@dataclass(frozen=True)
class DockView:
    """A view of the dock, with its lights found."""

    name: str  # of the picture
    points_px: np.ndarray  # (N, 2): centres of the lights
    poses: tuple[CirclePose, ...]  # the candidates
    # whether it was taken so soon after the view before it that the dock has hardly rolled between them
    follows: bool = False


@dataclass(frozen=True)
class Placed:
    """A view with one pose, and its lights numbered."""

    rays: LightRays  # rays of its lights
    rotation: np.ndarray  # (3, 3): from the dock's frame, roll included, to the camera's
    position_m: np.ndarray  # (3,): the dock's centre
    lights: np.ndarray  # (N,): number of each light
    points_px: np.ndarray  # (N, 2): the lights in the picture
    follows: bool  # as in :class:`DockView`

    def turned(self, turns: int, count: int) -> Placed:
        """The same view with its lights numbered from another one on."""
        angle = -turns * 2 * math.pi / count
        return replace(self, rotation=self.rotation @ about_z(angle), lights=(self.lights + turns) % count)


def place_view(view: DockView, camera: Camera, dock: Dock) -> Placed | None:
    """The view with the better of its poses refined, lights numbered from any; None where they do not fit the dock."""
    fitted = _fitted(view, camera, dock)
    if fitted is None:
        return None
    rays, placement, fit = fitted
    squares = np.where(placement.fits, fit.squares_px2, np.inf)
    if dock.offsets_m:
        fit, placement = refine_with_offsets(fit.rotations, fit.positions_m, placement, dock, rays)
        squares = np.where(placement.fits, fit.squares_px2, np.inf)
    best = int(np.argmin(squares))
    rotation = fit.rotations[best] @ about_z(float(placement.rolls_rad[best]))
    return Placed(rays, rotation, fit.positions_m[best], placement.lights[best], view.points_px, view.follows)


def tells_roll(view: DockView, camera: Camera, dock: Dock) -> bool:
    """Whether the offsets of the dock's lights tell its roll over the whole turn in a view."""
    fitted = _fitted(view, camera, dock)
    if fitted is None:
        return False
    rays, placement, fit = fitted
    _, known = refine_with_offsets(fit.rotations, fit.positions_m, placement, dock, rays)
    return known.period_rad > placement.period_rad


def _fitted(view: DockView, camera: Camera, dock: Dock) -> tuple[LightRays, Placement, Fit] | None:
    """Both poses of a view refined to the dock's lights, without their offsets; None where these do not fit."""
    if len(view.points_px) < FEWEST_LIGHTS:
        return None
    rays = light_rays(view.points_px, camera, float(view.poses[0].position_m[2]))
    R, t = np.array([pose.rotation for pose in view.poses]), np.array([pose.position_m for pose in view.poses])
    placement = place(angles_on_planes(rays, R, t), dock)
    return (rays, placement, refine(R, t, placement.angles_rad, dock.radius, rays)) if any(placement.fits) else None


def about_z(angle: float) -> np.ndarray:
    """Rotation (3, 3) by an angle in radians about the third axis."""
    return cv2.Rodrigues(np.array([0.0, 0.0, angle]))[0]


def residuals_px(rays: LightRays, rotation: np.ndarray, position_m: np.ndarray, points_m: np.ndarray) -> np.ndarray:
    """Pixels (2 N,) between lights seen and lights at points (N, 3) of the dock."""
    seen = points_m @ rotation.T + position_m
    off = seen[:, :2] / seen[:, 2:] - rays.tangents * (1 - rays.starts_m / seen[:, 2])[:, None]
    return np.einsum("nij,nj->ni", np.broadcast_to(rays.slopes_px, (len(off), 2, 2)), off).ravel()


def derivatives(each: Placed, points_m: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Residuals (2 N,), and their derivatives by the pose (2 N, 6) and by each light's own place (N, 2, 3)."""
    seen = points_m @ each.rotation.T + each.position_m
    z = seen[:, 2]
    by_seen = np.zeros((len(seen), 2, 3))
    by_seen[:, 0, 0] = by_seen[:, 1, 1] = 1 / z
    by_seen[:, :, 2] = -seen[:, :2] / z[:, None] ** 2 - each.rays.tangents * (each.rays.starts_m / z**2)[:, None]
    by_seen = np.broadcast_to(each.rays.slopes_px, (len(seen), 2, 2)) @ by_seen
    by_point = by_seen @ each.rotation
    x, y, h = points_m.T
    zero = np.zeros_like(x)
    # A turn w about the dock's axes moves a point p by w x p.
    cross = np.array([[zero, h, -y], [-h, zero, x], [y, -x, zero]]).transpose(2, 0, 1)
    by_pose = np.concatenate([by_seen, by_point @ cross], axis=2).reshape(-1, 6)
    return residuals_px(each.rays, each.rotation, each.position_m, points_m), by_pose, by_point


def is_same(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether two rotations differ by less than a few degrees."""
    return float(np.trace(one.T @ other)) > 3 - 0.01
