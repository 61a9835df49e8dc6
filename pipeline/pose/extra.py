"""Which of the two poses is right, by lamps before or behind the plane of the ring's lights; and each pose by them."""

import math
from dataclasses import replace
from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.markers import Markers
from dockpose.lights.windows import spots_in_windows
from dockpose.pose.choice import Choice, is_square_on
from dockpose.pose.circle import CirclePose, angles_of, rotation_from_angles
from dockpose.pose.uncertainty import deviations, nearer

# How often an extra lamp is lit and seen; standard error of its place, as a share of the diameter: by ruler, on a rod.
_SEEN, _PLACED = 0.85, 0.005
_FREEDOM = 4  # of how far it is off: what hands place has longer tails than noise
_ON_FACE = 0.05  # other bright spots on a dock's face, as its picture's expected number: fittings, reflections
_SHARES, _LEAST_NOISES = (0.2, 0.4, 0.6), 5.0  # of the ring's lights' height, and of noise, that a lamp stands out by
_MOST_TIMES = 4.0  # as large as the largest of the ring's lights: glare is no lamp
_FARTHEST = 4.0  # standard errors from where it must be, that a lamp is sought
_STEP, _ROUNDS = 1e-4, 4  # of derivatives, in ranges and radians; of refinement
_MOST_TURNED_RAD = 0.7  # by refinement; more is beyond what errors of a first order hold for


def places_px(pose: CirclePose, camera: Camera, dock: Dock) -> np.ndarray:
    """Where (E, 2) a pose has the dock's extra lights in the picture; NaN behind the camera."""
    rotation = pose.rotation @ rotation_from_angles(0.0, 0.0, pose.roll_rad or 0.0)
    return camera.project(pose.position_m + np.array(dock.extra_lights_m) @ rotation.T)


def with_extra_lights(
    choice: Choice, light: np.ndarray, corner_px: Any, ring: Markers, density: float, camera: Camera, dock: Dock
) -> Choice:
    """The choice by what a part of the picture, in linear light (H, W), shows where either pose has extra lights.

    A lamp under a pose is seen there with a probability, or says nothing, as where it is dead, hidden or drowned in
    glare; other spots are anywhere, at a density per pixel squared, or by how many there are (Bar-Shalom et al. 2011,
    section 3.4). A pose by which a spot is more likely the lamp than not is refined by it.
    """
    count, poses = len(dock.extra_lights_m), choice.candidates
    nothing = replace(choice, extra_px=np.full((count, 2), np.nan))
    is_on_axis = not any(any(place[:2]) for place in dock.extra_lights_m)
    known = all(pose.errors and pose.probability is not None for pose in poses)
    if not known or not (is_on_axis or all(pose.roll_rad is not None for pose in poses)):
        return nothing
    # By the lights of an even ring so many turns look alike.
    turns = 1 if is_on_axis or dock.angles_deg or dock.offsets_m else dock.lights or choice.number or 1
    steps = [rotation_from_angles(0.0, 0.0, 2 * math.pi * turn / turns) for turn in range(turns)]
    expected = [[_expected(pose, step, camera, dock) for step in steps] for pose in poses]
    means, spreads = (np.array([[one[number] for one in row] for row in expected]) for number in (0, 1))
    if not (np.isfinite(means).all() and np.isfinite(spreads).all()):
        return nothing
    spots, region_px2 = _spots(light, corner_px, ring, means, spreads)
    if not len(spots):
        return nothing
    density += max(0, len(spots) - count) / region_px2
    density += _ON_FACE / max(region_px2, float(np.prod(np.ptp(ring.points_px, axis=0))))
    odds = _SEEN / (1 - _SEEN) * _densities(spots, means, spreads) / density  # (poses, turns, lamps, spots)
    if not (odds > 1).any():
        return nothing
    by_turn = (1 + odds.sum(axis=3)).prod(axis=2)
    told, best, seen, refined = by_turn.mean(axis=1), by_turn.argmax(axis=1), [], []
    for pose, turn, row in zip(poses, best.tolist(), odds[range(len(poses)), best], strict=True):
        seen.append(np.where(row.max(axis=1)[:, None] > 1, spots[row.argmax(axis=1)], np.nan))
        refined.append(_refined(pose, steps[turn], seen[-1], len(ring), camera, dock))
    before = np.array([max(pose.probability or 0.0, 1e-300) for pose in poses])
    chances = (told * before / (told @ before)).tolist()
    if len(poses) == 2:
        (x0, y0), (x1, y1) = (angles_of(pose.normal) for pose in refined)
        sigmas = tuple(pose.sigma_theta_rad or (0.0, 0.0) for pose in refined)
        chances = nearer(chances, (x0 - x1, y0 - y1), sigmas)
    order = sorted(range(len(poses)), key=lambda k: -chances[k])
    lights_by = tuple(choice.lights_by[k] for k in order) if choice.lights_by else ()
    by_extra = np.ptp(np.log(told)) > max(math.log(2), np.ptp(np.log(before)))
    return replace(
        choice,
        candidates=tuple(replace(refined[k], probability=chances[k]) for k in order),
        selected_by="extra" if by_extra else choice.selected_by,
        lights=lights_by[0] if lights_by else choice.lights,
        lights_by=lights_by,
        coincide=is_square_on(refined[order[0]]),
        extra_px=seen[order[0]],
    )


