import pytest
from dockpose.app.errors import UserError
from dockpose.app.state.measured import MeasuredPose, number_text, typed_number
from dockpose.pose.known import KnownPose


@pytest.mark.parametrize(
    ("text", "number"), [("", None), (" ", None), ("0", 0), (" 1,5 ", 1.5), ("−4", -4), ("-.5", -0.5), ("007", 7)]
)
def test_blank_is_never_zero_and_zero_never_blank(text, number):
    assert typed_number("z", text) == number
    assert number is None or typed_number("z", number_text(number)) == number


@pytest.mark.parametrize("text", ["T", "1t", "-", "1e400", "nan", "1 2", "1.2.3"])
def test_what_is_no_number_is_refused_by_name(text):
    with pytest.raises(UserError, match=r"^Measured z is .*it must be a number"):
        typed_number("Measured z", text)


@pytest.mark.parametrize("text", ["-", "−", ".", "-,"])
def test_number_that_is_still_typed_is_blank(text):
    assert typed_number("z", text, is_finished=False) is None


def test_only_a_whole_pose_is_one():
    assert MeasuredPose(1, 2, 3, 4, 5).pose == KnownPose((0.01, 0.02, 0.03), 4, 5)
    for missing in MeasuredPose.__struct_fields__:
        values = dict.fromkeys(MeasuredPose.__struct_fields__, 1.0) | {missing: None}
        assert MeasuredPose(**values).pose is None
