import math

import numpy as np
import pytest
from dockpose import Dock
from dockpose.lights.ellipse import fit_ellipse
from dockpose.paper import tables
from dockpose.paper.tables import TABLES, numbers_of, reproduced
from dockpose.pose.circle import CirclePose, circle_poses, rotation_from_angles

from tests.support.scenes import CAMERA


def test_numbers_as_the_tables_have_them():
    normal = np.array([-np.sin(np.radians(20)), 0.0, -np.cos(np.radians(20))])
    pose = CirclePose(np.array([0.08, -0.155, 1.45]), normal, np.zeros(2))
    assert numbers_of(pose) == pytest.approx([8, -15.5, 145, 0, 20])
    assert np.isnan(numbers_of(None)).all()


def test_the_tables_by_hand():
    assert [table.dock.lights for table in TABLES.values()] == [10, 10, 12]
    colours = TABLES["4"].colours
    assert (len(colours), colours.count("red"), colours.count("blue"), TABLES["2"].colours) == (12, 2, 2, ())
    # Table 4, two rows: z 139.9 for 137 and 87.8 for 85.
    assert TABLES["4"].mean_errors[2] == pytest.approx((2.9 + 2.8) / 2)
    assert TABLES["2"].mean_errors[4] == pytest.approx((0.2 + 0.3 + 0.1 + 0.5 + 0.2) / 5)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["2", "4"])
def test_a_table_comes_back_from_its_pictures(name, monkeypatch):
    monkeypatch.setattr(tables, "DRAWS", 2)
    found, again, other = (list(reproduced(name, seed)) for seed in (4, 4, 5))
    for (ours, epnp, right), same, row, measured in zip(found, again, other, TABLES[name].measured, strict=True):
        # Centres known to 0.03 px of ten lights around 67 px or more: some hundredths of a per cent of the range.
        np.testing.assert_allclose(ours, [measured] * 2, atol=0.15)
        # OpenCV's EPnP puts a flat ring far too far away at times, in the right direction.
        nearer = np.argmin(np.abs(epnp[:, 2] - measured[2]))
        np.testing.assert_allclose(epnp[nearer, :3], measured[:3], rtol=0.1, atol=2)
        assert right.all()
        np.testing.assert_array_equal(ours, same[0])
        assert (row[0] != ours).all()


def test_the_true_centre_is_neither_the_ellipse_s_nor_the_lights_middle():
    ring = Dock(0.30, 12).light_points() @ rotation_from_angles(math.radians(30), 0.0).T
    points = CAMERA.project(np.array([0.0, 0.0, 1.0]) + ring)
    ellipse = fit_ellipse(points)
    pose = max(circle_poses(ellipse, CAMERA, 0.30), key=lambda pose: pose.normal[1])
    np.testing.assert_allclose(pose.centre_px, [319.5, 239.5], atol=1e-6)
    # 2.7 to 7 px, says docs/method.md, for 10 to 30 degrees at 1 m
    assert math.dist(ellipse.centre_px, pose.centre_px) == pytest.approx(7, abs=1)
    assert math.dist(points[:-3].mean(axis=0), pose.centre_px) > 20
