"""A dock of two rings from 6 m to 0.3 m: frames with a pose, and jumps where the tracker hands over between them."""

import math
from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
import pytest
from dockpose import Camera, Dock, DockRing, Tracker
from dockpose.pose.circle import rotation_from_angles
from dockpose.simulate import Approach, FilmPlan, Lights, Pose, Scene, film
from dockpose.tracking import Tracked

from tests.bench.lamps import draw_lamps, rings_px

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
FRAMES, RATE_HZ, FAR_M, NEAR_M = 300, 10.0, 6.0, 0.3
LEAST_SHARE, SIGMAS = 0.99, 3.0
NEAR = DockRing(name="near", diameter=0.16, lights=6)
FAR = DockRing(name="far", diameter=0.9, lights=12)
BEHIND = DockRing(name="near", diameter=0.16, lights=6, position_m=(0.0, 0.0, 0.1))
DOCKS = {"concentric": Dock(rings=(FAR, NEAR)), "behind": Dock(rings=(FAR, BEHIND))}
# Time, picture, and the true position and normal.
Shown = Iterator[tuple[float, np.ndarray, tuple[np.ndarray, np.ndarray]]]


def simulated(dock: Dock, seed: int) -> Shown:
    """Rendered by the project's simulator, with currents."""
    pose = Pose(position_m=(0.05, -0.03, 1.0), theta_x_deg=-6.0, theta_y_deg=11.0, roll_deg=4.0)
    scene = Scene(camera=CAMERA, dock=dock, pose=pose, lights=Lights(level=1500.0), seed=seed)
    scene_of = Approach(start_m=FAR_M, end_m=NEAR_M, frames=FRAMES, rate_hz=RATE_HZ, drift_m=0.004, drift_deg=1.0)
    for frame in film(FilmPlan(scene=scene, motion=scene_of)):
        yield frame.time_s, frame.image, (frame.truth.position_m, frame.truth.normal)


def drawn(dock: Dock, seed: int) -> Shown:
    """Drawn without the simulator: discs with halos, gamma and JPEG."""
    rng = np.random.default_rng([seed, 11])
    phases = rng.uniform(0, 2 * math.pi, 4)
    for number, z_m in enumerate(np.linspace(FAR_M, NEAR_M, FRAMES)):
        time_s = number / RATE_HZ
        sway = np.sin(2 * math.pi * time_s / 7 + phases)
        turn = rotation_from_angles(math.radians(-5 + 2 * sway[0]), math.radians(9 + 2 * sway[1]), math.radians(3))
        place = z_m * np.array([0.04 + 0.01 * sway[2], -0.02 + 0.01 * sway[3], 1.0])
        lamps_px, depths_m = rings_px(CAMERA, dock, place, turn)
        radii_px = np.maximum(CAMERA.fx * 0.004 / depths_m, 0.8)
        brightness = np.minimum(3.0, 3.0 * (1.5 / depths_m) ** 2 + 0.4)
        image = draw_lamps((CAMERA.width, CAMERA.height), lamps_px, radii_px, brightness, rng, ambient=0.02)
        yield time_s, image, (place, -turn[:, 2])


@pytest.mark.slow
@pytest.mark.parametrize("kind", DOCKS)
@pytest.mark.parametrize("shown", [simulated, drawn])
@pytest.mark.parametrize("seed", [1, 2])
def test_from_far_to_near(kind: str, shown: Callable[[Dock, int], Shown], seed: int):
    tracker = Tracker(CAMERA, DOCKS[kind])
    followed = [(tracker.see(image, time_s), *truth) for time_s, image, truth in shown(DOCKS[kind], seed)]
    seen = [each for each in followed if each[0].selected is not None]
    handed, worst = 0, 0.0
    for before, after in pairwise(seen):
        if before[0].estimate.rings != after[0].estimate.rings:
            handed += 1
            worst = max(worst, jump_in_sigmas(before, after))
    wrong = sum(not is_right(*each) for each in seen)
    names = [each[0].estimate.rings for each in seen]
    print(
        f"{kind}, {shown.__name__}, seed {seed}: {len(seen)} of {FRAMES} frames with a pose, {wrong} wrong; "
        f"{handed} changes of rings, the largest jump {worst:.1f} sigma; "
        f"{sum('far' in each for each in names)} with far, {sum('near' in each for each in names)} with near"
    )
    assert len(seen) >= LEAST_SHARE * FRAMES
    assert wrong == 0
    assert handed > 0
    assert worst < SIGMAS


def jump_in_sigmas(
    before: tuple[Tracked, np.ndarray, np.ndarray], after: tuple[Tracked, np.ndarray, np.ndarray]
) -> float:
    """How far a filtered pose jumps from the truth, per axis, over the standard error of the step."""
    offs, variances = [], []
    for tracked, place_m, normal in (before, after):
        assert tracked.step is not None
        assert tracked.step.after is not None
        pose = tracked.step.after.chains[tracked.chain or 0].pose(CAMERA, tracked.estimate.dock)
        assert pose.sigma_position_m is not None
        assert pose.sigma_theta_rad is not None
        offs.append(np.concatenate([pose.position_m - place_m, np.cross(normal, pose.normal)[:2]]))
        variances.append(np.square([*pose.sigma_position_m, *pose.sigma_theta_rad]))
    return float(np.max(np.abs(offs[1] - offs[0]) / np.sqrt(variances[0] + variances[1])))


def is_right(tracked: Tracked, place_m: np.ndarray, normal: np.ndarray) -> bool:
    """Whether the chosen pose is within 2 % of the range and 5 degrees of the truth."""
    pose = tracked.pose
    assert pose is not None
    off = float(np.linalg.norm(pose.position_m - place_m)) / float(np.linalg.norm(place_m))
    return off < 0.02 and math.degrees(math.acos(min(1.0, float(pose.normal @ normal)))) < 5
