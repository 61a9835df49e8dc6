"""Which of the two poses is right where the lights' spacing fits another camera: by the side that is nearer."""

import math
from collections.abc import Sequence
from dataclasses import replace

import cv2
import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.sigma import with_errors
from dockpose.dock import Dock
from dockpose.lights.chance import LEAST_PX
from dockpose.lights.ellipse import Ellipse
from dockpose.pose.choice import Choice, choose_by_side
from dockpose.pose.circle import CirclePose
from dockpose.pose.solve import both_poses, find_poses

_NUMBERS = 8  # of a homography
# Focal lengths tried, in the camera's, and steps from the best; chance of one number more, off a place, hardly another.
_TIMES, _STEPS = 1.21 ** np.arange(-6, 8), (1.1, 1.05, 1.025, 1.0125)
_NO_CHANCE, _IN_PLACE_PX, _SLIGHT = 1e-4, 0.5, math.log(1.1)
_SAME_WAY = 0.5  # cosine of the angle between what parts the two poses by either camera, for one to be like the other
_DOUBTFUL = 20.0  # how many times as far as off their ellipse


def other_focal_px(
    points_px: np.ndarray, camera: Camera, dock: Dock, ellipse: Ellipse, choice: Choice
) -> tuple[float, int] | None:
    """The focal length by which lights (N, 2) on an ellipse are far better in their places, and how many these are.

    None where the camera's will do, or lights are off their places by any: then hands have spaced them.
    """
    count, own_px = len(points_px), choice.candidates[choice.selected].rms_px or 0.0
    is_placed = choice.lights is not None
    is_near = is_placed and own_px < max(LEAST_PX, 2 * ellipse.rms_px)
    if count * 2 <= _NUMBERS or is_near or dock.angles_deg or dock.offsets_m:
        return None
    # A number that was taken by this camera may be wrong as well, where lights are that far off their places by it.
    is_doubtful = own_px > _DOUBTFUL * max(ellipse.rms_px, LEAST_PX)
    known = dock if is_doubtful else dock.with_lights(dock.lights or choice.number)

    def placed(times: float) -> tuple[float, float, int]:
        other = msgspec.structs.replace(camera, fx=times * camera.fx, fy=times * camera.fy)
        found = find_poses(points_px, other, known, ellipse=None if camera.port else ellipse)[1]
        rms_px = math.inf if found.lights is None else found.candidates[0].rms_px or 0.0
        return rms_px, times, found.number or known.lights or 0

    best = min(map(placed, _TIMES.tolist()))
    for step in _STEPS:
        best = min(best, placed(best[1] * step), placed(best[1] / step))
    rms_px, times, lights = best
    is_slight = is_placed and own_px < _IN_PLACE_PX and abs(math.log(times)) < _SLIGHT
    if is_slight or rms_px > max(_IN_PLACE_PX, 3 * ellipse.rms_px):
        return None
    from scipy.special import fdtrc  # takes a third of a second to import, which few pictures need

    better = (own_px**2 - rms_px**2) * (2 * count - 7) / max(rms_px, LEAST_PX) ** 2
    is_chance = is_placed and fdtrc(1, 2 * count - 7, max(0.0, better)) > _NO_CHANCE
    return None if is_chance else (times * math.sqrt(camera.fx * camera.fy), lights)


def poses_by_side(
    points_px: np.ndarray, camera: Camera, dock: Dock, focal_px: float, lights: int, ellipse: Ellipse | None = None
) -> tuple[Ellipse, Choice]:
    """Both poses of lights (N, 2) by their ellipse alone, and which is right by the homography of the lights.

    They are spaced as so many are by a focal length that is not the camera's, and no number of a pose holds that comes
    from that; but which side of a plane is nearer shows in its homography, which knows nothing of the camera.
    """
    ellipse, poses = both_poses(points_px, camera, dock, ellipse)
    scale = focal_px / math.sqrt(camera.fx * camera.fy)
    other = msgspec.structs.replace(camera, fx=scale * camera.fx, fy=scale * camera.fy)
    told = find_poses(points_px, other, dock.with_lights(lights))[1]
    first = 0.5
    if told.lights is not None and len(points_px) * 2 > _NUMBERS:
        seen_px = camera.undistort(points_px)
        apart, first = _first_is_right(seen_px, 2 * math.pi / lights * told.lights, told.candidates, other)
        own = _rising(poses[0], camera) - _rising(poses[1], camera)
        along = float(own @ apart) / max(float(np.linalg.norm(own) * np.linalg.norm(apart)), 1e-30)
        first = 0.5 if abs(along) < _SAME_WAY else first if along > 0 else 1 - first
    # How far off its focal length is, is what is known of the error.
    off_px = np.array([camera.fx, camera.fy]) * (scale - 1)
    camera = with_errors(camera, ["fx", "fy"], np.outer(off_px, off_px))
    choice = choose_by_side(poses, points_px, camera, dock, first)
    return ellipse, replace(choice, lights=told.lights, number=lights, focal_px=float(focal_px))


def _first_is_right(
    seen_px: np.ndarray, angles_rad: np.ndarray, poses: Sequence[CirclePose], camera: Camera
) -> tuple[np.ndarray, float]:
    """How the rise of the first of two poses differs from the second's (2,), and how likely it is the right one."""
    middle, size = seen_px.mean(axis=0), float(seen_px.std())
    places, seen = np.column_stack([np.cos(angles_rad), np.sin(angles_rad)]), (seen_px - middle) / size
    H, _ = cv2.findHomography(places, seen)
    one, other = _rising(poses[0], camera), _rising(poses[1], camera)
    if H is None:
        return one - other, 0.5
    flat = np.column_stack([places, np.ones(len(places))])
    behind = flat @ H.T
    w, image = behind[:, 2:], behind[:, :2] / behind[:, 2:]
    nothing = np.zeros((len(places), 3))
    J = np.stack(
        [
            np.hstack([flat / w, nothing, -image[:, :1] * flat[:, :2] / w]),
            np.hstack([nothing, flat / w, -image[:, 1:] * flat[:, :2] / w]),
        ]
    ).reshape(-1, _NUMBERS)
    freedom = len(J) - _NUMBERS
    variance = float(((image - seen) ** 2).sum()) / freedom
    # By how much nearness, 1 / depth, grows from the middle on, per pixel; the affine part is known well beside it.
    slopes = H[:2, :2] - np.outer(H[:2, 2], H[2, :2])
    turned = -np.linalg.inv(slopes).T / size
    rise, covariance = turned @ H[2, :2], turned @ (variance * np.linalg.inv(J.T @ J)[6:, 6:]) @ turned.T
    along = one - other
    off = float((rise - (one + other) / 2) @ along) / math.sqrt(max(float(along @ covariance @ along), 1e-30))
    from scipy.special import stdtr  # takes a third of a second to import, which few pictures need

    return along, float(stdtr(freedom, off))


def _rising(pose: CirclePose, camera: Camera) -> np.ndarray:
    """By which share (2,) per pixel a dock's nearness, 1 / depth, grows across its picture."""
    return pose.normal[:2] / float(pose.normal @ pose.position_m) * pose.position_m[2] / [camera.fx, camera.fy]
