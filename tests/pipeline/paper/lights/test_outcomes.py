import math

import numpy as np
import pytest
from dockpose.paper.lights.outcomes import (
    any_level_shows_the_lights,
    are_the_lights,
    group_centres,
    is_right,
    pose_errors,
    poses_of_all,
)
from dockpose.paper.lights.tank_scenes import near_ring
from dockpose.pose.circle import CirclePose
from dockpose.simulate import truth_of
from dockpose.thresholds import histogram_of

LIGHTS = np.array([[10.0, 10.0], [50.0, 10.0], [30.0, 40.0]])


def picture_with_groups():
    picture = np.zeros((40, 60), np.uint8)
    picture[9:12, 9:12] = 200  # centre (10, 10)
    picture[9:12, 49:52] = 120  # centre (50, 10)
    picture[30, 5] = 255
    return histogram_of(picture)


def test_points_are_the_lights_each_once_and_nothing_else():
    assert are_the_lights(LIGHTS[::-1] + 2.0, LIGHTS)
    assert not are_the_lights(LIGHTS[:2], LIGHTS)
    assert not are_the_lights(LIGHTS + [0, 4.1], LIGHTS)
    assert not are_the_lights(LIGHTS[[0, 0, 2]], LIGHTS)


def test_centres_of_groups_by_hand():
    histogram = picture_with_groups()
    np.testing.assert_allclose(group_centres(histogram, 100, 2), [[10, 10], [50, 10]])
    np.testing.assert_allclose(group_centres(histogram, 130, 2), [[10, 10]])
    assert len(group_centres(histogram, 130, 1)) == 2
    assert len(group_centres(histogram, 256, 1)) == 0


def test_some_level_shows_the_lights_or_none():
    histogram = picture_with_groups()
    assert any_level_shows_the_lights(histogram, LIGHTS[:2], 2)
    assert any_level_shows_the_lights(histogram, LIGHTS[:1], 2)
    assert not any_level_shows_the_lights(histogram, LIGHTS[1:2], 2)  # never alone: the other is brighter


def test_the_ellipse_through_the_exact_lights_has_the_true_pose():
    scene = near_ring(0)
    truth = truth_of(scene)
    poses = poses_of_all(truth.lights_px, scene.camera, scene.dock)
    assert sum(is_right(pose, truth) for pose in poses) == 1
    assert min(pose_errors(pose, truth)[1] for pose in poses) < 1e-3
    # A stray group pulls the ellipse away; four points have none.
    stray = np.vstack([truth.lights_px, [600.0, 450.0]])
    assert not any(is_right(pose, truth) for pose in poses_of_all(stray, scene.camera, scene.dock))
    assert poses_of_all(truth.lights_px[:4], scene.camera, scene.dock) == ()


def test_errors_of_a_pose_by_hand():
    truth = truth_of(near_ring(0))
    turned = np.cross(truth.normal, [1.0, 0, 0])
    turned /= np.linalg.norm(turned)
    angle = math.radians(4.0)
    normal = math.cos(angle) * truth.normal + math.sin(angle) * turned
    pose = CirclePose(truth.position_m + [0.003, 0.004, 0], normal, np.zeros(2))
    assert pose_errors(pose, truth) == pytest.approx((0.005, 4.0))
    assert is_right(pose, truth)  # within 5 degrees, and 27 mm at 0.9 m
    far = CirclePose(truth.position_m + [0.03, 0, 0], truth.normal, np.zeros(2))
    assert not is_right(far, truth)
