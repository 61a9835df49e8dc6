"""Where parts of an estimate lie in the picture, in pixels: the ellipse, the dock's circle and axes by each pose."""

import math

import numpy as np
from dockpose.estimate.reached import Stages
from dockpose.pose.circle import CirclePose
from dockpose.pose.extra import places_px
from dockpose.pose.known import KnownPose

_BAR_SHARE = 0.25  # of the picture's width, at most
_CIRCLE_RADII = 1.6  # of a light: nothing but the light is to be seen in the circle around it
_NORMAL_RADII = 1.3  # long enough to end outside the ring
_ANGLES = np.linspace(0, 2 * np.pi, 120, endpoint=False)
_ON_CIRCLE = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])


def in_picture(estimate: Stages, points_px: np.ndarray) -> np.ndarray:
    """Where points (N, 2) of the undistorted picture appear in the picture; behind a port, in the chosen plane."""
    camera, pose = estimate.camera, estimate.selected
    if camera.port is None or pose is None:
        return camera.distort(points_px)
    rays = camera.pinhole_rays(points_px)
    return camera.project(rays * ((pose.position_m @ pose.normal) / (rays @ pose.normal))[:, None])


def outline(estimate: Stages) -> np.ndarray | None:
    """Return points (240, 2) on the ellipse; None where there is none."""
    return None if estimate.ellipse is None else in_picture(estimate, estimate.ellipse.points(240))


def centres(estimate: Stages) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the ellipse's centre and the dock's centre by the chosen pose, each (2,) or None."""
    ellipse, pose = estimate.ellipse, estimate.selected
    return (
        None if ellipse is None else in_picture(estimate, np.array([ellipse.centre_px]))[0],
        None if pose is None else estimate.camera.project([pose.position_m])[0],
    )


def pose_lines(pose: CirclePose | KnownPose, estimate: Stages) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a pose's circle (120, 2), and the ends of two diameters (2, 2, 2) and of its normal (2, 2), in pixels.

    NaN for what is behind the camera.
    """
    axes, radius = pose.rotation.T, estimate.dock.radius
    plane, normal = radius * axes[:2], -_NORMAL_RADII * radius * axes[2]
    ends = np.array([-plane[0], plane[0], -plane[1], plane[1], np.zeros(3), normal])
    points_px = estimate.camera.project(np.asarray(pose.position_m) + np.concatenate([_ON_CIRCLE @ plane, ends]))
    return points_px[:-6], points_px[-6:-2].reshape(2, 2, 2), points_px[-2:]


def extra_expected(pose: CirclePose | KnownPose, estimate: Stages) -> np.ndarray:
    """Return where (E, 2) an estimated pose has the dock's extra lights; none of one that is known, without roll."""
    if not isinstance(pose, CirclePose) or not estimate.dock.extra_lights_m:
        return np.empty((0, 2))
    return places_px(pose, estimate.camera, estimate.dock)


def extra_seen(estimate: Stages) -> tuple[np.ndarray, np.ndarray]:
    """Return where (S, 2) extra lights are seen, and for each group (N,) whether it is one of these."""
    choice, markers = estimate.choice, estimate.markers
    seen = np.empty((0, 2)) if choice is None or choice.extra_px is None else choice.extra_px
    seen = seen[np.isfinite(seen).all(axis=1)]
    points, radii = (np.empty((0, 2)) if markers is None else markers.points_px), light_radii(estimate)
    near = np.linalg.norm(points[:, None] - seen, axis=2) < radii[:, None]
    return seen, near.any(axis=1) & ~on_ring(estimate)


def on_ring(estimate: Stages) -> np.ndarray:
    """Return for each group (N,) bool whether it is a light on the ring; without a pose only those set by hand are."""
    if estimate.ring is None or (estimate.selected is None and estimate.by_hand is None):
        return np.zeros(0 if estimate.markers is None else len(estimate.markers), dtype=bool)
    return estimate.ring.on_ring


def light_radii(estimate: Stages, least_px: float = 0.0) -> np.ndarray:
    """Return the radius (N,) in pixels of the circle around each group."""
    areas_px = np.zeros(0) if estimate.markers is None else estimate.markers.areas_px
    return np.maximum(_CIRCLE_RADII * np.sqrt(areas_px / math.pi), least_px)


def beside_lights(points: np.ndarray, estimate: Stages, least_px: float) -> list[np.ndarray]:
    """Return what is left of a line through points (N, 2) outside of the lights' circles: pieces (K, 2) of it."""
    if estimate.markers is None:
        return [points]
    lights = on_ring(estimate)
    return outside(points, estimate.markers.points_px[lights], light_radii(estimate, least_px)[lights])


def outside(points: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> list[np.ndarray]:
    """Return what is left of a line through points (N, 2) outside of circles (M, 2), (M,): pieces (K, 2) of it."""
    pieces: list[list[np.ndarray]] = []
    is_open = False  # whether the next part goes on where the last one ended
    for start, way in zip(points[:-1], np.diff(points, axis=0), strict=True):
        free = _free_shares(start, way, centres, radii)
        for begin, end in free:
            if begin == 0 and is_open:
                pieces[-1].append(start + end * way)
            else:
                pieces.append([start + begin * way, start + end * way])
        is_open = bool(free) and free[-1][1] == 1
    return [np.array(piece) for piece in pieces]


def _free_shares(start: np.ndarray, way: np.ndarray, centres: np.ndarray, radii: np.ndarray) -> list[list[float]]:
    """The shares of a straight line, from ``start`` by ``way``, between which it is in no circle."""
    square = float(way @ way)
    if not 0 < square < math.inf:  # of no length, or not finite
        return []
    middles = (centres - start) @ way / square
    halves = middles**2 - (((centres - start) ** 2).sum(axis=1) - radii**2) / square
    free = [[0.0, 1.0]]
    for middle, half in zip(middles[halves > 0], np.sqrt(halves[halves > 0]), strict=True):
        parts = [
            part for begin, end in free for part in ([begin, min(end, middle - half)], [max(begin, middle + half), end])
        ]
        free = [part for part in parts if part[1] > part[0]]
    return free


def light_labels(estimate: Stages) -> list[tuple[int, str, np.ndarray]]:
    """Return for each light on the ring the index of its group, its number from 1, and the way (2,) out of the ring."""
    lights = on_ring(estimate)
    if estimate.markers is None or not lights.any():
        return []
    points, numbers = estimate.markers.points_px, estimate.light_numbers()
    outward = points - points[lights].mean(axis=0)
    outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), 1e-9)
    labels = [index if light is None else light for index, light in enumerate(numbers)]
    return [(index, str(labels[index] + 1), outward[index]) for index in np.flatnonzero(lights).tolist()]


def scale_bar(estimate: Stages) -> tuple[float, float] | None:
    """Return a round length at the dock's distance, in metres and in pixels; None where there is no pose."""
    pose = estimate.selected
    if pose is None:
        return None
    ends = pose.position_m + np.outer([-0.5, 0.5], [estimate.dock.radius, 0, 0])
    left, right = estimate.camera.project(ends)
    per_metre = float(np.linalg.norm(right - left)) / estimate.dock.radius
    if not math.isfinite(per_metre) or per_metre <= 0:
        return None
    longest = _BAR_SHARE * estimate.width / per_metre
    power = 10.0 ** math.floor(math.log10(longest))
    length = max([factor * power for factor in (1, 2, 5) if factor * power <= longest * (1 + 1e-9)])
    return length, length * per_metre
