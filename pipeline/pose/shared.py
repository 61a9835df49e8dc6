"""What all pictures share: errors of the camera, the diameter and the lights' places, carried over to a pose."""

import math
from dataclasses import dataclass

import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.sigma import errors_of, moved
from dockpose.dock import Dock
from dockpose.lights.reprojection import LightRays
from dockpose.pose.refine import on_planes

DIAMETER_SHARE = 0.003  # standard error where the dock file says nothing: a millimetre of 30 cm
_AROUND = 12  # points on the circle of a dock whose lights are not known
_STEP = 1e-4  # of the range, for derivatives
_OPEN = 1e-9  # singular value, over the largest, of what the lights leave open, as the roll where they may be anywhere
PARTS = ("picture", "camera", "diameter", "lights")


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

        To first order a wrong number moves the pose as it moves the lights' images: by the pseudoinverse of their
        derivatives by the pose (Hartley and Zisserman 2004, section 5.2). The place of a light shows in the residuals;
        what ``noise_px`` holds of it already is not counted again.
        """
        lights_m = self._lights_m(rotation)
        names, errors = errors_of(self.camera)
        A, by_number = self._slopes(self.position_m + lights_m @ rotation.T, names, np.sqrt(np.diag(errors)))
        outwards_m = lights_m * [1, 1, 0]
        larger = diameter_share(self.dock) * (A @ (outwards_m @ rotation.T)[:, :, None])
        deeper = self.dock.lamp_depth_sigma_m * A @ rotation[:, 2:]
        shifts = np.concatenate([A, -A @ rotation @ cross(lights_m), by_number, larger, deeper, A], axis=2)
        if self.dock.lights is None:
            shifts = _across(shifts, A, lights_m, rotation)
        ends = np.cumsum([6, len(names), 1, 1])
        by_pose, by_number, larger, deeper, own = np.split(shifts, ends, axis=2)
        carry = np.linalg.pinv(by_pose.reshape(-1, 6), rcond=_OPEN)
        by_camera = carry @ by_number.reshape(-1, len(names))
        by_diameter, by_depth = carry @ larger.reshape(-1, 1), carry @ deeper.reshape(-1, 1)
        own = (self.dock.lights_sigma_m or 0.0) * own
        own_px2 = float((own**2).sum()) / (2 * len(own))
        unseen = max(0.0, 1 - noise_px**2 / own_px2) if own_px2 > 0 else 0.0
        by_lights = carry.reshape(6, -1, 2).transpose(1, 0, 2) @ own
        values, vectors = np.linalg.eigh(errors)
        return {
            "camera": by_camera @ vectors * np.sqrt(np.maximum(values, 0.0)),
            "diameter": by_diameter,
            "lights": np.hstack([by_depth, math.sqrt(unseen) * by_lights.transpose(1, 0, 2).reshape(6, -1)]),
        }

    def _lights_m(self, rotation: np.ndarray) -> np.ndarray:
        """Places (N, 3) of the lights in the dock's frame."""
        if self.rays is not None:
            depth_m = self.dock.lamp_depth_m
            (flat,) = on_planes(self.rays, rotation[None], (self.position_m + depth_m * rotation[:, 2])[None])
            return np.column_stack([flat, np.full(len(flat), depth_m)])
        dock = self.dock if self.dock.lights is not None else msgspec.structs.replace(self.dock, lights=_AROUND)
        return dock.light_points()

    def _slopes(self, points_m: np.ndarray, names: list[str], sigmas: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Derivatives of the images of points (N, 3) by their places (N, 2, 3) and by the camera's numbers (N, 2, P).

        Those by places, and by numbers of lens and port, are differences of small steps; 0 where the lens sees none.
        """
        camera, by_number = self.camera, np.zeros((len(points_m), 2, len(names)))
        step_m = _STEP * float(np.linalg.norm(self.position_m))
        steps = step_m * np.concatenate([np.zeros((1, 3)), np.eye(3), -np.eye(3)])
        images = camera.project((points_m + steps[:, None]).reshape(-1, 3)).reshape(7, -1, 2)
        for column, (name, sigma) in enumerate(zip(names, sigmas.tolist(), strict=True)):
            if name in ("fx", "fy"):
                axis = int(name == "fy")
                by_number[:, axis, column] = (images[0, :, axis] - (camera.cx, camera.cy)[axis]) / getattr(camera, name)
            elif name in ("cx", "cy"):
                by_number[:, int(name == "cy"), column] = 1.0
            elif sigma > 0:
                more, less = (moved(camera, name, sign * sigma).project(points_m) for sign in (1, -1))
                by_number[:, :, column] = (more - less) / (2 * sigma)
        by_place = ((images[1:4] - images[4:]) / (2 * step_m)).transpose(1, 2, 0)
        return np.nan_to_num(by_place), np.nan_to_num(by_number)


def _across(shifts: np.ndarray, A: np.ndarray, lights_m: np.ndarray, rotation: np.ndarray) -> np.ndarray:
    """Of shifts (N, 2, K) of the images that across the ring, all that residuals of lights anywhere on it show."""
    along_m = np.cross([0.0, 0.0, 1.0], lights_m) @ rotation.T
    along = (A @ along_m[:, :, None])[:, :, 0]
    across = along[:, ::-1] * [1, -1] / np.maximum(np.linalg.norm(along, axis=1), 1e-12)[:, None]
    return across[:, :, None] * (across[:, None] @ shifts)


def cross(vectors: np.ndarray) -> np.ndarray:
    """Matrices (N, 3, 3) that take the cross product of vectors (N, 3) with another."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)
