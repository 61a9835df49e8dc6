import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dockpose import Camera, Dock, Estimate, Settings
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.simulate import Pose, Scene, truth_of
from dockpose.study.judge import COLUMNS, ELAPSED, OUTCOMES, PRODUCT, as_text, find, judge, methods, scene_rows

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(0.30, 10)
TRUTH = truth_of(Scene(camera=CAMERA, dock=DOCK, pose=Pose(position_m=(0.0, 0.0, 2.0), theta_y_deg=20.0)))


def pose(position=(0.0, 0.0, 2.0), theta_y_deg=20.0, sigma_m=0.01, sigma_deg=1.0):
    normal = -rotation_from_angles(0.0, math.radians(theta_y_deg))[:, 2]
    sigma = math.radians(sigma_deg)
    return CirclePose(
        np.array(position), normal, np.zeros(2), 0.9, 0.1, 0.0, (sigma_m, sigma_m, sigma_m), (sigma, sigma)
    )


def found(*poses, status="ok"):
    choice = Choice(poses, 0, "spacing", None) if poses else None
    return Estimate(status, "", 640, 480, 8, CAMERA, DOCK, Settings(), choice=choice, detection=0.99 if poses else None)


def outcome(estimate, *, has_dock=True):
    row = judge(estimate, TRUTH, DOCK.radius, has_dock=has_dock)
    assert tuple(row) == COLUMNS
    return row


def test_right_within_5_percent_and_5_degrees():
    assert outcome(found(pose((0, 0, 2.099), 24.9)))["outcome"] == "success"
    assert outcome(found(pose((0, 0, 2.101), 20)))["outcome"] == "wrong pose"
    assert outcome(found(pose((0, 0, 2.0), 25.1)))["outcome"] == "wrong pose"
    assert outcome(found(pose((0, 0, 2.0), 25.1)))["position_right"]


def test_the_other_candidate_may_be_right():
    row = outcome(found(pose(theta_y_deg=-20), pose()))
    assert row["outcome"] == "wrong pose"
    assert (row["chosen_right"], row["either_right"], row["chosen_nearer"]) == (False, True, False)
    row = outcome(found(pose(), pose(theta_y_deg=-20)))
    assert (row["chosen_right"], row["either_right"], row["chosen_nearer"]) == (True, True, True)


def test_a_dock_beside_the_true_one_is_false():
    # The ring's radius of 0.15 m at 2 m is 4.3 degrees.
    assert outcome(found(pose((0.14, 0, 2.0))))["outcome"] == "wrong pose"
    assert outcome(found(pose((0.16, 0, 2.0))))["outcome"] == "false dock"
    assert outcome(found(pose((0.32, 0, 4.1))))["outcome"] == "false dock"


def test_without_a_dock_any_is_false():
    row = outcome(found(pose()), has_dock=False)
    assert row["outcome"] == "false dock"
    assert row["position_error_m"] is None
    assert row["detection"] == 0.99
    assert outcome(found(status="not_a_ring"), has_dock=False)["outcome"] == "correct refusal"
    assert outcome(found(status="not_a_ring"))["outcome"] == "refused"


def test_errors_by_hand():
    row = outcome(found(pose((0.03, 0.0, 2.04), 23.0)))
    assert row["position_error_m"] == pytest.approx(0.05)
    assert row["position_error_share"] == pytest.approx(0.025)
    assert row["angle_error_deg"] == pytest.approx(3.0)
    signed = [row[name] for name in ("error_x_m", "error_y_m", "error_z_m", "error_theta_x_deg", "error_theta_y_deg")]
    assert signed == pytest.approx([0.03, 0.0, 0.04, 0.0, 3.0])


def test_intervals_of_95_percent():
    row = outcome(found(pose((0.019, 0.02, 2.0), 21.9)))
    assert [row[f"{name}_in_95"] for name in ("x", "y", "z", "theta_x", "theta_y")] == [True, False, True, True, True]
    assert not outcome(found(pose(theta_y_deg=22.0)))["theta_y_in_95"]
    unknown = replace(pose(), sigma_position_m=None, sigma_theta_rad=None)
    row = outcome(found(unknown))
    assert row["x_in_95"] is None
    assert row["sigma_theta_x_deg"] is None


def untimed(rows):
    return [{name: as_text(value) for name, value in row.items() if name != ELAPSED} for row in rows]


@pytest.fixture(scope="module")
def rows():
    return scene_rows(1, 3)


def test_a_row_for_each_method_with_the_same_factors(rows):
    assert [row["method"] for row in rows] == methods()
    for name in ("scene", "seed", "range_m", "lit_share", "lights", "tilt_deg"):
        assert len({row[name] for row in rows}) == 1
    assert {row["outcome"] for row in rows} <= set(OUTCOMES)


def test_the_same_scene_gives_the_same_rows(rows):
    assert untimed(scene_rows(1, 3)) == untimed(rows)


def test_the_product_is_hats_with_its_fall_back(monkeypatch):
    asked = {}
    monkeypatch.setattr(
        "dockpose.study.judge.estimate", lambda image, camera, dock, settings, fall_back: (settings.method, fall_back)
    )
    for label in methods():
        picture: Any = SimpleNamespace(image=None, scene=SimpleNamespace(camera=None, dock=None))
        asked[label] = find(label, picture)
    assert asked.pop(PRODUCT) == ("hats", True)
    assert asked == {label: (label, False) for label in methods()[1:]}
    assert "hats" in asked
    assert "fixed" not in asked


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, ""), (float("nan"), ""), (True, "1"), (np.False_, "0"), (3, "3"), (1 / 3, "0.333333"), ("ok", "ok")],
)
def test_values_as_text(value, text):
    assert as_text(value) == text
