from dataclasses import replace

import pytest
from dockpose.app.errors import UserError
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.measured import MeasuredPose
from dockpose.app.state.poses import MEASURED_LIMITS, with_measured, with_pose_by_hand
from dockpose.pose.known import KnownPose


def test_pose_by_hand_is_used_and_said(view):
    other = analyse(view).estimate.candidates[1]
    found = analyse(with_pose_by_hand(view, other)).estimate
    assert found.choice is not None
    assert (found.choice.selected, found.choice.selected_by) == (1, "hand")
    assert "by hand" in found.message
    again = analyse(with_pose_by_hand(with_pose_by_hand(view, other), None)).estimate
    assert again.choice is not None
    assert (again.choice.selected, again.choice.selected_by) == (0, "spacing")


def test_measured_pose(view):
    values = dict(zip(MEASURED_LIMITS, (10, -20, 5000, 5, -90), strict=True))
    measured = with_measured(view, values)
    assert measured.measured == MeasuredPose(10, -20, 5000, 5, -90)
    assert measured.measured_pose == KnownPose((0.1, -0.2, 50.0), 5, -90)
    assert with_measured(view, None).measured is None
    for wrong in ("1", True, float("nan"), 5001):
        with pytest.raises(UserError, match="measured z"):
            with_measured(view, values | {"z (cm)": wrong})


def test_what_was_not_measured_is_blank_and_no_pose_is_made_of_it(view):
    assert with_measured(view, {}).measured == MeasuredPose()
    partly = with_measured(view, {"z (cm)": 110, "x (cm)": None})
    assert partly.measured == MeasuredPose(z_cm=110)
    assert (partly.measured_pose, replace(partly, truth=None).known_pose) == (None, None)
