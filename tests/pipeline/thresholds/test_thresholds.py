# A None where a value is expected fails the test, which is what it should do.
# pyright: reportGeneralTypeIssues=false

import cv2
import numpy as np
import pytest
from dockpose.pixels.bright import bright_pixels
from dockpose.simulate import render
from dockpose.thresholds import METHODS, fixed, hats, hats_local, histogram_of
from dockpose.thresholds.hats import background_limit
from dockpose.thresholds.histogram import noise_levels

from tests.support.scenes import random_scene


def spots(*peaks: int, background: int = 10) -> np.ndarray:
    """Squares of 5 x 5 pixels of the given grey levels, each in a frame half as bright, on 60 x 60 of water."""
    image = np.full((60, 60 * len(peaks)), background, np.uint8)
    for index, peak in enumerate(peaks):
        x = 25 + 60 * index
        image[24:31, x - 1 : x + 6] = (peak + background) // 2
        image[25:30, x : x + 5] = peak
    return image


def groups_of(image: np.ndarray, floor: int, min_area_px: int) -> np.ndarray:
    return bright_pixels(image, floor).groups_at_every_level(min_area_px)


def test_groups_at_every_level_by_hand():
    image = np.array([[9, 0, 0, 5, 5], [0, 0, 0, 0, 7], [3, 0, 9, 9, 0]], np.uint8)
    groups = groups_of(image, 1, min_area_px=1)
    # at 9 two apart; at 7 the 7 touches a 9 at a corner; at 3 the lone 3 joins the count.
    assert groups[1:10].tolist() == [3, 3, 3, 2, 2, 2, 2, 2, 2]
    assert (groups[10:] == 0).all()
    assert groups[0] == -1


def test_groups_below_the_minimum_area_do_not_count_and_a_picture_with_nothing_lit_has_none():
    assert groups_of(np.zeros((4, 4), np.uint8), 1, min_area_px=1)[1:].tolist() == [0] * 255
    image = np.array([[9, 0, 9, 9], [0, 0, 9, 9]], np.uint8)
    assert [int(groups_of(image, 5, area)[9]) for area in (1, 2, 4, 5)] == [2, 1, 1, 0]


def test_a_row_does_not_touch_the_next_around_the_edge():
    image = np.array([[0, 0, 9], [9, 0, 0], [0, 0, 9]], np.uint8)
    assert groups_of(image, 5, min_area_px=1)[9] == 3


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("min_area_px", [1, 2, 3, 7])
def test_counting_on_bright_pixels_is_counting_on_the_whole_picture(seed, min_area_px):
    rng = np.random.default_rng(seed)
    image = (rng.integers(0, 256, (40, 50)) * (rng.random((40, 50)) < 0.3)).astype(np.uint8)
    groups = groups_of(image, 60, min_area_px)
    for level in range(60, 256, 13):
        _, _, stats, _ = cv2.connectedComponentsWithStats((image >= level).astype(np.uint8), connectivity=8)
        assert groups[level] == (stats[1:, cv2.CC_STAT_AREA] >= min_area_px).sum()


@pytest.mark.parametrize("seed", range(5))
def test_groups_of_bright_pixels_are_those_of_opencv(seed):
    rng = np.random.default_rng(seed)
    image = (rng.integers(0, 256, (40, 50)) * (rng.random((40, 50)) < 0.3)).astype(np.uint8)
    pixels = bright_pixels(image, 120)
    count, labels = pixels.groups()
    expected_count, expected = cv2.connectedComponents((image >= 120).astype(np.uint8), connectivity=8)
    assert count == expected_count - 1
    pairs = set(zip(labels.tolist(), expected.ravel()[pixels.index].tolist(), strict=True))
    assert len(pairs) == count  # one of ours for each of theirs


def test_the_picture_is_searched_once_and_the_lowest_floor_serves_all():
    histogram = histogram_of(spots(200, 100))
    low = histogram.bright(50)
    assert histogram.bright(50) is low
    assert len(histogram.bright(150)) == 25
    assert histogram.bright(50) is low


@pytest.mark.parametrize("peaks", [(200, 200, 200), (250, 250, 180, 120, 90)])
def test_hats_goes_down_to_the_dimmest_light_and_no_farther(peaks):
    threshold = hats(histogram_of(spots(*peaks)), min_area_px=4)
    assert threshold.groups_at_level[threshold.level] == len(peaks)
    assert threshold.level == min(peaks)  # of all the levels with so many groups, the brightest


