"""From the centroids of the lights in a picture to both poses of the dock, with or without a port."""

import math
from collections.abc import Sequence

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import as_points
from dockpose.dock import Dock
from dockpose.lights.ellipse import MIN_POINTS, Ellipse, NoEllipseError, fit_ellipse
from dockpose.pose.choice import Choice, choose_by_side, choose_by_spacing
from dockpose.pose.circle import CirclePose, circle_poses
from dockpose.pose.few_lights import FEWEST, poses_from_few_lights
from dockpose.pose.number import choose_with_number
from dockpose.pose.refine import light_rays, on_planes
from numpy.typing import ArrayLike

_ROUNDS = 4  # of ellipse and pose in turn, each of which leaves a tenth of the error: a ten-millionth of the range
_FIRST_DEPTH_M = 1.0  # where these begin
_ON_A_LINE_PX = 0.01  # no centroid is better than this; a smaller scatter, such as a port's bend, is no ellipse


def find_poses(
    points_px: ArrayLike,
    camera: Camera,
    dock: Dock,
    ellipse: Ellipse | None = None,
    covariances_px2: np.ndarray | None = None,
) -> tuple[Ellipse, Choice]:
    """Find both poses of a dock from five or more of its lights, or from three or four whose spacing is known.

    Parameters
    ----------
    points_px : (N, 2) array_like, pixels
        Centroids of the lights in the picture.
    camera : Camera
        The camera that took it.
    dock : Dock
        Its diameter, and its lights where they are known.
    ellipse : Ellipse, optional
        The ellipse through the lights, where it is known already.
    covariances_px2 : (N, 2, 2) array, optional
        How well the picture shows each of the points, in pixels squared, by which five lights or more are weighed.

    Returns
    -------
    ellipse : Ellipse
        In pixels of the undistorted picture; behind a port, of the pinhole picture that would show the lights where the
        chosen pose has them. For three or four lights it is the ellipse of the chosen pose, see
        :func:`dockpose.pose.few_lights.poses_from_few_lights`.
    choice : Choice
        The two refined poses and the choice between them.

    Raises
    ------
    NoEllipseError
        If no ellipse passes through the points, or they are such that the numbers of a pose would not be finite.
    """
    points = np.ascontiguousarray(as_points("points_px", points_px, 2))
    if FEWEST <= len(points) < MIN_POINTS and dock.lights is not None:
        choice = _finite(poses_from_few_lights(points, camera, dock))
        pose, angles = choice.candidates[0], np.linspace(0, 2 * np.pi, 12, endpoint=False)
        circle = dock.radius * np.column_stack([np.cos(angles), np.sin(angles)]) @ pose.rotation[:, :2].T
        seen = (pose.position_m + circle) @ camera.matrix.T  # as a pinhole sees it
        return fit_ellipse(seen[:, :2] / seen[:, 2:]), choice
    ellipse, poses = both_poses(points, camera, dock, ellipse)
    choice = _chosen(poses, points, camera, dock, covariances_px2)
    if camera.port is None:
        return ellipse, choice
    chosen = choice.candidates[choice.selected]
    return fit_ellipse(camera.virtual_pixels(points, _depths(points, camera, chosen))), choice


def both_poses(
    points_px: np.ndarray, camera: Camera, dock: Dock, ellipse: Ellipse | None = None
) -> tuple[Ellipse, tuple[CirclePose, CirclePose]]:
    """The ellipse through points (N, 2), as it is seen from the first pose behind a port, and both poses of it."""
    if _scatter_about_line_px(points_px) < _ON_A_LINE_PX:
        raise NoEllipseError("the points lie on a line")
    if camera.port is None:
        ellipse = ellipse or fit_ellipse(camera.undistort(points_px))
        return ellipse, circle_poses(ellipse, camera, dock.diameter)
    poses = _poses_behind_port(points_px, camera, dock)
    return fit_ellipse(camera.virtual_pixels(points_px, _depths(points_px, camera, poses[0]))), poses


def _chosen(
    poses: Sequence[CirclePose], points_px: np.ndarray, camera: Camera, dock: Dock, covariances_px2: np.ndarray | None
) -> Choice:
    """The choice between both poses of lights (N, 2), of a known number or any."""

    def choose(dock: Dock) -> Choice | None:
        return choose_by_spacing(poses, points_px, camera, dock, covariances_px2)

    choice = choose(dock) if dock.lights is not None else choose_with_number(choose, len(points_px), camera, dock)
    return _finite(choice or choose_by_side(poses, points_px, camera, dock))


def _finite(choice: Choice) -> Choice:
    """The choice, unless a number of its poses is not finite."""
    for pose in choice.candidates:
        if not math.isfinite(sum(pose.position_m.tolist()) + sum(pose.normal.tolist()) + sum(pose.centre_px.tolist())):
            raise NoEllipseError("no pose explains them within rounding errors")
    return choice


def _scatter_about_line_px(points: np.ndarray) -> float:
    """Root mean square distance of points (N, 2) from the line that fits them best; NaN where one is not finite."""
    u, v = (points - points.mean(axis=0)).T
    xx, xy, yy = float(u @ u), float(u @ v), float(v @ v)
    return math.sqrt(abs((xx + yy) / 2 - math.hypot((xx - yy) / 2, xy)) / len(points))


def _poses_behind_port(points_px: np.ndarray, camera: Camera, dock: Dock) -> tuple[CirclePose, CirclePose]:
    """Both poses seen through a port: pixels for their depths, ellipse and pose in turn."""
    depth, pair = _FIRST_DEPTH_M, ()
    for _ in range(3):
        pair = circle_poses(fit_ellipse(camera.virtual_pixels(points_px, depth)), camera, dock.diameter)
        depth = float(pair[0].position_m[2] + pair[1].position_m[2]) / 2
    first, second = (_settled(pose, points_px, camera, dock) for pose in pair)
    return first, second


def _settled(pose: CirclePose, points_px: np.ndarray, camera: Camera, dock: Dock) -> CirclePose:
    for _ in range(_ROUNDS):
        ellipse = fit_ellipse(camera.virtual_pixels(points_px, _depths(points_px, camera, pose)))
        pair = circle_poses(ellipse, camera, dock.diameter)
        pose = max(pair, key=lambda other, like=pose.normal: float(other.normal @ like))
    return pose


def _depths(points_px: np.ndarray, camera: Camera, pose: CirclePose) -> np.ndarray:
    """Depth (N,) in metres at which the rays of picture points meet a dock's plane."""
    rays = light_rays(points_px, camera, float(pose.position_m[2]))
    (flat,) = on_planes(rays, pose.rotation[None], pose.position_m[None])
    return pose.position_m[2] + flat @ pose.rotation[2, :2]
