"""A camera on a body that sways towards a dock, drawn at random: docks as they would be seen, and a trajectory."""

from dataclasses import dataclass

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.truth.trajectory import DockTrack, Trajectory, angles
from scipy.spatial.transform import Rotation

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(diameter=0.30, lights=10)
MOUNT = Rotation.from_euler("xyz", [10, -25, 95], degrees=True)


@dataclass(frozen=True)
class Moved:
    """What was drawn, and what is known of it."""

    results: DockTrack
    truth: Trajectory
    positions_m: np.ndarray  # (N, 3): of the dock in the camera
    normals: np.ndarray  # (N, 3)
    lever_m: np.ndarray  # (3,): the camera in the body
    dock_m: np.ndarray  # (3,): in the world
    dock_normal: np.ndarray  # (3,)
    wrong_pose: np.ndarray  # (N,)
    wrong_dock: np.ndarray  # (N,)


def _sway(random, amplitude, count=3):
    """A sum of waves of periods from 2 to 8 seconds, as a function of the time; of three axes."""
    amplitudes = amplitude * random.uniform(0.5, 1.0, (3, count)) / np.sqrt(count)
    rates, phases = 2 * np.pi / random.uniform(2, 8, (3, count)), random.uniform(0, 2 * np.pi, (3, count))
    return lambda t: (amplitudes * np.sin(rates * np.asarray(t)[..., None, None] + phases)).sum(axis=-1)


def draw(
    seed=0,
    *,
    duration_s=60.0,
    rate_hz=20.0,
    truth_hz=100.0,
    offset_s=3.7,
    drift_ppm=20.0,
    gaps=30,
    scale=1.0,
    noise_px=0.15,
    wrong_pose=0.0,
    wrong_dock=0.0,
    sway_m=0.15,
    sway_deg=7.0,
    ranges_m=(3.0, 1.0),
    truth_noise=(2e-4, 0.1),
    path=None,
):
    """Draw a course; ``scale`` is the true diameter over that which was searched with, ``path(t)`` gives other motions.

    A path takes times and returns the camera (N, 3) and its rotation vectors (N, 3) in the frame in which the dock lies
    ahead at the origin, z away.
    """
    random = np.random.default_rng(seed)
    frame = Rotation.from_quat(random.standard_normal(4))  # the frame of the path, in the world
    dock_m = random.uniform(-3, 3, 3)
    lever_m = random.uniform(-0.4, 0.4, 3)
    tilt = Rotation.from_euler("yx", random.uniform(-25, 25, 2), degrees=True)
    normal = tilt.apply([0, 0, -1])
    places, turns = _sway(random, sway_m), _sway(random, np.radians(sway_deg))
    first, last = ranges_m

    def approach(t):
        ahead = np.zeros((len(t), 3))
        ahead[:, 2] = -(first + (last - first) * t / duration_s)
        return ahead + places(t), turns(t)

    path = path or approach

    def camera_at(t):
        place, vector = path(t)
        return frame.apply(place) + dock_m, frame * Rotation.from_rotvec(vector)

    times = np.arange(0, duration_s, 1 / rate_hz)
    place, turned = camera_at(times)
    seen = turned.inv().apply(dock_m - place)
    normals = turned.inv().apply(frame.apply(normal))
    covariances = covariance_of(seen, normals, noise_px)
    count = len(times)

    def noisy(normals):
        noise = (np.linalg.cholesky(covariances) @ random.standard_normal((count, 5, 1)))[:, :, 0]
        x, y = (angles(normals) + noise[:, 3:]).T
        return seen / scale + noise[:, :3], -Rotation.from_euler("YX", np.column_stack([y, x])).as_matrix()[:, :, 2]

    sight = seen / np.linalg.norm(seen, axis=1)[:, None]
    mirrored = 2 * (normals * sight).sum(axis=1)[:, None] * sight - normals
    (chosen_m, chosen), (other_m, other) = noisy(normals), noisy(mirrored)
    is_wrong_pose = random.random(count) < wrong_pose
    is_wrong_dock = random.random(count) < wrong_dock
    chosen_m, other_m = swapped(is_wrong_pose, chosen_m, other_m)
    chosen, other = swapped(is_wrong_pose, chosen, other)
    elsewhere = random.uniform([-0.5, -0.4, 0.7], [0.5, 0.4, 4.0], (count, 3))
    chosen_m, other_m = (np.where(is_wrong_dock[:, None], elsewhere, one) for one in (chosen_m, other_m))
    results = DockTrack(times, chosen_m, chosen, covariances, None, other_m, other, CAMERA, DOCK)

    clock = np.arange(-5, duration_s + 5, 1 / truth_hz)
    own = (clock - 0.0) * (1 + 1e-6 * drift_ppm) + offset_s
    place, turned = camera_at(clock)
    body = turned * MOUNT.inv()
    measured_m = place - body.apply(lever_m) + truth_noise[0] * random.standard_normal((len(clock), 3))
    measured = body * Rotation.from_rotvec(np.radians(truth_noise[1]) * random.standard_normal((len(clock), 3)))
    kept = np.ones(len(clock), bool)
    for begin in random.uniform(0, duration_s, gaps):
        kept &= ~((clock > begin) & (clock < begin + random.uniform(0.15, 0.6)))
    truth = Trajectory("drawn", own[kept], measured_m[kept], measured.as_quat()[kept])
    is_wrong_pose &= ~is_wrong_dock
    return Moved(
        results,
        truth,
        seen,
        normals,
        lever_m,
        dock_m,
        frame.apply(normal),
        is_wrong_pose,
        is_wrong_dock,
    )


def swapped(which, one, other):
    """Rows (N, 3) of two arrays, exchanged where told."""
    return np.where(which[:, None], other, one), np.where(which[:, None], one, other)


def covariance_of(positions_m, normals, noise_px):
    """Covariances (N, 5, 5) by the derivatives of ten lights' images, seen by a pinhole camera."""
    around = 2 * np.pi * np.arange(10) / 10
    ring = 0.15 * np.column_stack([np.cos(around), np.sin(around), np.zeros(10)])

    def images(five):
        x, y = five[:, 3], five[:, 4]
        turned = Rotation.from_euler("YX", np.column_stack([y, x])).as_matrix()
        points = five[:, None, :3] + ring @ turned.transpose(0, 2, 1)
        return (700 * points[..., :2] / points[..., 2:]).reshape(len(five), -1)

    five = np.hstack([positions_m, angles(normals)])
    slopes = np.stack([(images(five + step) - images(five - step)) / 2e-6 for step in 1e-6 * np.eye(5)], axis=2)
    return noise_px**2 * np.linalg.inv(slopes.transpose(0, 2, 1) @ slopes)
