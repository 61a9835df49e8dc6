import math

import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.lights.ellipse import ellipse_from_conic, fit_ellipse
from dockpose.paper.baselines import centres, hong_poses
from dockpose.paper.tables import TABLES
from dockpose.pose.circle import circle_poses, rotation_from_angles

from tests.support.scenes import CAMERA


def seen(position_m, theta_x, theta_y):
    ring = Dock(0.30, 12).light_points() @ rotation_from_angles(theta_x, theta_y).T
    return CAMERA.project(np.array(position_m) + ring)


def test_hong_is_right_square_on_by_hand():
    # A circle of 70 px at f = 700 px is 10 radii away: 1.5 m.
    camera = Camera(700, 700, 320, 240, 640, 480)
    ellipse = ellipse_from_conic([1, 0, 1, -640, -480, 320**2 + 240**2 - 70**2])
    for pose in hong_poses(ellipse, camera, 0.30):
        np.testing.assert_allclose(pose.position_m, [0, 0, 1.5], atol=1e-9)
        np.testing.assert_allclose(pose.normal, [0, 0, -1], atol=1e-6)


def test_hong_is_nearly_right_far_away_and_wrong_nearby():
    errors = {}
    for z in (0.7, 30.0):
        points = seen((0.0, 0.0, z), 0.5, 0.0)
        poses = hong_poses(fit_ellipse(points), CAMERA, 0.30)
        truth = -rotation_from_angles(0.5, 0.0)[:, 2]
        errors[z] = min(np.degrees(math.acos(min(1.0, pose.normal @ truth))) for pose in poses)
    assert errors[30.0] < 0.1
    assert errors[0.7] > 0.2


def test_the_true_centre_is_neither_the_ellipse_s_nor_the_lights_middle():
    points = seen((0.0, 0.0, 1.0), math.radians(30), 0.0)
    ellipse = fit_ellipse(points)
    pose = max(circle_poses(ellipse, CAMERA, 0.30), key=lambda pose: pose.normal[1])
    _, of_ellipse, of_pose = centres(points, ellipse, pose)
    np.testing.assert_allclose(of_pose, [319.5, 239.5], atol=1e-6)
    # 2.7 to 7 px, says docs/method.md, for 10 to 30 degrees at 1 m
    assert np.linalg.norm(of_ellipse - of_pose) == pytest.approx(7, abs=1)
    mass_moment, *_ = centres(points[:-3], ellipse, pose)
    assert np.linalg.norm(mass_moment - of_pose) > 20


def test_the_paper_s_errors_by_hand():
    # Table 4, two rows: z 139.9 for 137 and 87.8 for 85.
    assert TABLES["4"].mean_errors[2] == pytest.approx((2.9 + 2.8) / 2)
    assert TABLES["2"].mean_errors[4] == pytest.approx((0.2 + 0.3 + 0.1 + 0.5 + 0.2) / 5)
