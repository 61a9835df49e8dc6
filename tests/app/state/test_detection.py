import math

import pytest
from dockpose.app.errors import UserError
from dockpose.app.processing.analysis import analyse
from dockpose.app.state import detection as choices
from dockpose.app.state.view import open_source


@pytest.fixture(scope="module")
def view():
    return open_source(None, None, None)


def test_centroid(view):
    assert choices.with_centroid(view, "binary").settings.centroid == "binary"
    with pytest.raises(UserError, match="'round'"):
        choices.with_centroid(view, "round")


def test_mask_is_cut_to_the_picture_and_can_be_removed(view):
    masked = choices.with_mask(choices.with_mask(view, 10, 20, 30, 40), 600, -10, 500, 20)
    assert masked.settings.masks == ((10, 20, 30, 40), (600, 0, 40, 10))
    first, second = choices.mask_labels(masked.settings.masks)
    assert "30 × 40 px at (10, 20)" in first
    assert choices.without_mask(masked, second).settings.masks == ((10, 20, 30, 40),)
    assert choices.without_masks(masked).settings.masks == ()
    with pytest.raises(UserError, match="no such mask"):
        choices.without_mask(view, first)


@pytest.mark.parametrize("mask", [(700, 0, 10, 10), (0, 0, 0, 10), (0, 0, -5, 10), (0, 480, 10, 10)])
def test_mask_that_covers_nothing_is_refused(view, mask):
    with pytest.raises(UserError, match="covers nothing"):
        choices.with_mask(view, *mask)


@pytest.mark.parametrize("value", [math.nan, None, "10", True])
def test_mask_that_is_no_number_is_refused(view, value):
    with pytest.raises(UserError, match="must be a number"):
        choices.with_mask(view, value, 0, 10, 10)


def test_number_of_masks_is_limited(view):
    for _ in range(choices.MAX_MASKS):
        view = choices.with_mask(view, 0, 0, 1, 1)
    with pytest.raises(UserError, match="remove one first"):
        choices.with_mask(view, 0, 0, 1, 1)


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
    values = dict(zip(choices.MEASURED_LIMITS, (10, -20, 9e9, 5, -100), strict=True))
    measured = choices.with_measured(view, values).measured
    assert measured == {"position_m": [0.1, -0.2, 50.0], "theta_x_deg": 5, "theta_y_deg": -90}
    assert choices.with_measured(view, None).measured is None
    with pytest.raises(UserError, match="measured z"):
        choices.with_measured(view, values | {"z (cm)": None})
