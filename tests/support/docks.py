"""Views of a dock whose lights are not quite in their places."""

import math

import msgspec
import numpy as np
from dockpose import Camera, Dock
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.learned.learning import free_offsets
from dockpose.pose.learned.views import DockView
from dockpose.pose.solve import find_poses

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)


def uneven(seed, lights=10, off_m=1e-3):
    """A dock of 0.30 m with each light off by a normal deviate of ``off_m`` along each axis."""
    offsets = np.random.default_rng(seed).normal(0, off_m, (lights, 3))
    return Dock(0.30, lights, offsets_m=tuple(map(tuple, offsets.tolist())))


def nominal(dock):
    return msgspec.structs.replace(dock, offsets_m=())


def dock_views(
    dock,
    seed,
    count=60,
    noise_px=0.1,
    camera=CAMERA,
    tilt_deg=35.0,
    ranges_m=(0.8, 2.0),
    aside=0.15,
    rolls: float | None = 0.05,
):
    """Views from all sides; ``rolls`` is the step of the roll between views of a video, None for single pictures."""
    rng, lights = np.random.default_rng(1000 + seed), dock.light_points()
    roll, views, phases = rng.uniform(0, 2 * math.pi), [], rng.uniform(0, 2 * math.pi, 2)
    for number in range(count):
        roll = rng.uniform(0, 2 * math.pi) if rolls is None else roll + rng.normal(0, rolls)
        tilts = np.radians(rng.uniform(-tilt_deg, tilt_deg, 2))
        if rolls is not None:  # smoothly, as in a video
            tilts = np.radians(tilt_deg) * np.sin(2 * math.pi * number / count * np.array([3, 2]) + phases)
        rotation = rotation_from_angles(tilts[0], tilts[1], roll)
        z = rng.uniform(*ranges_m) * camera.fx / 700
        place = np.array([*rng.uniform(-aside, aside, 2) * z, z])
        points_px = camera.project(lights @ rotation.T + place) + rng.normal(0, noise_px, (len(lights), 2))
        _, choice = find_poses(points_px, camera, nominal(dock))
        views.append(DockView(f"view {number}", points_px, choice.candidates, rolls is not None and number > 0))
    return views


def errors_m(learned, true):
    """Errors (lights, 3) and standard errors of the offsets, less what is a matter of pose, in the better numbering."""
    basis, count = free_offsets(nominal(true)), true.lights
    wanted = (basis @ (basis.T @ np.array(true.offsets_m).ravel())).reshape(-1, 3)
    best = None
    for turn in range(count):
        angle = turn * 2 * math.pi / count
        c, s = math.cos(angle), math.sin(angle)
        turned = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
        error = np.roll(np.array(learned.dock.offsets_m), turn, axis=0) @ turned.T - wanted
        sigma = np.sqrt(np.roll(learned.sigmas_m, turn, axis=0) ** 2 @ (turned.T**2))
        if best is None or (error**2).sum() < (best[0] ** 2).sum():
            best = error, sigma
    assert best is not None
    return best
