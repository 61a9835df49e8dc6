import cv2
import numpy as np
import pytest

from pipeline.simulate import render
from pipeline.thresholds import fixed, hats, histogram_of
from pipeline.thresholds.groups import count_groups, lit_part
from pipeline.thresholds.hats import background_limit
from tests.scenes import random_scene


def spots(*peaks: int, background: int = 10) -> np.ndarray:
    """Squares of 5 x 5 pixels of the given grey levels, each in a frame half as bright, on 30 x 30 of water."""
    image = np.full((30, 30 * len(peaks)), background, np.uint8)
    for index, peak in enumerate(peaks):
        x = 10 + 30 * index
        image[9:16, x - 1 : x + 6] = (peak + background) // 2
        image[10:15, x : x + 5] = peak
    return image


def test_groups_at_every_level_by_hand():
    image = np.array([[9, 0, 0, 5, 5], [0, 0, 0, 0, 7], [3, 0, 9, 9, 0]], np.uint8)
    groups = count_groups(image, 1, 9, min_area_px=1)
    # at 9 two apart; at 7 the 7 touches a 9 at a corner; at 3 the lone 3 joins the count.
    assert groups[1:10].tolist() == [3, 3, 3, 2, 2, 2, 2, 2, 2]
    assert (groups[10:] == -1).all()
    assert groups[0] == -1


def test_groups_below_the_minimum_area_do_not_count():
    image = np.array([[9, 0, 9, 9], [0, 0, 9, 9]], np.uint8)
    assert count_groups(image, 5, 9, min_area_px=1)[9] == 2
    assert count_groups(image, 5, 9, min_area_px=4)[9] == 1
    assert count_groups(image, 5, 9, min_area_px=5)[9] == 0


def test_a_picture_with_nothing_lit_has_no_groups():
    assert count_groups(np.zeros((4, 4), np.uint8), 1, 9, min_area_px=1)[1:10].tolist() == [0] * 9


@pytest.mark.parametrize("seed", range(10))
def test_counting_on_the_lit_part_is_counting_on_the_whole_picture(seed):
    rng = np.random.default_rng(seed)
    image = rng.integers(0, 256, (40, 50), dtype=np.uint8) * (rng.random((40, 50)) < 0.08)
    groups = count_groups(image.astype(np.uint8), 60, 255, min_area_px=1)
    for level in range(60, 256, 13):
        assert groups[level] == cv2.connectedComponents((image >= level).astype(np.uint8), connectivity=8)[0] - 1


def test_the_lit_part_keeps_apart_what_is_apart():
    image = np.zeros((9, 9), np.uint8)
    image[1, 1] = image[1, 7] = image[7, 1] = 200
    rows, columns = lit_part(image, 100)
    assert rows.tolist() == [1, 2, 7, 8]
    assert columns.tolist() == [1, 2, 7, 8]


def test_hats_keeps_equal_lights_apart():
    threshold = hats(histogram_of(spots(200, 200, 200)), min_area_px=4)
    assert threshold.groups_at_level[threshold.level] == 3
    assert threshold.level == 200  # of all the levels with three groups, the brightest


def test_hats_goes_down_to_the_dimmer_lights():
    threshold = hats(histogram_of(spots(250, 250, 180, 120, 90)), min_area_px=4)
    assert threshold.groups_at_level[threshold.level] == 5
    assert 50 < threshold.level <= 90  # 50 is the dimmest light's own frame
    assert threshold.level == 90


def test_hats_separates_lights_whose_glow_runs_together():
    image = np.full((80, 80), 10, np.uint8)
    image[5:15, 3:37] = 120
    for x in (6, 14, 22, 30):
        image[8:12, x : x + 4] = 230
    threshold = hats(histogram_of(image), min_area_px=4)
    assert threshold.groups_at_level[threshold.level] == 4
    assert 120 < threshold.level <= 230


def test_isolated_bright_pixels_do_not_decide():
    image = spots(200, 200, 200)
    rng = np.random.default_rng(3)
    for row, column in zip(rng.integers(0, 8, 25), rng.integers(0, 90, 25), strict=True):
        image[row, column] = 255
    threshold = hats(histogram_of(image), min_area_px=6)
    assert threshold.groups_at_level[threshold.level] == 3


def test_the_curve_and_the_candidates_are_kept():
    threshold = hats(histogram_of(spots(250, 180, 120)), min_area_px=4)
    assert [peak.level for peak in threshold.peaks if peak.level in (250, 180, 120)] == [250, 180, 120]
    assert threshold.groups_at_level[250] == 1
    assert threshold.groups_at_level[180] == 2
    assert threshold.groups_at_level[120] == 3
    assert threshold.histogram.sum() == 30 * 90
    assert "3 groups" in threshold.reason


@pytest.mark.parametrize("level", [0, 7, 128, 255])
def test_a_constant_picture_has_no_lights(level):
    threshold = hats(histogram_of(np.full((30, 40), level, np.uint8)), min_area_px=4)
    assert threshold.level == 256
    assert "Nothing" in threshold.reason


def test_pure_noise_has_no_lights():
    noise = np.clip(np.random.default_rng(0).normal(40, 5, (480, 640)), 0, 255).astype(np.uint8)
    assert hats(histogram_of(noise), min_area_px=4).level == 256


def test_16_bit_levels_stand_for_256_native_steps():
    image = spots(200, 200, 200).astype(np.uint16) * 256
    threshold = hats(histogram_of(image), min_area_px=4)
    assert (threshold.level, threshold.native_level) == (200, 200 * 256)


def test_the_background_ends_four_spreads_above_its_mode():
    # Mode 20, and on its dark side 10, 15 and 20 once, twice and six times: spread sqrt((100 + 50) / 9) = 4.08.
    counts = np.zeros(256, int)
    counts[[10, 15, 20]] = [1, 2, 6]
    assert background_limit(counts) == 37  # ceil(20 + 4 * 4.08)


def test_a_bright_background_of_more_than_a_tenth_is_no_light():
    image = np.full((100, 100), 20, np.uint8)
    image[:30] = 150
    image[60:65, 60:65] = 240
    threshold = hats(histogram_of(image), min_area_px=4)
    assert threshold.level == 240


@pytest.mark.parametrize("seed", range(25))
def test_hats_finds_every_light_of_a_random_scene(seed):
    image, truth = render(random_scene(seed))
    threshold = hats(histogram_of(image), min_area_px=4)
    assert truth.visible.sum() == 10
    assert threshold.groups_at_level[threshold.level] == 10


def test_a_fixed_level_is_what_was_asked_for():
    threshold = fixed(histogram_of(spots(200)), 77)
    assert (threshold.method, threshold.level, threshold.native_level) == ("fixed", 77, 77)
