"""Pose from lights whose numbers are known: EPnP and its peers, from OpenCV, for comparison."""

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points
from dockpose.dock import Dock
from dockpose.pose.circle import CirclePose
from dockpose.pose.refine import light_rays

# Lepetit et al. 2009; Collins and Bartoli 2014; Terzakis and Lourakis 2020; Levenberg-Marquardt on a homography.
NAMES = {"epnp": "EPnP", "ippe": "IPPE", "sqpnp": "SQPnP", "iterative": "Iterative PnP"}
METHODS: dict[str, int] = {method: getattr(cv2, f"SOLVEPNP_{method.upper()}") for method in NAMES}
FEWEST = 4  # three points leave up to four poses


class NoPoseError(ValueError):
    """The lights do not determine a pose; the text says why."""


def solve(points_px: Any, lights: Sequence[int] | np.ndarray, camera: Camera, dock: Dock, method: str) -> CirclePose:
    """Find the pose of a dock from lights whose numbers are known, as OpenCV's ``solvePnP`` does."""
    if method not in METHODS:
        raise ValueError(f"method is {method!r}; it must be one of {', '.join(METHODS)}")
    points = as_points("points_px", points_px, 2)
    if len(set(np.asarray(lights).tolist())) != len(points) or len(points) < FEWEST:
        raise NoPoseError(f"{len(points)} points and lights {list(lights)}; needed are {FEWEST}, all different")
    if not np.isfinite(points).all() or len(set(map(tuple, points.tolist()))) < len(points):
        raise NoPoseError("a point is not finite, or two are the same")
    model = dock.light_points()[np.asarray(lights)]
    tangents = light_rays(points, camera).tangents
    answers = _answers(model, tangents, METHODS[method])
    if not answers:
        raise NoPoseError(f"{method} finds no pose in front of the camera")
    error, R, t = min(answers, key=lambda answer: answer[0])
    return CirclePose.at(t, -R[:, 2], camera, rms_px=error * float(np.sqrt(camera.fx * camera.fy)))


def _answers(model: np.ndarray, tangents: np.ndarray, flag: int) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Root mean square error in tangents, rotation and position of each answer in front of the camera."""
    try:
        _, turns, shifts, _ = cv2.solvePnPGeneric(model, tangents, np.eye(3), None, flags=flag)
    except cv2.error:
        return []
    found = []
    for turn, shift in zip(turns, shifts, strict=True):
        R, t = cv2.Rodrigues(turn)[0], shift.ravel()
        seen = model @ R.T + t
        if np.isfinite(seen).all() and (seen[:, 2] > 0).all() and R[:, 2] @ t > 0:
            error = float(np.sqrt(((seen[:, :2] / seen[:, 2:] - tangents) ** 2).sum(axis=1).mean()))
            found.append((error, R, t))
    return found
