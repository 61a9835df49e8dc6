import math

import pytest
from dockpose.app.errors import UserError
from dockpose.app.state import detection as choices


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


def test_method_that_finds_its_level_has_none(view):
    fixed = choices.with_method(view, "fixed", 166)
    assert choices.with_method(fixed, "otsu", 166).settings == choices.with_method(view, "otsu").settings
    assert choices.with_method(fixed, "hats").settings.level is None


def test_method_takes_the_level_it_starts_from(view):
    settings = choices.with_method(view, "fixed", 166).settings
    assert (settings.method, settings.level) == ("fixed", 166)


@pytest.mark.parametrize("method", ["otsus", "", None, 1, ["hats"]])
def test_unknown_method_is_refused(view, method):
    with pytest.raises(UserError, match="no threshold method"):
        choices.with_method(view, method, 100)
