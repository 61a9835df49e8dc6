import math
from dataclasses import replace

import cv2
import numpy as np
import pytest
from dockpose import Dock, Settings
from dockpose.app.errors import UserError
from dockpose.app.processing.analysis import analyse
from dockpose.app.state import changes as choices
from dockpose.app.state.camera import with_port, with_these_as_mine
from dockpose.app.state.parameters import put, with_given_number
from dockpose.app.state.view import MeasuredPose, open_source, with_file, with_sample, with_upload
from dockpose.dock import Entrance
from dockpose.pose.known import KnownPose
from dockpose.sidecar import sample_path

PICTURE = cv2.imencode(".png", np.full((480, 640), 20, np.uint8))[1].tobytes()
UNEVEN = (0.0, 30.0, 75.0, 120.0, 180.0, 250.5, 300.0)


def with_dock(view, **values):
    return replace(view, dock=Dock(0.3, **values))


@pytest.mark.parametrize("text", ["0, 36, 72", "0 36 72", "0;36;72;", " 0°, 36° , 72°", "0\n36,,72.0"])
def test_angles_are_read_and_the_number_of_lights_follows(view, text):
    dock = choices.with_angles(view, text).dock
    assert (dock.angles_deg, dock.lights, dock.diameter) == ((0, 36, 72), 3, view.dock.diameter)
    assert choices.angles_text(dock) == "0, 36, 72"


@pytest.mark.parametrize("text", ["", "  ", " , "])
def test_blank_is_evenly_spaced_with_as_many_lights(view, text):
    dock = choices.with_angles(with_dock(view, angles_deg=UNEVEN), text).dock
    assert dock == Dock(0.3, 7)
    assert choices.angles_text(dock) == ""


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
        choices.with_angles(view, text)
    assert str(refused.value).count("\n") == 0


@pytest.mark.parametrize("number", [4, 8, 0])
def test_another_number_of_lights_drops_what_no_longer_fits_and_says_so(view, number):
    offsets_m = ((0.01, 0.0, 0.0),) * 3
    kept = {"entrance": Entrance(radius_m=0.1), "lamp_depth_m": 0.02, "diameter_sigma_m": 0.001}
    for name, values, word in (
        ("angles_deg", UNEVEN, "7 angles"),
        ("offsets_m", offsets_m, "3 measured places"),
    ):
        before = with_dock(view, **{name: values}, **kept)
        after = put(before, "lights", number)
        assert after.dock == Dock(0.3, number or None, **kept)
        assert word in choices.dropped_sentence(before.dock, after.dock)


@pytest.mark.parametrize(
    ("text", "places"),
    [("5", ((0, 0, 0.05),)), ("0, 0, 5; 1 -2 -4.5", ((0, 0, 0.05), (0.01, -0.02, -0.045))), (" ", ()), ("", ())],
)
def test_extra_lights_are_read_in_centimetres(view, text, places):
    changed = choices.with_extra_lights(view, text)
    assert changed.dock.extra_lights_m == places
    again = choices.with_extra_lights(view, choices.extra_lights_text(changed.dock))
    assert again.dock == changed.dock


@pytest.mark.parametrize("text", ["1, 2", "0, 0, x", "0, 0, 0.1", "0, 0, 500", None, "5;" * 1000])
def test_extra_lights_that_cannot_be_are_refused_in_a_sentence(view, text):
    with pytest.raises(ValueError, match=r"extra") as refused:
        choices.with_extra_lights(view, text)
    assert str(refused.value).count("\n") == 0


def test_entrance_off_the_axis_needs_its_lights(view):
    before = with_dock(view, lights=8, entrance=Entrance(position_m=(0.1, 0.0, 0.0)))
    assert put(before, "lights", 10).dock.entrance == before.dock.entrance
    with pytest.raises(ValueError, match="an entrance off the dock's axis needs them"):
        put(before, "lights", 0)


def test_same_number_of_lights_keeps_everything(view):
    before = with_dock(view, angles_deg=UNEVEN)
    assert put(before, "lights", 7).dock is before.dock
    assert choices.dropped_sentence(before.dock, before.dock) == ""
    assert choices.dropped_sentence(Dock(0.3, 8), Dock(0.3, 10)) == ""


