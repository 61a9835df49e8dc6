import math

import numpy as np
import pytest
from dockpose import Dock
from dockpose.lights.ellipse import fit_ellipse
from dockpose.paper.lights.levels import centres
from dockpose.paper.tables import TABLES, numbers_of, reproduce_row, table_dock
from dockpose.pose.circle import CirclePose, circle_poses, rotation_from_angles

from tests.support.scenes import CAMERA


def test_numbers_as_the_tables_have_them():
    normal = np.array([-np.sin(np.radians(20)), 0.0, -np.cos(np.radians(20))])
    pose = CirclePose(np.array([0.08, -0.155, 1.45]), normal, np.zeros(2))
    assert numbers_of(pose) == pytest.approx([8, -15.5, 145, 0, 20])
    assert np.isnan(numbers_of(None)).all()


def test_docks_of_the_tables():
    assert [table_dock(name).lights for name in TABLES] == [10, 10, 12]
    assert table_dock("4").colours.count("red") == table_dock("4").colours.count("blue") == 2
    assert not table_dock("2").colours


@pytest.mark.slow
@pytest.mark.parametrize(("name", "number"), [("2", 3), ("4", 0)])
def test_a_row_comes_back_from_its_pictures(name, number):
    row = reproduce_row(name, number, seed=4, draws=2)
    measured = TABLES[name].measured[number]
    # Centres known to 0.03 px of ten lights around 67 px or more: some hundredths of a per cent of the range.
    np.testing.assert_allclose(row.ours, [measured] * 2, atol=0.1)
    assert row.right.all()
    again = reproduce_row(name, number, seed=4, draws=2)
    np.testing.assert_array_equal(row.ours, again.ours)
    assert (reproduce_row(name, number, seed=5, draws=2).ours != row.ours).all()


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
