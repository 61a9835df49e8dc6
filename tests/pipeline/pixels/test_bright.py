"""Pictures of which too much is lit to list it: squares tell the same."""

import numpy as np
import pytest
from dockpose import Camera, Dock, Settings, estimate
from dockpose.lights.markers import find_markers
from dockpose.pixels.bright import BrightPixels, PixelGroups, SquareGroups, bright_pixels, brightest_of_squares
from dockpose.thresholds import histogram as histogram_module
from dockpose.thresholds import histogram_of
from dockpose.thresholds.histogram import threshold_at


@pytest.fixture
def few_listed(monkeypatch):
    monkeypatch.setattr(histogram_module, "MOST_LISTED_PX", 1000)


def lamps(radius=48, size=(960, 1280)):
    """Ten discs on a ring of 360 pixels, soft at the edge."""
    y, x = np.mgrid[: size[0], : size[1]]
    middle_y, middle_x = size[0] / 2 + 0.3, size[1] / 2 - 0.2
    angles = 2 * np.pi * np.arange(10) / 10
    apart = np.min([np.hypot(x - middle_x - 360 * np.cos(a), y - middle_y - 360 * np.sin(a)) for a in angles], axis=0)
    return np.clip(20 + 230 * (radius + 2 - apart) / 4, 20, 255).astype(np.uint8)


@pytest.mark.parametrize("side", [1, 2, 3, 7, 50])
def test_the_brightest_of_squares_by_hand(side):
    picture = np.random.default_rng(side).integers(0, 256, (23, 31)).astype(np.uint8)
    expected = [
        [picture[top : top + side, left : left + side].max() for left in range(0, 31, side)]
        for top in range(0, 23, side)
    ]
    assert brightest_of_squares(picture, side).tolist() == np.array(expected).tolist()


def test_bright_pixels_in_squares_are_the_list_made_coarser(few_listed):
    histogram = histogram_of(lamps())
    listed, side = bright_pixels(histogram.levels, 100).coarser(300)
    squares, other_side = histogram.bright_squares(100, 300)
    assert histogram.is_lit(100)
    assert side == other_side > 1
    np.testing.assert_array_equal(listed.index, squares.index)
    np.testing.assert_array_equal(listed.level, squares.level)
    assert listed.width == squares.width


def test_shapes_of_groups_by_squares_are_those_of_their_list():
    rng = np.random.default_rng(1)
    levels = rng.integers(0, 256, (40, 50)).astype(np.uint8)
    group_at = rng.integers(-1, 3, (10, 13)).astype(np.int32)  # squares of 4 by 4, cut at the right
    groups = SquareGroups(levels, 4, group_at, np.array([60, 128, 250]))
    pixels, group_of = groups.listed()
    y, x = np.divmod(pixels.index, 50)
    expected = [
        (row, column)
        for row in range(40)
        for column in range(50)
        if (group := group_at[row // 4, column // 4]) >= 0 and levels[row, column] >= [60, 128, 250][group]
    ]
    assert list(zip(y.tolist(), x.tolist(), strict=True)) == expected
    for one, other in zip(groups.shapes(), PixelGroups(pixels, group_of, 3).shapes(), strict=True):
        np.testing.assert_allclose(one, other, rtol=1e-12)


def test_a_group_without_a_pixel_has_none():
    groups = SquareGroups(np.zeros((8, 8), np.uint8), 4, np.zeros((2, 2), np.int32), np.array([200]))
    areas, _, _, peaks, saturated = groups.shapes()
    assert (areas[0], peaks[0], saturated[0]) == (0, 0, 0)
    assert isinstance(groups.listed()[0], BrightPixels)


def test_lights_of_a_picture_of_which_much_is_lit_are_those_of_the_list(few_listed, monkeypatch):
    picture = lamps()
    found = []
    for most in (1000, 10**9):
        monkeypatch.setattr(histogram_module, "MOST_LISTED_PX", most)
        histogram = histogram_of(picture)
        found.append(find_markers(picture, histogram, threshold_at("fixed", histogram, 128, ""), 4))
    squares, listed = found
    assert len(squares) == len(listed) == 10
    np.testing.assert_array_equal(squares.areas_px, listed.areas_px)
    np.testing.assert_array_equal(squares.boxes_px, listed.boxes_px)
    np.testing.assert_allclose(squares.points_px, listed.points_px, atol=1e-9)


@pytest.mark.parametrize("method", ["hats", "hats_local"])
def test_the_dock_is_found_the_same_way_where_much_is_lit(few_listed, method, monkeypatch):
    picture, camera, dock = lamps(), Camera(1200, 1200, 639.5, 479.5, 1280, 960), Dock(0.3, 10)
    squares = estimate(picture, camera, dock, Settings(method=method))
    monkeypatch.setattr(histogram_module, "MOST_LISTED_PX", 10**9)
    listed = estimate(picture, camera, dock, Settings(method=method))
    assert squares.status == listed.status == "ok"
    assert squares.selected is not None
    assert listed.selected is not None
    np.testing.assert_allclose(squares.selected.position_m, listed.selected.position_m, atol=1e-6)
    if method == "hats_local":
        one, other = squares.threshold, listed.threshold
        assert one is not None
        assert one.kept is not None
        assert other is not None
        assert other.kept is not None
        np.testing.assert_array_equal(one.kept[0].index, other.kept[0].index)
