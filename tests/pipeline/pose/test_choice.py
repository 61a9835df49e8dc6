# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalOperand=false, reportOperatorIssue=false, reportCallIssue=false, reportArgumentType=false

import numpy as np
import pytest
from dockpose import Dock
from dockpose.lights.ellipse import fit_ellipse
from dockpose.pose.choice import choose_by_spacing
from dockpose.pose.circle import circle_poses, rotation_from_angles

from tests.support.scenes import CAMERA

DOCK = Dock(0.30, 10)


def seen(position_m, theta_x, theta_y, roll=0.2, dock=DOCK, skip=(), noise_px=0.0, seed=0):
    rotation = rotation_from_angles(theta_x, theta_y)
    turn = np.array([[np.cos(roll), -np.sin(roll), 0], [np.sin(roll), np.cos(roll), 0], [0, 0, 1]])
    points = np.array(position_m) + dock.light_points() @ (rotation @ turn).T
    points = CAMERA.project(np.delete(points, skip, axis=0))
    return points + np.random.default_rng(seed).normal(0, 1, points.shape) * noise_px, -rotation[:, 2]


def choose(points, dock=DOCK):
    return choose_by_spacing(circle_poses(fit_ellipse(points), CAMERA, dock.diameter), points, CAMERA, dock)


@pytest.mark.parametrize("angles", [(0.3, 0.5), (-0.3, 0.5), (0.6, -0.1), (0.0, 0.35)])
@pytest.mark.parametrize("skip", [(), (3,), (0, 5, 6)])
def test_even_spacing_tells_the_right_pose(angles, skip):
    points, normal = seen((0.1, -0.05, 1.2), *angles, skip=skip)
    choice = choose(points)
    assert choice.selected_by == "spacing"
    first, second = choice.candidates
    np.testing.assert_allclose(first.normal, normal, atol=1e-6)
    assert first.probability > 0.99
    assert first.probability + second.probability == pytest.approx(1)
    assert first.rms_px < 1e-4 < second.rms_px


def test_roll_comes_back_modulo_the_spacing():
    points, _ = seen((0.1, -0.05, 1.2), 0.3, 0.5, roll=0.2)
    assert choose(points).candidates[0].roll_rad == pytest.approx(0.2, abs=1e-5)
    points, _ = seen((0.1, -0.05, 1.2), 0.3, 0.5, roll=0.2 + 3 * np.pi / 5)
    assert choose(points).candidates[0].roll_rad == pytest.approx(0.2, abs=1e-5)


def test_lights_are_numbered_around_the_ring():
    points, _ = seen((0.1, -0.05, 1.2), 0.3, 0.5, skip=(4,))
    numbers = choose(points).lights
    steps = np.diff(numbers) % 10
    assert steps.tolist() == [1, 1, 1, 2, 1, 1, 1, 1]


def test_a_far_dock_is_a_coin_toss_and_says_so():
    # 12 m, 10 degrees, 0.3 px: right in 55 % of trials, however it is computed.
    chances = []
    for seed in range(20):
        points, _ = seen((0.1, 0.1, 12.0), 0.0, np.radians(10), noise_px=0.3, seed=seed)
        chances.append(choose(points).candidates[0].probability)
    assert np.median(chances) < 0.8


def test_the_likelier_is_right_as_often_as_the_reference_says():
    # shared reference, 10 of 10 lights, 3 m, 10 degrees, 0.3 px: 0.90 of trials; 200 trials scatter by 0.02.
    right = 0
    for seed in range(200):
        points, normal = seen((0.0, 0.0, 3.0), np.radians(10), 0.0, roll=seed, noise_px=0.3, seed=seed)
        first, second = choose(points).candidates
        right += first.normal @ normal > second.normal @ normal
    assert right / 200 > 0.90 - 3 * 0.02


def test_uneven_lights_leave_it_open():
    dock = Dock(0.30, 8)
    angles = np.array([0.0, 0.3, 0.9, 2.0, 2.1, 3.9, 4.4, 5.6])
    ring = 0.15 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = CAMERA.project(np.array([0.1, 0, 1.0]) + ring @ rotation_from_angles(0.3, 0.4).T)
    choice = choose(points, dock)
    assert choice.selected_by == "none"
    assert [pose.probability for pose in choice.candidates] == [0.5, 0.5]
    assert choice.lights is None


def test_an_unknown_number_of_lights_is_taken_to_be_what_is_seen():
    points, normal = seen((0.1, -0.05, 1.2), 0.3, 0.5)
    choice = choose(points, Dock(0.30))
    assert choice.selected_by == "spacing"
    np.testing.assert_allclose(choice.candidates[0].normal, normal, atol=1e-6)


def test_an_unknown_number_with_lights_missing_is_left_open():
    points, _ = seen((0.1, -0.05, 1.2), 0.3, 0.5, skip=(2, 3, 7))
    assert choose(points, Dock(0.30)).selected_by == "none"
