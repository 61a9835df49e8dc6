"""Errors of a pose that all pictures share: what camera, diameter and the lights' places may be off, carried over."""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.sigma import errors_of, moved
from dockpose.camera.standard_errors import INTRINSICS
from dockpose.compiled import compiled
from dockpose.dock import Dock
from dockpose.lights.reprojection import LightRays, solve
from dockpose.pose.refine import on_planes

DIAMETER_SHARE = 0.003  # standard error where the dock file says nothing: a millimetre of 30 cm
_AROUND = 12  # points on the circle of a dock whose lights are not known
_STEP = 1e-4  # of the range, for derivatives
_STEPS = np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])[:, None]


def diameter_share(dock: Dock) -> float:
    """Standard error of a dock's diameter, as a share of it: the file's, or the usual one."""
    return DIAMETER_SHARE if dock.diameter_sigma_m is None else dock.diameter_sigma_m / dock.diameter


@dataclass(frozen=True)
class SharedErrors:
    """Where errors that do not average out come from."""

    camera: Camera
    dock: Dock
    position_m: np.ndarray  # (3,): of the dock
    rays: LightRays | None = None  # of the lights that were seen; None for all of the dock's

    def roots(self, rotation: np.ndarray, noise_px: float) -> dict[str, np.ndarray]:
        """Roots (6, K) of covariances, as :attr:`PoseErrors.covariance` is one, of camera, diameter, lights' places.

        To first order a wrong number moves the pose as it moves the lights' images: by least squares of their
        derivatives by the pose (Hartley and Zisserman 2004, section 5.2). The place of a light shows in the residuals;
        what ``noise_px`` holds of it already is not counted again.
        """
        lights_m = self._lights_m(rotation)
        points_m = self.position_m + lights_m @ rotation.T
        step_m = _STEP * math.hypot(*self.position_m.tolist())
        images = self.camera.project((points_m + step_m * _STEPS).reshape(-1, 3)).reshape(7, -1, 2)
        by_place = (images[1:4] - images[4:]) / (2 * step_m)
        by_place[np.isnan(by_place)] = 0.0  # the lens sees none there
        sigmas = diameter_share(self.dock), self.dock.lamp_depth_sigma_m, self.dock.lights_sigma_m or 0.0
        by_camera = self._by_camera(points_m, images[0])
        steps, own_px2 = _steps(by_place, by_camera, lights_m, rotation, sigmas, self.dock.lights is None)
        unseen = max(0.0, 1 - noise_px**2 / own_px2) if own_px2 > 0 else 0.0
        depth = 1 + by_camera.shape[2]
        steps[:, depth + 1 :] *= math.sqrt(unseen)
        return {"camera": steps[:, 1:depth], "diameter": steps[:, :1], "lights": steps[:, depth:]}

    def _lights_m(self, rotation: np.ndarray) -> np.ndarray:
        """Places (N, 3) of the lights in the dock's frame."""
        if self.rays is not None:
            depth_m = self.dock.lamp_depth_m
            (flat,) = on_planes(self.rays, rotation[None], (self.position_m + depth_m * rotation[:, 2])[None])
            places_m = np.full((len(flat), 3), depth_m)
            places_m[:, :2] = flat
            return places_m
        dock = self.dock if self.dock.lights is not None else self.dock.with_lights(_AROUND)
        return dock.light_points()

    def _by_camera(self, points_m: np.ndarray, images_px: np.ndarray) -> np.ndarray:
        """How far (N, 2, P) images of points (N, 3) are off by each independent error of the camera's numbers."""
        camera, (names, root, off) = self.camera, _off(self.camera)
        by_number = np.zeros((len(points_m), 2, len(names)))
        for column, name in enumerate(names):
            if name in ("fx", "fy"):
                axis = int(name == "fy")
                by_number[:, axis, column] = (images_px[:, axis] - (camera.cx, camera.cy)[axis]) / getattr(camera, name)
            elif name in ("cx", "cy"):
                by_number[:, int(name == "cy"), column] = 1.0
            elif name in off:
                more, less, apart = off[name]
                by_number[:, :, column] = (more.project(points_m) - less.project(points_m)) / apart
        by_number[np.isnan(by_number)] = 0.0
        return (by_number.reshape(-1, len(names)) @ root).reshape(by_number.shape)


