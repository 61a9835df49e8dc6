import math

import numpy as np
import pytest
from dockpose import Dock
from dockpose.lights.ellipse import fit_ellipse
from dockpose.paper.lights.levels import centres
from dockpose.paper.tables import TABLES
from dockpose.pose.circle import circle_poses, rotation_from_angles

from tests.support.scenes import CAMERA


def seen(position_m, theta_x, theta_y):
    ring = Dock(0.30, 12).light_points() @ rotation_from_angles(theta_x, theta_y).T
    return CAMERA.project(np.array(position_m) + ring)


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