@pytest.mark.parametrize(("value", "lights"), [(0, None), (-2, None), (1, 3), (8, 8), (8.4, 8), (1000, 60)])
def test_number_of_lights(view, value, lights):
    assert put(view, "lights", value).dock.lights == lights


def test_mask_is_cut_to_the_picture_and_can_be_removed(view):
    masked = choices.with_mask(choices.with_mask(view, 10, 20, 30, 40), 600, -10, 500, 20)
    assert masked.settings.masks == ((10, 20, 30, 40), (600, 0, 40, 10))
    first, second = choices.mask_labels(masked.settings.masks)
    assert "30 × 40 px at (10, 20)" in first
    assert choices.without_mask(masked, second).settings.masks == ((10, 20, 30, 40),)
    assert choices.without_masks(masked).settings.masks == ()
    with pytest.raises(UserError, match="no such mask"):
        choices.without_mask(view, first)


NOTHING = [(700, 0, 10, 10), (0, 0, 0, 10), (0, 0, -5, 10), (0, 480, 10, 10)]
NO_NUMBER = [(value, 0, 10, 10) for value in (math.nan, None, "10", True)]


@pytest.mark.parametrize("mask", [*NOTHING, *NO_NUMBER])
def test_mask_that_covers_nothing_or_is_no_number_is_refused(view, mask):
    with pytest.raises(UserError, match="covers nothing" if mask in NOTHING else "must be a number"):
        choices.with_mask(view, *mask)


def test_number_of_masks_is_limited(view):
    for _ in range(choices.MAX_MASKS):
        view = choices.with_mask(view, 0, 0, 1, 1)
    with pytest.raises(UserError, match="remove one first"):
        choices.with_mask(view, 0, 0, 1, 1)


def test_method_takes_the_level_it_starts_from_and_one_that_finds_its_level_has_none(view):
    fixed = choices.with_method(view, "fixed", 166)
    assert (fixed.settings.method, fixed.settings.level) == ("fixed", 166)
    assert choices.with_method(fixed, "otsu", 166).settings == choices.with_method(view, "otsu").settings
    assert choices.with_method(fixed, "hats").settings.level is None


def test_pose_by_hand_is_used_and_said(view):
    other = analyse(view).estimate.candidates[1]
    found = analyse(choices.with_pose_by_hand(view, other)).estimate
    assert found.choice is not None
    assert (found.choice.selected, found.choice.selected_by) == (1, "hand")
    assert "by hand" in found.message
    again = analyse(choices.with_pose_by_hand(choices.with_pose_by_hand(view, other), None)).estimate
    assert again.choice is not None
    assert (again.choice.selected, again.choice.selected_by) == (0, "spacing")


def test_measured_pose(view):
    values = dict(zip(choices.MEASURED_LIMITS, (10, -20, 5000, 5, -90), strict=True))
    measured = choices.with_measured(view, values)
    assert measured.measured == MeasuredPose(10, -20, 5000, 5, -90)
    assert measured.measured_pose == KnownPose((0.1, -0.2, 50.0), 5, -90)
    assert choices.with_measured(view, None).measured is None
    for wrong in ("1", True, float("nan"), 5001):
        with pytest.raises(UserError, match="measured z"):
            choices.with_measured(view, values | {"z (cm)": wrong})


def test_what_was_not_measured_is_blank_and_no_pose_is_made_of_it(view):
    assert choices.with_measured(view, {}).measured == MeasuredPose()
    partly = choices.with_measured(view, {"z (cm)": 110, "x (cm)": None})
    assert partly.measured == MeasuredPose(z_cm=110)
    assert (partly.measured_pose, replace(partly, truth=None).known_pose) == (None, None)


def labels(view, *arguments):
    return [chip.label for chip in choices.chips(view, *arguments)]


def pressed(view, words, *arguments):
    (chip,) = [chip for chip in choices.chips(view, *arguments) if words in chip.label]
    return chip.press(view)


