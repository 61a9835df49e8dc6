import math

import numpy as np
import pytest
from dockpose.camera import FlatPort
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import find_poses
from msgspec.structs import replace

from tests.support.docks import CAMERA, nominal, uneven


def seen(dock, camera, seed, noise_px=0.0):
    """Lights in the picture, and the pose, of a dock anywhere in view."""
    rng = np.random.default_rng(seed)
    roll = float(rng.uniform(0, 2 * math.pi))
    theta_x, theta_y = np.radians(rng.uniform(-30, 30, 2)).tolist()
    rotation = rotation_from_angles(theta_x, theta_y, roll)
    place = np.array([*rng.uniform(-0.2, 0.2, 2), rng.uniform(1, 2)])
    points_px = camera.project(dock.light_points() @ rotation.T + place)
    return points_px + rng.normal(0, noise_px, points_px.shape), rotation, place, roll


@pytest.mark.parametrize("camera", [CAMERA, replace(CAMERA, port=FlatPort(0.02, 0.005))], ids=["air", "port"])
@pytest.mark.parametrize("seed", range(4))
def test_without_noise_the_pose_is_exact_and_the_roll_known(camera, seed):
    dock = uneven(seed)
    points_px, rotation, place, roll = seen(dock, camera, seed)
    _, choice = find_poses(points_px, camera, dock)
    pose = choice.candidates[0]
    assert pose.position_m == pytest.approx(place, abs=2e-5)
    assert pose.normal == pytest.approx(-rotation[:, 2], abs=1e-4)
    assert pose.roll_rad is not None
    assert math.remainder(pose.roll_rad - roll, 2 * math.pi) == pytest.approx(0, abs=1e-3)
    assert choice.lights is not None
    assert choice.lights.tolist() == list(range(10))


def test_the_pose_is_better_than_by_the_nominal_dock():
    dock, errors = uneven(0), []
    for seed in range(30):
        points_px, rotation, _, _ = seen(dock, CAMERA, seed, noise_px=0.1)
        normals = [find_poses(points_px, CAMERA, each)[1].candidates[0].normal for each in (nominal(dock), dock)]
        errors.append([np.linalg.norm(normal + rotation[:, 2]) for normal in normals])
    by_nominal, by_learned = np.sqrt(np.mean(np.square(errors), axis=0))
    assert by_learned < 0.8 * by_nominal


def test_the_roll_of_a_far_dock_stays_modulo_the_spacing():
    dock = uneven(1, off_m=0.1e-3)
    points_px, _, _, _ = seen(dock, CAMERA, 1, noise_px=0.3)
    pose = find_poses(points_px, CAMERA, dock)[1].candidates[0]
    assert pose.roll_rad is not None
    assert pose.roll_rad < 2 * math.pi / 10