def test_votes_count_brightness_and_not_levels():
    # Ten dim lights of level 40 on water of 10, and three of 250: of the brightness, counted from ten levels below the
    # water on, thirteen groups hold for ln(40 / 12), three for ln(250 / 50); of the levels for 28 of 240.
    image = spots(*[250] * 3, *[40] * 10)
    image[image == (40 + 10) // 2] = 10
    threshold = hats(histogram_of(image), 5)
    assert threshold.groups_at_level[threshold.level] == 13


def test_hats_separates_lights_whose_glow_runs_together():
    image = np.full((160, 160), 10, np.uint8)
    image[5:15, 3:37] = 120
    for x in (6, 14, 22, 30):
        image[8:12, x : x + 4] = 230
    threshold = hats(histogram_of(image), min_area_px=4)
    assert threshold.groups_at_level[threshold.level] == 4
    assert 120 < threshold.level <= 230


def test_isolated_bright_pixels_do_not_decide():
    image = spots(200, 200, 200)
    rng = np.random.default_rng(3)
    for row, column in zip(rng.integers(0, 20, 25), rng.integers(0, 180, 25), strict=True):
        image[row, column] = 255
    threshold = hats(histogram_of(image), min_area_px=6)
    assert threshold.groups_at_level[threshold.level] == 3


def test_the_curve_and_the_candidates_are_kept():
    threshold = hats(histogram_of(spots(250, 180, 120)), min_area_px=4)
    assert [peak.level for peak in threshold.peaks if peak.level in (250, 180, 120)] == [250, 180, 120]
    assert threshold.groups_at_level[250] == 1
    assert threshold.groups_at_level[180] == 2
    assert threshold.groups_at_level[120] == 3
    assert threshold.histogram.sum() == 60 * 180
    assert "3 groups" in threshold.reason


NOISE = np.clip(np.random.default_rng(0).normal(40, 5, (480, 640)), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("image", [*(np.full((30, 40), level, np.uint8) for level in (0, 7, 128, 255)), NOISE])
def test_a_picture_of_one_level_or_of_noise_has_no_lights(image):
    threshold = hats(histogram_of(image), min_area_px=4)
    assert threshold.level == 256
    assert "Nothing" in threshold.reason


def test_the_background_ends_where_levels_have_too_few_pixels_to_be_water():
    # 100000 pixels, so 20 of a level are water; smoothed by (1 4 6 4 1) / 16 the level 13 still has 62, the level
    # 14 none but the sixteenth of 1000 that level 12 lends it, and level 15 none.
    counts = np.zeros(256, int)
    counts[[10, 11, 12]] = [95_000, 3_990, 1_000]
    counts[200] = 10
    assert background_limit(counts) == 15


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


def test_hats_local_finds_lights_that_no_one_level_shows():
    # A light of 60 beside the bright glow of 120 around two lights of 250: at 60 the glow is one group, above 60 the
    # dim light is gone.
    image = np.full((300, 400), 10, np.uint8)
    image[30:60, 20:90] = 120
    image[40:46, 30:36] = image[40:46, 60:66] = 250
    image[45:50, 150:155] = 60
    threshold = hats_local(histogram_of(image), min_area_px=4)
    pixels, labels = threshold.kept
    assert sorted(np.bincount(labels).tolist()) == [25, 36, 36]
    assert sorted(np.unique(pixels.level).tolist()) == [60, 250]
    assert threshold.level <= 60
    assert "3 peaks" in threshold.reason


def test_of_more_peaks_than_can_be_looked_at_hats_local_keeps_the_brightest():
    image = np.full((480, 640), 10, np.uint8)
    for number, (y, x) in enumerate((y, x) for y in range(5, 480, 20) for x in range(5, 640, 20)):  # 768 of them
        image[y : y + 3, x : x + 3] = 60 if number % 50 else 200
    pixels, labels = hats_local(histogram_of(image), min_area_px=2).kept
    assert labels.max() + 1 == 150
    assert (pixels.level == 200).sum() == 9 * 16


@pytest.mark.parametrize("seed", range(15))
def test_hats_local_has_every_light_of_a_random_scene(seed):
    image, truth = render(random_scene(seed))
    pixels, labels = hats_local(histogram_of(image), min_area_px=2).kept
    y, x = np.divmod(pixels.index, pixels.width)
    for light in truth.lights_px[truth.visible]:
        assert np.hypot(x - light[0], y - light[1]).min() < 2
    assert labels.max() + 1 < 30


def close_lights(radius: float, level: float) -> np.ndarray:
    """Ten discs on a ring, their halos all over the picture."""
    angles = 2 * np.pi * np.arange(10) / 10
    y, x = np.mgrid[:240, :320]
    apart = np.min([np.hypot(x - 160 - 90 * np.cos(a), y - 120 - 90 * np.sin(a)) for a in angles], axis=0)
    halo = 150 * np.exp(-np.maximum(apart - radius, 0) / 40)
    noise = np.random.default_rng(0).normal(0, 1.5, apart.shape)
    return np.clip(np.where(apart < radius, level, 20 + halo) + noise, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("radius", [8, 15, 24])
@pytest.mark.parametrize("level", [230, 400])
def test_close_lights_whose_halos_fill_the_histogram_are_found(radius, level):
    threshold = hats(histogram_of(close_lights(radius, level)), min_area_px=2)
    assert 170 < threshold.level <= 255
    _, labels = bright_pixels(close_lights(radius, level), threshold.level).groups()
    assert (np.bincount(labels) > radius**2).sum() == 10


def test_lights_that_touch_where_the_sensor_saturates_part_in_the_level_free_search():
    pixels, lights = hats_local(histogram_of(close_lights(30, 400)), min_area_px=2).kept
    assert (np.bincount(lights) > 30**2).sum() == 10
    assert len(pixels) == len(lights)


def test_levels_of_a_large_picture_are_those_of_a_small_one():
    small = close_lights(15, 400)
    large = np.kron(small, np.ones((9, 9), np.uint8))
    assert abs(hats(histogram_of(large), 2).level - hats(histogram_of(small), 2).level) <= 20
    pixels, lights = hats_local(histogram_of(large), 2).kept
    assert (np.bincount(lights) > 81 * 15**2).sum() == 10
    assert pixels.width == large.shape[1]


@pytest.mark.parametrize("sigma", [1.0, 3.0, 8.0])
def test_the_noise_is_measured_beside_lights(sigma):
    rng = np.random.default_rng(1)
    image = 60 + rng.normal(0, sigma, (480, 640))
    image[100:140, 100:140] = 250
    found = noise_levels(np.clip(np.rint(image), 0, 255).astype(np.uint8))
    assert found == pytest.approx(sigma, rel=0.15)


BY_THE_PICTURE = pytest.mark.parametrize("method", [name for name in METHODS if name != "fixed"])
FLAT = {
    "black": np.zeros((20, 30), np.uint8),
    "white": np.full((20, 30), 255, np.uint8),
    "grey": np.full((20, 30), 77, np.uint8),
    "one pixel": np.full((1, 1), 9, np.uint8),
    "black 16 bit": np.zeros((20, 30), np.uint16),
}


@BY_THE_PICTURE
@pytest.mark.parametrize("kind", FLAT)
def test_a_picture_of_one_level_keeps_nothing(method, kind):
    threshold = METHODS[method](histogram_of(FLAT[kind]), 2, 0)
    assert threshold.level == 256
    assert threshold.method == method
    assert threshold.reason.endswith(".")


@BY_THE_PICTURE
def test_two_levels_are_told_apart_of_8_and_of_16_bits(method):
    image = np.full((60, 80), 30, np.uint8)
    image[20:25, 20:25] = image[40:44, 60:64] = 200
    threshold, deep = (METHODS[method](histogram_of(each), 2, 0) for each in (image, image.astype(np.uint16) << 8))
    assert 30 < threshold.level <= 200
    assert threshold.level <= threshold.native_level
    assert (deep.level, deep.native_level) == (threshold.level, 256 * threshold.level)


@BY_THE_PICTURE
@pytest.mark.parametrize("seed", range(3))
def test_16_bit_pictures_have_the_level_of_their_256_bins(method, seed):
    image, _ = render(random_scene(seed))
    small = METHODS[method](histogram_of(image), 2, 0)
    large = METHODS[method](histogram_of(image.astype(np.uint16) << 8), 2, 0)
    assert (large.level, large.native_level) == (small.level, 256 * small.level)


@BY_THE_PICTURE
def test_saturated_lights_are_kept(method):
    image = np.clip(np.random.default_rng(0).normal(20, 2, (120, 160)), 0, 255).astype(np.uint8)
    for x in range(20, 150, 30):
        image[60:66, x : x + 6] = 255
    threshold = METHODS[method](histogram_of(image), 2, 0)
    assert 20 < threshold.level <= 255


def test_a_fixed_level_is_what_was_asked_for():
    threshold = fixed(histogram_of(spots(200)), 77)
    assert (threshold.method, threshold.level, threshold.native_level) == ("fixed", 77, 77)
