import math
from dataclasses import replace

import numpy as np
import pytest
from dockpose import Camera, Dock, Estimate, Settings
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.pose.uncertainty import PoseErrors
from dockpose.simulate import Pose, Scene, truth_of
from dockpose.study import judge as judging
from dockpose.study.judge import COLUMNS, OUTCOMES, PRODUCT, as_text, judge, judge_choice, methods, scene_rows

from tests.support.judged import judged

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(0.30, 10)
TRUTH = truth_of(Scene(camera=CAMERA, dock=DOCK, pose=Pose(position_m=(0.0, 0.0, 2.0), theta_y_deg=20.0)))


def pose(position=(0.0, 0.0, 2.0), theta_y_deg=20.0):
    normal, sigma = -rotation_from_angles(0.0, math.radians(theta_y_deg))[:, 2], math.radians(1.0)
    return CirclePose(np.array(position), normal, np.zeros(2), 0.9, 0.1, 0.0, (0.01, 0.01, 0.01), (sigma, sigma))


def sure(position=(0.0, 0.0, 2.0), theta_y_deg=20.0):
    return replace(pose(position, theta_y_deg), probability=0.97)


def found_of(*poses, detection=0.99):
    choice = Choice(poses, 0, "spacing", None) if poses else None
    known = {"choice": choice, "detection": detection} if poses else {}
    return Estimate("ok" if poses else "not_a_ring", "", 640, 480, 8, CAMERA, DOCK, Settings(), **known)


def row_of(*poses, has_dock=True):
    row = judge(found_of(*poses), TRUTH, DOCK.radius, has_dock=has_dock)
    assert tuple(row) == COLUMNS
    return row


@pytest.mark.parametrize(
    ("position", "theta_y_deg", "outcome"),
    [
        # Right within 5 per cent and 5 degrees.
        ((0, 0, 2.099), 24.9, "success"),
        ((0, 0, 2.101), 20, "wrong pose"),
        ((0, 0, 2.0), 25.1, "wrong pose"),
        # Beside the true one by more than the ring's radius of 0.15 m, at 2 m 4.3 degrees.
        ((0.14, 0, 2.0), 20, "wrong pose"),
        ((0.16, 0, 2.0), 20, "false dock"),
        ((0.32, 0, 4.1), 20, "false dock"),
    ],
)
def test_outcome_by_physics(position, theta_y_deg, outcome):
    assert row_of(pose(position, theta_y_deg))["outcome"] == outcome
    without = row_of(pose(position, theta_y_deg), has_dock=False)
    assert (without["outcome"], without["position_error_m"], without["detection"]) == ("false dock", None, 0.99)


def test_what_is_not_found_is_refused():
    assert row_of()["outcome"] == "refused"
    assert row_of(has_dock=False)["outcome"] == "correct refusal"


def test_the_other_candidate_may_be_right():
    keys = ("outcome", "chosen_right", "either_right", "chosen_nearer", "position_right")
    right, other = pose(), pose(theta_y_deg=-20)
    assert [row_of(other, right)[key] for key in keys] == ["wrong pose", False, True, False, True]
    assert [row_of(right, other)[key] for key in keys] == ["success", True, True, True, True]
    for chosen in (0, 1):
        errors, is_chosen = judge_choice(Choice((other, right), chosen, "", None), TRUTH.position_m, TRUTH.normal)
        assert errors == pytest.approx([0.0] * 5)
        assert is_chosen == bool(chosen)


@pytest.mark.parametrize(
    ("first", "other", "detection", "outcome", "nearer", "near"),
    [
        (pose(), pose(theta_y_deg=-20), 0.99, "right", True, True),
        (pose(theta_y_deg=-20), pose(), 0.99, "undecided", False, True),  # 0.90 x 0.99 is not sure
        (pose(theta_y_deg=-20), pose(theta_y_deg=-30), 0.99, "wrong", True, True),
        (pose((0, 0, 2.2)), pose((0, 0, 2.2), -20), 0.99, "wrong", True, False),
        (sure(theta_y_deg=-20), pose(), 0.99, "sure", False, True),
        (sure(theta_y_deg=-20), pose(), 0.90, "undecided", False, True),
        (pose(), pose(), 0.99, "right", True, True),  # both the same
    ],
)
def test_one_judgement_of_the_chosen_pose(first, other, detection, outcome, nearer, near):
    came = judged(found_of(first, other, detection=detection), TRUTH.position_m, TRUTH.normal)
    assert (came.found, came.outcome, came.nearer, came.near) == (True, outcome, nearer, near)
    assert came.undecided == (first.probability < 0.95)
    refused = judged(found_of(), TRUTH.position_m, TRUTH.normal)
    assert (refused.found, refused.outcome, refused.sure, refused.undecided) == (False, "refused", False, False)


def test_intervals_are_those_of_the_nearer_pose_and_none_holds_nothing():
    nearer, other = pose((0.03, 0.0, 2.0), 23.0), pose(theta_y_deg=-20)
    # x is off by 3 of its sigmas; theta_y by 3 degrees, less than 1.96 x 2 and more than 1.96 x 1.
    for sigma_deg, holds in ((2.0, True), (1.0, False)):
        covariance = np.diag(np.square([0.01, 0.01, 0.01, *[math.radians(sigma_deg)] * 2, 1.0]))
        known = replace(nearer, errors=PoseErrors(covariance, rotation_from_angles(0.0, math.radians(23))))
        came = judged(found_of(other, known), TRUTH.position_m, TRUTH.normal)
        assert came.holds == (False, True, True, True, holds)
    assert judged(found_of(pose(), other), TRUTH.position_m, TRUTH.normal).holds == (False,) * 5


def test_errors_and_intervals_by_hand():
    row = row_of(pose((0.019, -0.02, 2.015), 22.9))
    errors = row["position_error_m"], row["position_error_share"], row["angle_error_deg"]
    off_m = math.hypot(0.019, 0.02, 0.015)
    assert errors == pytest.approx((off_m, off_m / 2, 2.9))
    signed = [row[name] for name in COLUMNS if name.startswith("error_")]
    assert signed == pytest.approx([0.019, -0.02, 0.015, 0.0, 2.9])
    # 1.96 standard errors of a centimetre and a degree.
    assert [row[f"{name}_in_95"] for name in judging.UNITS] == [True, False, True, True, False]
    unknown = row_of(replace(pose(), sigma_position_m=None, sigma_theta_rad=None))
    assert (unknown["x_in_95"], unknown["sigma_theta_x_deg"]) == (None, None)


def test_a_row_for_each_method_with_the_same_factors_and_again_the_same(monkeypatch):
    asked, estimate = [], judging.estimate
    monkeypatch.setattr(
        judging, "estimate", lambda *of, fall_back: asked.append((of[-1].method, fall_back)) or estimate(*of)
    )
    one, two = scene_rows(1, 3), scene_rows(1, 3)
    assert asked == [("hats", True), *((label, False) for label in methods()[1:])] * 2
    assert methods()[0] == PRODUCT
    assert "fixed" not in methods()
    assert [row["method"] for row in one] == methods()
    for name in ("scene", "seed", "range_m", "lit_share", "lights", "tilt_deg"):
        assert len({row[name] for row in one}) == 1
    assert {row["outcome"] for row in one} <= set(OUTCOMES)
    assert one == two


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, ""), (float("nan"), ""), (True, "1"), (np.False_, "0"), (3, "3"), (1 / 3, "0.333333"), ("ok", "ok")],
)
def test_values_as_text(value, text):
    assert as_text(value) == text