def test_each_setting_that_rules_the_next_picture_is_a_chip_and_goes_with_one_press(view):
    assert labels(view) == []
    pose = analyse(view).estimate.candidates[0]
    changed = choices.with_centroid(put(choices.with_method(view, "fixed", 99), "min_area_px", 7), "binary")
    changed = choices.with_mask(changed, 0, 0, 50, 20)
    changed = choices.with_pose_by_hand(changed, pose)
    shown = labels(changed)
    for words in ("Pose chosen by hand", "Fixed level 99", "Lights of 7 px", "middle of the pixels", "50 × 20 px"):
        assert any(words in label for label in shown)
        changed = pressed(changed, words)
    assert (labels(changed), changed.settings, changed.by_hand) == ([], Settings(), None)
    assert "Method otsu  ✕" in labels(choices.with_method(view, "otsu"))


def test_numbers_that_are_not_the_file_s_are_a_chip_and_go_back_with_one_press(view):
    changed = put(put(view, "fx", 812), "diameter_cm", 45)
    assert labels(changed) == ["Not as given: fx (px): 700 → 812. Diameter (cm): 30 → 45  ✕"]
    assert with_given_number(changed, "fx (px)").camera == view.camera
    assert with_given_number(changed, "fx (px)").dock.diameter == 0.45
    assert with_given_number(changed, "Air gap (mm)") is with_given_number(changed, "x") is changed
    back = pressed(changed, "Not as given")
    assert (back.camera, back.dock, labels(back)) == (view.camera, view.dock, [])
    port = with_port(view, True)
    assert labels(port) == ["Not as given: port  ✕"]
    assumed = put(with_upload(open_source(None, None, None), PICTURE, "a.png"), "fx", 700)
    assert not any("Not as given" in label for label in labels(assumed))  # there was nothing to go back to


def test_level_and_masks_stay_chips_on_the_next_picture_and_a_chosen_pose_does_not(view):
    pose = analyse(view).estimate.candidates[1]
    changed = choices.with_pose_by_hand(choices.with_mask(choices.with_method(view, "fixed", 99), 0, 0, 50, 20), pose)
    shown = labels(with_sample(changed, "tilted"))
    assert len(shown) == 2
    assert "Fixed level 99" in shown[0]


def test_many_masks_have_one_chip(view):
    for number in range(3):
        view = choices.with_mask(view, 10 * number, 0, 5, 5)
    assert labels(view) == ["3 masks  ✕"]
    assert pressed(view, "3 masks").settings.masks == ()


def test_my_tank_is_offered_where_another_is_in_force_but_not_for_what_is_simulated(view):
    mine = with_these_as_mine(view)
    assert labels(mine) == labels(with_sample(mine, "flat_port")) == []
    look = with_file(mine, sample_path("flat_port"), "flat_port.png")
    assert pressed(look, "Use My tank").camera == view.camera.for_size(800, 600)


def test_what_to_do_next_comes_first_and_opens_the_tab_where_it_is_done(view):
    assumed = with_upload(choices.with_method(view, "fixed", 99), PICTURE, "a.png")
    first, second, *_, last = choices.chips(replace(assumed, camera_of="guess"), has_pose=False)
    assert [(one.label, one.opens) for one in (first, second)] == [
        ("Load the camera's file", "Tank"),
        ("Look at all methods", "Compare"),
    ]
    assert first.press(assumed) is assumed
    assert last.label.startswith("Fixed level 99")
    assert not {"Tank", "Compare"} & {one.opens for one in choices.chips(view)}


def test_number_of_lights_that_fits_is_offered(view):
    wrong = analyse(replace(view, dock=Dock(0.30, 8), given_dock=Dock(0.30, 8)))
    assert wrong.fitting_lights == 10
    (label,) = labels(wrong.view, wrong.fitting_lights)
    assert label == "Set the number of lights to 10"
    assert wrong.trust.colour == "red"
    right = analyse(pressed(wrong.view, "lights to 10", wrong.fitting_lights))
    assert (right.estimate.status, right.fitting_lights, right.trust.colour) == ("ok", None, "green")


def test_nothing_is_offered_where_there_is_no_ring_or_lights_are_only_hidden(view):
    for name in ("missing", "green_haze", "mirror", "bright_background"):
        assert analyse(with_sample(view, name)).fitting_lights is None, name
    dark = analyse(choices.with_method(replace(view, dock=Dock(0.30, 8)), "fixed", 255))
    assert (dark.estimate.status != "ok", dark.fitting_lights) == (True, None)