def _expected(pose: CirclePose, turn: np.ndarray, camera: Camera, dock: Dock) -> tuple[np.ndarray, np.ndarray]:
    """Where (E, 2) a pose, turned about its axis, has the extra lights, and how sure it is of that (E, 2, 2)."""
    means, H = _after(np.zeros(6), pose, turn, camera, dock)
    assert pose.errors is not None
    by_pose = pose.errors.noise**2 * H @ pose.errors.covariance @ H.transpose(0, 2, 1)
    return means, by_pose + _own_px2(pose, camera, dock) * np.eye(2)


def _own_px2(pose: CirclePose, camera: Camera, dock: Dock) -> float:
    """Variance of an extra light's centre about where an exact pose has it: as the ring's, and by its place."""
    placed_px = _PLACED * dock.diameter * camera.fx / float(pose.position_m[2])
    return min(pose.errors.noise if pose.errors else placed_px, 2 * placed_px) ** 2 + placed_px**2


def _after(
    step: np.ndarray, pose: CirclePose, turn: np.ndarray, camera: Camera, dock: Dock
) -> tuple[np.ndarray, np.ndarray]:
    """The extra lights' places (E, 2) after a step (6,), and their derivatives (E, 2, 6) by it.

    As in :attr:`PoseErrors.covariance` it is one along the camera's axes, and a turn about the dock's own.
    """
    more = _STEP * np.repeat([float(pose.position_m[2]), 1.0], 3)
    steps = step + np.concatenate([np.zeros((1, 6)), np.diag(more), -np.diag(more)])
    places = [one[:3] + np.array(dock.extra_lights_m) @ _rotation(one, pose, turn).T for one in steps]
    seen = camera.project(pose.position_m + np.concatenate(places)).reshape(13, -1, 2)
    return seen[0], (seen[1:7] - seen[7:]).transpose(1, 2, 0) / (2 * more)


def _rotation(step: np.ndarray, pose: CirclePose, turn: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) from the dock's frame to the camera's after a step (6,)."""
    assert pose.errors is not None
    rolled = pose.rotation @ rotation_from_angles(0.0, 0.0, pose.roll_rad or 0.0) @ turn
    return pose.errors.rotation @ cv2.Rodrigues(step[3:])[0] @ pose.errors.rotation.T @ rolled


def _refined(
    pose: CirclePose, turn: np.ndarray, seen_px: np.ndarray, lights: int, camera: Camera, dock: Dock
) -> CirclePose:
    """A pose by its lights and extra ones seen at points (E, 2), NaN of others: an iterated extended Kalman update.

    (Bar-Shalom et al. 2001, section 10.5.2). The squares of its lights' residuals grow by what the step costs them.
    """
    errors, chosen = pose.errors, np.isfinite(seen_px[:, 0])
    assert errors is not None
    prior, own_px2 = errors.noise**2 * errors.covariance, _own_px2(pose, camera, dock) * np.eye(2 * chosen.sum())
    step, covariance = np.zeros(6), prior
    for _ in range(_ROUNDS):
        places_px, slopes = _after(step, pose, turn, camera, dock)
        H = slopes[chosen].reshape(-1, 6)
        gain = prior @ H.T @ np.linalg.inv(H @ prior @ H.T + own_px2)
        step, covariance = gain @ ((seen_px - places_px)[chosen].ravel() + H @ step), prior - gain @ H @ prior
        if not np.linalg.norm(step[3:]) < _MOST_TURNED_RAD or not abs(step[2]) < pose.position_m[2] / 2:
            return pose
    rotation = _rotation(step, pose, turn)
    moved = CirclePose.at(pose.position_m + step[:3], -rotation[:, 2], camera, probability=pose.probability)
    along_x, along_y, _ = moved.rotation.T @ rotation[:, 0]
    turned = errors.rotation @ cv2.Rodrigues(step[3:])[0]
    errors = replace(errors, covariance=covariance / errors.noise**2, rotation=turned)
    sigmas = deviations(errors.covariance, turned, errors.noise)
    squares_px2 = lights * (pose.rms_px or 0.0) ** 2 + float(step @ np.linalg.solve(prior, step)) * errors.noise**2
    return replace(
        moved,
        rms_px=math.sqrt(squares_px2 / lights),
        roll_rad=None if pose.roll_rad is None else math.atan2(along_y, along_x) % math.tau,
        sigma_position_m=sigmas[0],
        sigma_theta_rad=sigmas[1],
        errors=errors,
    )


def _densities(spots: np.ndarray, means: np.ndarray, spreads: np.ndarray) -> np.ndarray:
    """Densities (..., S) per pixel squared of spots (S, 2) about means (..., 2), by Student's distribution."""
    off = spots - means[..., None, :]
    squares = np.einsum("...si,...ij,...sj->...s", off, np.linalg.inv(spreads), off)
    tails = (1 + squares / _FREEDOM) ** (-_FREEDOM / 2 - 1)
    return tails / (2 * math.pi * np.sqrt(np.linalg.det(spreads)))[..., None]