@lru_cache(maxsize=16)
def _off(camera: Camera) -> tuple[list[str], np.ndarray, dict[str, tuple[Camera, Camera, float]]]:
    """Names (P,) of numbers that may be off, a root (P, P) of their covariance, and cameras by numbers to either side.

    These are of lens and port, and have beside them how far apart the number is.
    """
    names, errors = errors_of(camera)
    values, vectors = np.linalg.eigh(errors)
    off = {
        name: (moved(camera, name, sigma), moved(camera, name, -sigma), 2 * sigma)
        for name, sigma in zip(names, np.sqrt(np.diag(errors)).tolist(), strict=True)
        if sigma > 0 and name not in INTRINSICS
    }
    return names, vectors * np.sqrt(np.maximum(values, 0.0)), off


@compiled
def _steps(
    by_place: np.ndarray,
    by_camera: np.ndarray,
    lights_m: np.ndarray,
    rotation: np.ndarray,
    sigmas: tuple[float, float, float],
    is_anywhere: bool,
) -> tuple[np.ndarray, float]:
    """Steps of the pose (6, 2 + P + 3 N) by diameter, camera, depth and each light's place, and the last's px^2.

    They follow from how images move by a light's place (3, N, 2) and by the camera's errors (N, 2, P), by normal
    equations. Of lights that may be anywhere on the circle only what goes across it shows in residuals.
    """
    count, own = len(lights_m), 2 + by_camera.shape[2]
    square, steps, own_px2 = np.zeros((6, 6)), np.zeros((6, own + 3 * count)), 0.0
    pose, other = np.empty((2, 6)), np.empty((2, own + 3))
    for n in range(count):
        x, y, z = lights_m[n, 0], lights_m[n, 1], lights_m[n, 2]
        for axis in range(2):
            a, b, c = 0.0, 0.0, 0.0  # along the dock's own axes
            for k in range(3):
                slope = pose[axis, k] = by_place[k, n, axis]
                a, b, c = a + slope * rotation[k, 0], b + slope * rotation[k, 1], c + slope * rotation[k, 2]
                other[axis, own + k] = sigmas[2] * slope
            pose[axis, 3], pose[axis, 4], pose[axis, 5] = y * c - z * b, z * a - x * c, x * b - y * a
            other[axis, 0], other[axis, own - 1] = sigmas[0] * (a * x + b * y), sigmas[1] * c
            other[axis, 1 : own - 1] = by_camera[n, axis]
        if is_anywhere:
            u, v = pose[0, 5], pose[1, 5]  # along the circle
            long = max(np.sqrt(u * u + v * v), 1e-12)
            for shifts in (pose, other):
                for k in range(shifts.shape[1]):
                    across = (shifts[0, k] * v - shifts[1, k] * u) / long
                    shifts[0, k], shifts[1, k] = across * v / long, -across * u / long
            pose[:, 5] = 0.0  # the roll is left open
        own_px2 += np.square(other[:, own:]).sum() / (2 * count)
        for i in range(6):
            for k in range(6):
                square[i, k] += pose[0, i] * pose[0, k] + pose[1, i] * pose[1, k]
            for k in range(own + 3):
                steps[i, k if k < own else k + 3 * n] += pose[0, i] * other[0, k] + pose[1, i] * other[1, k]
    scale = 1 / np.sqrt(np.maximum(np.diag(square), 1e-300))  # so that metres and radians are alike
    square *= scale * scale.reshape(-1, 1)
    steps *= scale.reshape(-1, 1)
    solve(square, steps)
    return steps * scale.reshape(-1, 1), own_px2
