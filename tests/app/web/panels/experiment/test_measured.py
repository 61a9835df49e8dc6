import pytest
from dockpose.app.state.measured import MeasuredPose
from dockpose.app.web.panels.experiment.measured import (
    BLANK,
    after_change,
    measured_of,
    texts_of,
    texts_of_pose,
    values_of,
)

from tests.support.rows import changed


@pytest.mark.parametrize("typed", ["a metre", "1 2", "nan", "inf", "1,234.5"])
def test_what_is_no_number_is_named(typed):
    with pytest.raises(ValueError, match=r"Measured θy \(°\) is '.*'; it must be a number"):
        values_of(BLANK | {"measured_theta_y_deg": typed})


def test_boxes_show_what_a_row_has():
    texts = texts_of(changed(measured_z_cm=110.25, distance_cm=120.0, notes="n"))
    assert (texts["measured_x_cm"], texts["measured_z_cm"], texts["distance_cm"]) == ("", "110.25", "120")
    values = values_of(texts | {"measured_x_cm": " 1,5 "})
    assert [values[name] for name in ("measured_x_cm", "measured_y_cm", "measured_z_cm")] == [1.5, None, 110.25]
    assert values["notes"] == "n"
    assert (measured_of(values).x_cm, measured_of(values).distance_cm) == (1.5, 120)
    pose = texts_of_pose(MeasuredPose(1, -2, 110, 0, -5))
    assert list(pose.values()) == ["1", "-2", "110", "0", "-5", "", ""]


def test_boxes_follow_the_pose_that_is_measured_but_never_lose_what_was_typed():
    typed = BLANK | {"measured_z_cm": "110", "notes": "n"}
    ticked = after_change(typed, None, MeasuredPose())  # ticked, and nothing measured yet
    assert ticked == typed
    one = after_change(ticked, MeasuredPose(), MeasuredPose(x_cm=0))
    assert (one["measured_x_cm"], one["measured_z_cm"], one["measured_y_cm"]) == ("0", "110", "")
    assert after_change(one, MeasuredPose(x_cm=0), None) == typed
    assert measured_of(values_of(BLANK)).z_cm is None
