import math

import numpy as np
import pytest
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose, pose_error, read_known_pose

TOLD = {"position_m": [0.0, 0.05, 0.9], "theta_x_deg": 25.0, "theta_y_deg": -20.0}
KNOWN = KnownPose((0.0, 0.05, 0.9), 25.0, -20.0)


def pose(position_m, theta_x_deg, theta_y_deg):
    tx, ty = math.radians(theta_x_deg), math.radians(theta_y_deg)
    normal = np.array([-math.cos(tx) * math.sin(ty), math.sin(tx), -math.cos(tx) * math.cos(ty)])
    return CirclePose(position_m=np.array(position_m), normal=normal, centre_px=np.zeros(2))


@pytest.mark.parametrize(
    ("found", "distance_cm", "angle_deg", "agrees"),
    [
        (pose([0.0, 0.05, 0.9], 25.0, -20.0), 0.0, 0.0, True),
        (pose([0.01, 0.05, 0.9], 27.9, -20.0), 1.0, 2.9, True),
        (pose([0.03, 0.05, 0.94], 25.0, -20.0), 5.0, 0.0, False),
        (pose([0.0, 0.05, 0.9], 21.0, -20.0), 0.0, 4.0, False),
    ],
)
def test_the_error_of_a_pose(found, distance_cm, angle_deg, agrees):
    error = pose_error(found, KNOWN)
    assert 100 * error.distance_m == pytest.approx(distance_cm, abs=1e-9)
    assert math.degrees(error.angle_rad) == pytest.approx(angle_deg, abs=1e-6)
    assert error.agrees is agrees
    assert str(error) == f"off by {distance_cm:.1f} cm, {angle_deg:.1f} deg"


@pytest.mark.parametrize(
    "truth",
    [
        None,
        "here",
        {},
        {"position_m": [1, 2, 3]},
        {"position_m": [0, 1]},
        TOLD | {"position_m": ["a", 1, 2]},
        TOLD | {"theta_x_deg": math.nan},
        TOLD | {"position_m": [0, 0, math.inf]},
    ],
)
def test_what_is_no_truth_is_not_read(truth):
    assert read_known_pose(truth) is None
    assert read_known_pose(TOLD | {"normal": [0, 0, -1], "visible": [True]}) == KNOWN


@pytest.mark.parametrize("quarters", [0, 1, 2, 3, 4])
def test_in_a_picture_turned_clockwise_what_was_right_is_below(quarters):
    turn = np.linalg.matrix_power(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]), quarters)
    told = KNOWN.rotated(90 * quarters)
    np.testing.assert_allclose(told.position_m, turn @ KNOWN.position_m, atol=1e-12)
    np.testing.assert_allclose(told.rotation[:, 2], turn @ KNOWN.rotation[:, 2], atol=1e-12)


def test_no_error_without_a_known_or_an_estimated_pose():
    assert pose_error(pose([0.0, 0.05, 0.9], 25.0, -20.0), None) is None
    assert pose_error(None, KNOWN) is None
