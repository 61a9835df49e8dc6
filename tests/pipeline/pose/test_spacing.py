import math

import numpy as np
import pytest
from dockpose import Dock
from dockpose.camera import FlatPort
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import find_poses
from dockpose.pose.spacing import place
from msgspec.structs import replace

from tests.support.docks import CAMERA, nominal, uneven

TEN = Dock(0.3, 10)
UNEVEN = Dock(0.3, angles_deg=(0, 30, 100, 160, 200, 290))


def test_even_lights_are_numbered_in_turn():
    points = np.radians([5 + 36 * light for light in (0, 1, 3, 9)])
    placement = place(points[None], TEN)
    assert placement.fits == [True]
    steps = (placement.lights[0] - placement.lights[0, 0]) % 10
    assert steps.tolist() == [0, 1, 3, 9]
    assert placement.period_rad == pytest.approx(math.pi / 5)
    np.testing.assert_allclose(np.exp(1j * placement.angles_rad[0]), np.exp(1j * points), atol=1e-9)


def test_each_candidate_is_judged_by_itself():
    good = np.radians([5 + 36 * light for light in range(10)])
    bad = good + np.radians(20) * np.sin(good)
    assert place(np.array([good, bad]), TEN).fits == [True, False]


def test_two_points_at_one_light_do_not_fit():
    assert place(np.radians([[0, 36, 72, 74, 144]]), TEN).fits == [False]


@pytest.mark.parametrize("turn", [0.0, 1.0, 3.0, 5.5])
def test_uneven_lights_tell_their_numbers_and_the_whole_roll(turn):
    which = [5, 0, 1, 3]
    points = np.radians(UNEVEN.angles_deg)[which] + turn + np.array([0.01, -0.01, 0.005, 0.0])
    placement = place(points[None], UNEVEN)
    assert placement.fits == [True]
    assert placement.lights[0].tolist() == which
    assert placement.rolls_rad[0] % (2 * math.pi) == pytest.approx(turn, abs=0.01)
    assert placement.period_rad == pytest.approx(2 * math.pi)


def test_even_points_do_not_fit_an_uneven_dock():
    assert place(np.radians([[0, 60, 120, 180, 240, 300]]), UNEVEN).fits == [False]


def test_one_red_light_breaks_the_symmetry():
    dock = Dock(0.3, colours=("red", *["white"] * 9))
    points = np.radians([36.0 * light + 100 for light in range(10)])[None]
    labels = ["white"] * 10
    labels[4] = "red"
    placement = place(points, dock, labels)
    assert placement.lights[0].tolist() == [(light - 4) % 10 for light in range(10)]
    assert placement.rolls_rad[0] % (2 * math.pi) == pytest.approx(math.radians(100 + 144))


def test_colours_that_cannot_be_told_leave_the_roll_open():
    dock = Dock(0.3, colours=("red", *["white"] * 9))
    placement = place(np.radians([36.0 * light for light in range(10)])[None], dock, [None] * 10)
    assert placement.period_rad == pytest.approx(math.pi / 5)


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
