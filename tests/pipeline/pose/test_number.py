import numpy as np
import pytest
from dockpose import Dock
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import find_poses

from tests.support.docks import CAMERA

ROTATION = rotation_from_angles(0.35, -0.4, 0.2)


def seen(lights, which, noise_px=0.05, seed=0):
    dock = Dock(0.30, lights)
    points = CAMERA.project(np.array([0.1, -0.05, 1.2]) + dock.light_points()[list(which)] @ ROTATION.T)
    return points + np.random.default_rng(seed).normal(0, noise_px, points.shape)


@pytest.mark.parametrize(
    ("lights", "out"), [(10, ()), (10, (3,)), (8, (0, 5)), (16, (2, 9)), (24, (7,)), (12, (1, 2, 3))]
)
def test_number_and_pose_follow_from_the_lights_that_are_lit(lights, out):
    _, choice = find_poses(seen(lights, np.delete(np.arange(lights), out)), CAMERA, Dock(0.30))
    assert choice.number == lights
    assert choice.decided
    assert choice.candidates[0].normal @ -ROTATION[:, 2] > np.cos(np.radians(2))


def test_a_whole_ring_is_not_every_second_light_of_another():
    _, choice = find_poses(seen(16, range(0, 16, 2)), CAMERA, Dock(0.30))
    assert choice.number == 8


def test_a_number_that_was_told_is_none_that_spacing_tells():
    assert find_poses(seen(10, range(9)), CAMERA, Dock(0.30, 10))[1].number is None


def test_lights_anywhere_on_a_circle_have_no_number():
    angles = np.array([0.0, 0.3, 0.9, 2.0, 2.1, 3.9, 4.4, 5.6, 5.75])
    ring = 0.15 * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    _, choice = find_poses(CAMERA.project(np.array([0.1, 0, 1.0]) + ring @ ROTATION.T), CAMERA, Dock(0.30))
    assert (choice.number, choice.selected_by, choice.decided) == (None, "none", False)
