"""What a camera and a dock allow: standard errors and the chance to tell both poses apart, by range and tilt."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from statistics import NormalDist
from typing import cast

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import check_number
from dockpose.dock import Dock
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.refine import light_rays, refine
from dockpose.pose.shared import SharedErrors
from dockpose.pose.solve import find_poses
from dockpose.pose.uncertainty import deviations

USUAL_NOISE_PX = 0.3  # of a light's centre along each axis; 0.1 for bright, sharp lights, 1 in turbid water
# Two neighbouring lights are one group where less than this lies between their centres: each is about three pixels
# wide, and a darker pixel must lie between them.
LEAST_APART_PX = 4.0
FEWEST_LIGHTS = 4  # three leave no residual: which of their up to four poses is right, a prior decides
_LARGEST_SHARE = 0.9  # of the picture's smaller side that a ring seen square on fills at the nearest range
_MOST_TILTED_DEG = 85.0
_IN_DEG = np.array([1.0, 1.0, 1.0, math.degrees(1), math.degrees(1)])
_SAME_RAD = math.radians(0.2)  # poses nearer to each other are the same


@dataclass(frozen=True)
class Budget:
    """Errors to expect of a dock straight ahead at one range and tilt."""

    range_m: float  # distance of the dock's centre
    tilt_deg: float  # angle between its normal and the line of sight (a yaw)
    apart_px: float  # least distance between the images of two neighbouring lights
    in_view: bool  # whether all lights are in the picture
    sigmas: np.ndarray  # (5,): standard errors of x, y, z in metres, theta_x, theta_y in degrees, of the right pose
    tells_apart: float | None  # chance that the likelier of both poses is right; None where they are the same
    totals: np.ndarray  # (5,): with what camera, diameter and lights' places may be off

    @property
    def lights_apart(self) -> bool:
        """Whether all lights can be seen one by one."""
        return self.apart_px >= LEAST_APART_PX


def budget(camera: Camera, dock: Dock, range_m: float, tilt_deg: float, noise_px: float = USUAL_NOISE_PX) -> Budget:
    """Errors to expect, by the covariance of the refined pose; docs/method.md has the bounds far away and the odds."""
    _check(dock, range_m, tilt_deg, noise_px)
    lights_px, rotation, position = _seen(camera, dock, range_m, tilt_deg)
    sigmas = _linear(camera, dock, lights_px, rotation, position, noise_px)
    radius_px = math.sqrt(math.prod(_focal_px(camera))) * dock.radius / range_m
    # Standard error of the ratio of the ellipse's axes, of a dock square on.
    ratio = 2 * noise_px / (radius_px * math.sqrt(dock.lights or 1))
    alike_deg = math.degrees(math.sqrt(2 * ratio))
    if tilt_deg < alike_deg < _MOST_TILTED_DEG:
        tilted = _linear(camera, dock, *_seen(camera, dock, range_m, alike_deg), noise_px)
        sigmas = np.concatenate([np.maximum(sigmas, tilted)[:3], np.minimum(sigmas[3:], math.sqrt(ratio))])
    roots = SharedErrors(camera, dock, position).roots(rotation, noise_px).values()
    shared = np.concatenate(deviations(np.sum([root @ root.T for root in roots], axis=0), rotation, 1.0))
    tells = _tells_apart(camera, dock, tilt_deg, lights_px, noise_px)
    totals = _IN_DEG * np.hypot(sigmas, shared)
    return Budget(range_m, tilt_deg, *_view(camera, lights_px), _IN_DEG * sigmas, tells, totals)


def nearest_m(camera: Camera, dock: Dock) -> float:
    """Range, in metres, at which a dock square on fills most of the picture."""
    fx, fy = _focal_px(camera)
    return max(fx / camera.width, fy / camera.height) * dock.diameter / _LARGEST_SHARE


def farthest_apart_m(camera: Camera, dock: Dock) -> float:
    """Range, in metres, up to which the lights of a dock square on are seen one by one."""
    return min(_focal_px(camera)) * _apart(dock.light_points()) / LEAST_APART_PX


def farthest_m(
    camera: Camera, dock: Dock, tilt_deg: float, noise_px: float, excess: Callable[[Budget], float]
) -> float:
    """Range, in metres, where a number of the budget becomes positive, up to where lights can be seen one by one."""
    from scipy.optimize import brentq  # takes half a second to import

    def rises(log_range: float) -> float:
        return excess(budget(camera, dock, math.exp(log_range), tilt_deg, noise_px))

    low, high = math.log(nearest_m(camera, dock)), math.log(farthest_apart_m(camera, dock))
    if low >= high or rises(low) > 0:
        return 0.0
    if rises(high) <= 0:
        return math.exp(high)
    return math.exp(cast("float", brentq(rises, low, high, xtol=1e-4)))


def _check(dock: Dock, range_m: float, tilt_deg: float, noise_px: float) -> None:
    if dock.lights is None or dock.lights < FEWEST_LIGHTS:
        count = "an unknown number of" if dock.lights is None else dock.lights
        raise ValueError(f"the dock has {count} lights; an error budget needs at least {FEWEST_LIGHTS}")
    check_number("range_m", range_m, above=0)
    check_number("noise_px", noise_px, above=0)
    check_number("tilt_deg", tilt_deg)
    if not 0 <= tilt_deg <= _MOST_TILTED_DEG:
        raise ValueError(f"tilt_deg is {tilt_deg!r}; it must be within 0 to {_MOST_TILTED_DEG:g}")


def _seen(camera: Camera, dock: Dock, range_m: float, tilt_deg: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The lights' images, and the dock's rotation and position."""
    rotation = rotation_from_angles(0.0, math.radians(tilt_deg))
    position = np.array([0.0, 0.0, range_m])
    return camera.project(position + dock.light_points() @ rotation.T), rotation, position


def _linear(
    camera: Camera, dock: Dock, lights_px: np.ndarray, rotation: np.ndarray, position_m: np.ndarray, noise_px: float
) -> np.ndarray:
    """Standard errors (5,) of position and angles by the covariance at a pose."""
    rays = light_rays(lights_px, camera, float(position_m[2]))
    fit = refine(rotation[None], position_m[None], dock.light_angles_rad()[None], dock.radius, rays)
    return np.concatenate(deviations(fit.covariances[0], rotation, noise_px))


def _focal_px(camera: Camera) -> tuple[float, float]:
    """Focal lengths near the axis; behind a flat port, water magnifies by its refractive index."""
    index = 1.0 if camera.port is None else camera.port.water_index
    return index * camera.fx, index * camera.fy


def _tells_apart(camera: Camera, dock: Dock, tilt_deg: float, lights_px: np.ndarray, noise_px: float) -> float | None:
    if math.radians(tilt_deg) < _SAME_RAD:
        return None
    _, choice = find_poses(lights_px, camera, dock)
    others = [pose.rms_px or 0.0 for index, pose in enumerate(choice.candidates) if index != choice.selected]
    return NormalDist().cdf(min(others) * math.sqrt(len(lights_px)) / (2 * noise_px)) if others else 1.0


def _apart(points: np.ndarray) -> float:
    """Least distance between two of the points (N, 2) or (N, 3)."""
    off = points[:, None] - points
    return float(np.sqrt((off**2).sum(axis=2) + 1e18 * np.eye(len(off))).min())


def _view(camera: Camera, lights_px: np.ndarray) -> tuple[float, bool]:
    """Least distance between the images of two lights, and whether all are in the picture."""
    inside = (lights_px >= 0) & (lights_px <= [camera.width - 1, camera.height - 1])
    return _apart(lights_px), bool(inside.all())
