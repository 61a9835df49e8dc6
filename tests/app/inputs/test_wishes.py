import pytest
from dockpose.app.errors import UserError
from dockpose.app.inputs.wishes import wishes_from
from dockpose.sources import Wishes

NAMES = {"exposure": "Exposure", "gain": "Gain", "rate_hz": "Frames a second", "format": "Format"}


def given(**values):
    return {"exposure": None, "gain": "", "rate_hz": " ", "format": None} | values


def test_what_is_left_blank_is_left_to_the_camera():
    assert wishes_from(given(), NAMES) == Wishes()


def test_text_and_numbers_are_taken():
    typed = given(exposure="120", gain=2.5, rate_hz="30", format=" mjpg ")
    assert wishes_from(typed, NAMES) == Wishes(exposure=120, gain=2.5, rate_hz=30, format="MJPG")


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"exposure": "long"}, "Exposure is 'long'; it must be a number"),
        ({"gain": "inf"}, "Gain is inf; it must be a number"),
        ({"rate_hz": "-3"}, "Frames a second is -3; it must be above 0 and at most 1000"),
        ({"format": "a b"}, "Format A B: must be the three or four letters"),
    ],
)
def test_what_no_camera_can_give_is_refused_by_its_name(values, sentence):
    with pytest.raises(UserError, match=sentence):
        wishes_from(given(**values), NAMES)
