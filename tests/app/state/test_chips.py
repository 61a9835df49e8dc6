from dataclasses import replace

import pytest
from dockpose import Dock, Settings
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_centroid, with_mask, with_method, with_pose_by_hand
from dockpose.app.state.chips import chips
from dockpose.app.state.in_force import with_these_as_mine
from dockpose.app.state.parameters import put
from dockpose.app.state.view import with_sample


def labels(view, *arguments):
    return [chip.label for chip in chips(view, *arguments)]


def pressed(view, words, *arguments):
    (chip,) = [chip for chip in chips(view, *arguments) if words in chip.label]
    return chip.press(view)


def test_nothing_to_remove_where_nothing_was_set(view):
    assert labels(view) == []


def test_each_setting_that_rules_the_next_picture_is_a_chip_and_goes_with_one_press(view):
    pose = analyse(view).estimate.candidates[0]
    changed = with_mask(with_centroid(put(with_method(view, "fixed", 99), "min_area_px", 7), "binary"), 0, 0, 50, 20)
    changed = with_pose_by_hand(changed, pose)
    shown = labels(changed)
    for words in ("Pose chosen by hand", "Fixed level 99", "Lights of 7 px", "middle of the pixels", "50 × 20 px"):
        assert any(words in label for label in shown)
        changed = pressed(changed, words)
    assert (labels(changed), changed.settings, changed.by_hand) == ([], Settings(), None)
    assert "Method otsu  ✕" in labels(with_method(view, "otsu"))


def test_level_and_masks_stay_chips_on_the_next_picture_and_a_chosen_pose_does_not(view):
    pose = analyse(view).estimate.candidates[1]
    changed = with_pose_by_hand(with_mask(with_method(view, "fixed", 99), 0, 0, 50, 20), pose)
    shown = labels(with_sample(changed, "tilted"))
    assert len(shown) == 2
    assert "Fixed level 99" in shown[0]


def test_many_masks_have_one_chip(view):
    for number in range(3):
        view = with_mask(view, 10 * number, 0, 5, 5)
    assert labels(view) == ["3 masks  ✕"]
    assert pressed(view, "3 masks").settings.masks == ()


def test_my_tank_is_offered_where_another_is_in_force(view):
    mine = with_these_as_mine(view)
    assert labels(mine) == []
    look = with_sample(mine, "flat_port")
    assert pressed(look, "Use My tank").camera == view.camera.for_size(800, 600)


def test_number_of_lights_that_fits_is_offered(view):
    wrong = analyse(replace(view, dock=Dock(0.30, 8)))
    assert wrong.fitting_lights == 10
    (label,) = labels(wrong.view, wrong.fitting_lights)
    assert label == "10 lights form a ring; the dock is set to 8. Use 10?"
    assert wrong.trust.colour == "red"
    right = analyse(pressed(wrong.view, "Use 10?", wrong.fitting_lights))
    assert (right.estimate.status, right.fitting_lights, right.trust.colour) == ("ok", None, "green")


@pytest.mark.parametrize("name", ["missing", "green_haze", "mirror", "bright_background"])
def test_lights_that_are_only_hidden_offer_no_other_number(view, name):
    assert analyse(with_sample(view, name)).fitting_lights is None


def test_nothing_is_offered_where_there_is_no_ring(view):
    dark = analyse(with_method(replace(view, dock=Dock(0.30, 8)), "fixed", 255))
    assert (dark.estimate.status != "ok", dark.fitting_lights) == (True, None)
