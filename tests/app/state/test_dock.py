import math
from dataclasses import replace

import pytest
from dockpose import Dock
from dockpose.app.errors import UserError
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.dock import angles_text, dropped_sentence, with_angles, with_lights

UNEVEN = (0.0, 30.0, 75.0, 120.0, 180.0, 250.5, 300.0)


@pytest.mark.parametrize("value", [math.nan, "8", None, True, [8]])
def test_number_of_lights_that_is_no_number_is_refused(view, value):
    with pytest.raises(UserError, match="must be a number"):
        with_lights(view, value)


def with_dock(view, **values):
    return replace(view, dock=Dock(0.3, **values))


@pytest.mark.parametrize("text", ["0, 36, 72", "0 36 72", "0;36;72;", " 0°, 36° , 72°", "0\n36,,72.0"])
def test_angles_are_read_and_the_number_of_lights_follows(view, text):
    dock = with_angles(view, text).dock
    assert (dock.angles_deg, dock.lights, dock.diameter) == ((0, 36, 72), 3, view.dock.diameter)
    assert angles_text(dock) == "0, 36, 72"


def test_text_of_angles_is_read_back(view):
    text = angles_text(Dock(0.3, angles_deg=UNEVEN))
    assert text == "0, 30, 75, 120, 180, 250.5, 300"
    assert with_angles(view, text).dock.angles_deg == UNEVEN


@pytest.mark.parametrize("text", ["", "  ", " , "])
def test_blank_is_evenly_spaced_with_as_many_lights(view, text):
    dock = with_angles(with_dock(view, angles_deg=UNEVEN), text).dock
    assert dock == Dock(0.3, 7)
    assert angles_text(dock) == ""


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0, 36, top", "A light angle is 'top'; it must be a number of degrees"),
        ("0, nan, 3", "A light angle is 'nan'"),
        ("0, 1e999, 3", "A light angle is '1e999'"),
        ("90", "There is 1 light angle; a dock has 3 to 60"),
        ("0, 90", "There are 2 light angles; a dock has 3 to 60"),
        (", ".join(map(str, range(0, 305, 5))), "There are 61 light angles"),
        ("0, 90, 360", "two lights at 0 degrees"),
        ("1" * 1001, "at most 1000"),
        (None, "at most 1000"),
        (36, "at most 1000"),
    ],
)
def test_angles_that_cannot_be_are_refused_in_a_sentence(view, text, words):
    with pytest.raises(ValueError, match=words) as refused:
        with_angles(view, text)
    assert str(refused.value).count("\n") == 0


def test_colours_stay_as_long_as_there_are_as_many(view):
    coloured = with_dock(view, colours=("red", "green", "blue"))
    assert with_angles(coloured, "0, 100, 200").dock.colours == ("red", "green", "blue")
    assert with_angles(coloured, "0, 100, 200, 300").dock.colours == ()


@pytest.mark.parametrize("number", [4, 8, 0])
def test_another_number_of_lights_drops_what_no_longer_fits_and_says_so(view, number):
    for values, word in (({"angles_deg": UNEVEN}, "7 angles"), ({"colours": ("red", "green", "blue")}, "3 colours")):
        before = with_dock(view, **values)
        after = with_lights(before, number)
        assert after.dock == Dock(0.3, number or None)
        assert word in dropped_sentence(before.dock, after.dock)


def test_same_number_of_lights_keeps_everything(view):
    before = with_dock(view, angles_deg=UNEVEN)
    assert with_lights(before, 7) is before
    assert dropped_sentence(before.dock, before.dock) == ""
    assert dropped_sentence(Dock(0.3, 8), Dock(0.3, 10)) == ""


def test_even_spacing_written_out_gives_the_same_pose(view):
    typed = ", ".join(f"{angle:g}" for angle in range(0, 360, 36))
    even, given = analyse(view).estimate, analyse(with_angles(view, typed)).estimate
    assert even.selected is not None
    assert given.selected is not None
    assert given.selected.position_m == pytest.approx(even.selected.position_m, abs=1e-4)


@pytest.mark.parametrize(("value", "lights"), [(0, None), (-2, None), (1, 3), (8, 8), (8.4, 8), (1000, 60)])
def test_number_of_lights(view, value, lights):
    assert with_lights(view, value).dock.lights == lights
