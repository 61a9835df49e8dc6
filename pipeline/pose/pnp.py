"""Pose from lights that are known one by one: EPnP and its peers, from OpenCV, to compare with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points
from dockpose.dock import Dock
from dockpose.lights.ellipse import NoEllipseError
from dockpose.pose.circle import CirclePose
from dockpose.pose.refine import light_rays
from dockpose.pose.solve import find_poses

# Lepetit et al. 2009; Collins and Bartoli 2014; Terzakis and Lourakis 2020; Levenberg-Marquardt on a homography.
METHODS = {
    "epnp": cv2.SOLVEPNP_EPNP,
    "ippe": cv2.SOLVEPNP_IPPE,
    "sqpnp": cv2.SOLVEPNP_SQPNP,
    "iterative": cv2.SOLVEPNP_ITERATIVE,
}
FEWEST = 4
# Turns of the model about its x and y axes: the same dock, in frames of which OpenCV's EPnP can stumble over one.
_FRAMES = (np.eye(3), np.diag([1.0, -1.0, -1.0]), np.diag([-1.0, 1.0, -1.0]))


class NoPoseError(ValueError):
    """The lights determine no pose; the text says why."""


def coded_dock(diameter: float) -> Dock:
    """The colour-coded dock of the paper's Table 4: 12 white lights but for red and blue ones in quadrature.

    At the quarter turns: lights 0 and 3 are red, 6 and 9 blue. Turned by a quarter, a half or three quarters it looks
    different each time, even with one of the four hidden.
    """
    colours = ["white"] * 12
    colours[0] = colours[3] = "red"
    colours[6] = colours[9] = "blue"
    return Dock(diameter, colours=tuple(colours))


def light_order(points_px: Any, labels: Sequence[str | None], camera: Camera, dock: Dock) -> np.ndarray:
    """Which light (N,) of a colour-coded dock each of five or more points (N, 2) of the picture is.

    Raises
    ------
    NoPoseError
        if no ellipse runs through the points, or the colours that could be told do not say it.
    """
    try:
        _, choice = find_poses(points_px, camera, dock, labels)
    except NoEllipseError as error:
        raise NoPoseError(str(error)) from error
    if choice.lights is None or choice.selected_by != "colours":
        raise NoPoseError("the colours of the lights do not tell which is which")
    return choice.lights


def solve(points_px: Any, lights: Sequence[int] | np.ndarray, camera: Camera, dock: Dock, method: str) -> CirclePose:
    """Find the pose of a dock whose lights are known one by one.

    Parameters
    ----------
    points_px : (N, 2) centres of the lights in the picture, N at least 4.
    lights : (N,) number of the light that each point is.
    camera : that took it; behind a port the rays are taken to meet in one point, as these methods must.
    dock : where its lights are.
    method : one of ``METHODS``.

    Raises
    ------
    ValueError
        if the method is unknown.
    NoPoseError
        if there are fewer than four different lights, a point is not finite, or the method finds nothing.

    Notes
    -----
    OpenCV's EPnP is degenerate on a complete, evenly spaced planar ring in one handedness of the model's frame; so
    every method is asked in three frames, and of all answers the one with the smallest reprojection error is taken.
    """
    if method not in METHODS:
        raise ValueError(f"method is {method!r}; it must be one of {', '.join(METHODS)}")
    points = as_points("points_px", points_px, 2)
    if len(set(np.asarray(lights).tolist())) != len(points) or len(points) < FEWEST:
        raise NoPoseError(f"{len(points)} points and lights {list(lights)}; needed are {FEWEST}, all different")
    if not np.isfinite(points).all() or len(set(map(tuple, points.tolist()))) < len(points):
        raise NoPoseError("a point is not finite, or two are the same")
    model = dock.light_points()[np.asarray(lights)]
    tangents = light_rays(points, camera).tangents
    answers = [answer for frame in _FRAMES for answer in _answers(model, frame, tangents, METHODS[method])]
    if not answers:
        raise NoPoseError(f"{method} finds no pose in front of the camera")
    error, R, t = min(answers, key=lambda answer: answer[0])
    focal = np.array([camera.fx, camera.fy])
    x, y = t[:2] / t[2] * focal + [camera.cx, camera.cy]
    return CirclePose(t, -R[:, 2], np.array([x, y]), rms_px=error * float(np.sqrt(focal.prod())))


def _answers(
    model: np.ndarray, frame: np.ndarray, tangents: np.ndarray, flag: int
) -> list[tuple[float, np.ndarray, np.ndarray]]:
    """Root mean square error in tangents, rotation and position of each answer in front of the camera."""
    try:
        _, turns, shifts, _ = cv2.solvePnPGeneric(model @ frame.T, tangents, np.eye(3), None, flags=flag)
    except cv2.error:
        return []
    found = []
    for turn, shift in zip(turns, shifts, strict=True):
        R, t = cv2.Rodrigues(turn)[0] @ frame, shift.ravel()
        seen = model @ R.T + t
        if np.isfinite(seen).all() and (seen[:, 2] > 0).all() and R[:, 2] @ t > 0:
            error = float(np.sqrt(((seen[:, :2] / seen[:, 2:] - tangents) ** 2).sum(axis=1).mean()))
            found.append((error, R, t))
    return found
