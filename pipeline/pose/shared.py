"""What all pictures share: errors of the camera, the diameter and the lights' places, carried over to a pose."""

from dataclasses import dataclass

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.sigma import errors_of, moved
from dockpose.dock import Dock
from dockpose.lights.reprojection import LightRays
from dockpose.pose.refine import on_planes

DIAMETER_SHARE = 0.003  # standard error where the dock file says nothing: a millimetre of 30 cm
_AROUND = 12  # points on the circle of a dock whose lights are not known
_STEP = 1e-4  # of the range, for derivatives
PARTS = ("picture", "camera", "diameter", "lights")


@dataclass(frozen=True)
class SharedErrors:
    """Where errors that do not average out come from."""

    camera: Camera
    dock: Dock
    position_m: np.ndarray  # (3,): of the dock
    rays: LightRays | None = None  # of the lights that were seen; None for all of the dock's

    def parts(self, rotation: np.ndarray, noise_px: float) -> dict[str, np.ndarray]:
        """Covariances (6, 6), as :attr:`PoseErrors.covariance` has them, from camera, diameter and lights' places.

        To first order a wrong number moves the pose as it moves the lights' images: by the pseudoinverse of their
        derivatives by the pose (Hartley and Zisserman 2004, section 5.2). The place of a light shows in the residuals;
        what ``noise_px`` holds of it already is not counted again.
        """
        lights_m = self._lights_m(rotation)
        points_m = self.position_m + lights_m @ rotation.T
        A = self._slopes(points_m)
        by_pose = self._seen(np.concatenate([A, -A @ rotation @ _cross(lights_m)], axis=2), A, lights_m, rotation)
        carry = np.linalg.pinv(by_pose.reshape(-1, 6))

        names, errors = errors_of(self.camera)
        steps = np.sqrt(np.diag(errors))
        shifts = np.zeros((len(lights_m), 2, len(names)))
        for column, (name, step) in enumerate(zip(names, steps.tolist(), strict=True)):
            if step > 0:
                more, less = (moved(self.camera, name, sign * step).project(points_m) for sign in (1, -1))
                shifts[:, :, column] = np.nan_to_num(more - less) / (2 * step)
        by_camera = carry @ self._seen(shifts, A, lights_m, rotation).reshape(-1, len(names))

        sigma_m = self.dock.diameter_sigma_m
        share = DIAMETER_SHARE if sigma_m is None else sigma_m / self.dock.diameter
        larger = (A @ (lights_m @ rotation.T)[:, :, None]) * share
        by_diameter = carry @ self._seen(larger, A, lights_m, rotation).reshape(-1, 1)

        place_m = self.dock.lights_sigma_m or 0.0
        own = place_m * self._seen(A, A, lights_m, rotation)
        own_px2 = float((own**2).sum()) / (2 * len(own))
        unseen = max(0.0, 1 - noise_px**2 / own_px2) if own_px2 > 0 else 0.0
        by_lights = carry.reshape(6, -1, 2).transpose(1, 0, 2) @ own
        return {
            "camera": by_camera @ errors @ by_camera.T,
            "diameter": by_diameter @ by_diameter.T,
            "lights": unseen * np.einsum("nij,nkj->ik", by_lights, by_lights),
        }

    def _lights_m(self, rotation: np.ndarray) -> np.ndarray:
        """Places (N, 3) of the lights in the dock's frame."""
        if self.rays is not None:
            (flat,) = on_planes(self.rays, rotation[None], self.position_m[None])
            return np.column_stack([flat, np.zeros(len(flat))])
        dock = self.dock if self.dock.lights is not None else Dock(self.dock.diameter, _AROUND)
        return dock.light_points()

    def _slopes(self, points_m: np.ndarray) -> np.ndarray:
        """Derivatives (N, 2, 3) of the lights' images by their places; 0 where the lens sees none."""
        step_m = _STEP * float(np.linalg.norm(self.position_m))
        steps = step_m * np.concatenate([np.eye(3), -np.eye(3)])
        seen = self.camera.project((points_m + steps[:, None]).reshape(-1, 3)).reshape(6, -1, 2)
        return np.nan_to_num((seen[:3] - seen[3:]) / (2 * step_m)).transpose(1, 2, 0)

    def _seen(self, shifts: np.ndarray, A: np.ndarray, lights_m: np.ndarray, rotation: np.ndarray) -> np.ndarray:
        """Of shifts (N, 2, K) of the images what residuals show: where lights may be anywhere, that across the ring."""
        if self.dock.lights is not None:
            return shifts
        along_m = np.cross([0.0, 0.0, 1.0], lights_m) @ rotation.T
        along = (A @ along_m[:, :, None])[:, :, 0]
        across = along[:, ::-1] * [1, -1] / np.maximum(np.linalg.norm(along, axis=1), 1e-12)[:, None]
        return across[:, :, None] * (across[:, None] @ shifts)


def _cross(vectors: np.ndarray) -> np.ndarray:
    """Matrices (N, 3, 3) that take the cross product of vectors (N, 3) with another."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)