def _spots(
    light: np.ndarray, corner_px: tuple[int, int], ring: Markers, means: np.ndarray, spreads: np.ndarray
) -> tuple[np.ndarray, float]:
    """Bright spots (S, 2) that are none of the ring's lights around where extra ones may be, and the area of that.

    Spots stand out of what is as wide as several lights, as glare and haze are, and of the noise.
    """
    nothing = np.empty((0, 2)), 1.0
    points, sides = ring.points_px - corner_px, (ring.boxes_px[:, 2:] - ring.boxes_px[:, :2]).max(axis=1) + 1.0
    half = math.ceil(float(sides.max()) / 2)
    shown = spots_in_windows(light, points, np.ceil(sides / 2), np.ceil(sides / 2 + np.maximum(3.0, sides / 2)))
    if not np.isfinite(shown.heights).any():
        return nothing
    far = _FARTHEST * np.sqrt(np.diagonal(spreads, axis1=-2, axis2=-1)) + 2 * half + 2
    size = np.array(light.shape[::-1])
    low = np.clip(np.floor((means - far - corner_px).min(axis=(0, 1, 2))), 0, size).astype(int)
    high = np.clip(np.ceil((means + far - corner_px).max(axis=(0, 1, 2))) + 1, 0, size).astype(int)
    if (high - low < 3).any():
        return nothing
    part = np.ascontiguousarray(light[low[1] : high[1], low[0] : high[0]], np.float32)
    wide = np.ones((4 * half + 3, 4 * half + 3), np.uint8)
    raised = cv2.morphologyEx(part, cv2.MORPH_TOPHAT, wide)
    height, noise = float(np.nanmedian(shown.heights)), float(np.nanmedian(shown.noises))
    found, spots = np.empty((0, 4), dtype=int), np.empty((0, 2))
    for share in _SHARES:  # what runs together with others at one level may be by itself at a higher one
        over = np.maximum(raised - max(share * height, _LEAST_NOISES * noise), 0)
        _, labels, table, _ = cv2.connectedComponentsWithStats((over > 0).astype(np.uint8))
        boxes, areas = np.hstack([table[1:, :2], table[1:, :2] + table[1:, 2:4] - 1]) + [*low, *low], table[1:, 4]
        rows, columns = np.nonzero(labels)
        of, weights = labels[rows, columns] - 1, over[rows, columns]
        x, y, total = (np.bincount(of, weights * each, len(boxes)) for each in (columns, rows, 1.0))
        middles = np.column_stack([x, y]) / total[:, None] + low
        new = ~_holds(boxes, points).any(axis=0) & (areas < _MOST_TIMES * ring.areas_px.max())
        new &= ~_holds(boxes, spots).any(axis=0) & ~_holds(found, middles).any(axis=1)
        found, spots = np.vstack([found, boxes[new]]), np.vstack([spots, middles[new]])
    return spots + corner_px, float(np.prod(high - low))


def _holds(boxes: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Whether points (N, 2) are in boxes (M, 4) or a pixel beside them: (N, M)."""
    inside = (points[:, None] > boxes[:, :2] - 1.5) & (points[:, None] < boxes[:, 2:] + 1.5)
    return np.all(inside, axis=2)
