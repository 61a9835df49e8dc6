import cv2
import numpy as np
import pytest
from dockpose.simulate import render
from dockpose.thresholds import histogram_of, otsu
from dockpose.thresholds.classic import find_peaks, kapur, kittler, kittler_criterion, li, sezan
from dockpose.thresholds.hats import background_mode
from skimage.filters import threshold_li

from tests.support.scenes import random_scene


def pictures():
    """Noise of two kinds, a gradient, and simulated scenes."""
    rng = np.random.default_rng(2)
    yield (
        np.concatenate([rng.normal(60, 12, 30_000), rng.normal(170, 20, 10_000)])
        .clip(0, 255)
        .astype(np.uint8)
        .reshape(200, 200)
    )
    yield rng.integers(0, 256, (50, 60), dtype=np.uint8)
    yield np.tile(np.arange(256, dtype=np.uint8), (4, 1))
    for seed in range(4):
        yield render(random_scene(seed))[0]


PICTURES = list(pictures())


def same_mask(image, level, other):
    """Over empty levels two answers may differ and still split the picture alike."""
    return np.array_equal(image >= level, image >= other)


@pytest.mark.parametrize("index", range(len(PICTURES)))
def test_otsu_is_opencvs(index):
    image = PICTURES[index]
    theirs, _ = cv2.threshold(image, 0, 255, cv2.THRESH_BINARY | cv2.THRESH_OTSU)
    assert same_mask(image, otsu(histogram_of(image)).level, int(theirs) + 1)


@pytest.mark.extra
@pytest.mark.parametrize("index", range(len(PICTURES)))
def test_kapur_is_the_insight_toolkits(index):
    import SimpleITK  # pyright: ignore[reportMissingImports]

    image = PICTURES[index]
    # Every level must occur, so that the toolkit's 256 bins are the levels.
    image = np.vstack([image.reshape(-1)[: 256 * (image.size // 256)].reshape(-1, 256), np.arange(256, dtype=np.uint8)])
    search = SimpleITK.MaximumEntropyThresholdImageFilter()
    search.SetNumberOfHistogramBins(256)
    search.Execute(SimpleITK.GetImageFromArray(image))
    assert same_mask(image, kapur(histogram_of(image)).level, int(np.floor(search.GetThreshold())) + 1)


def naive_kittler(image, level):
    """The criterion of 1986 from the two classes' pixels themselves."""
    below, above = image[image < level].astype(float), image[image >= level].astype(float)
    if len(below) == 0 or len(above) == 0 or below.var() < 1e-9 or above.var() < 1e-9:
        return np.inf
    p1, p2 = len(below) / image.size, len(above) / image.size
    return 1 + 2 * (p1 * np.log(below.std()) + p2 * np.log(above.std())) - 2 * (p1 * np.log(p1) + p2 * np.log(p2))


@pytest.mark.parametrize("index", range(3))
def test_kittler_is_the_exhaustive_minimum(index):
    image = PICTURES[index]
    criterion = kittler_criterion(histogram_of(image).counts)
    naive = np.array([naive_kittler(image, level) for level in range(256)])
    np.testing.assert_allclose(criterion, naive, rtol=1e-6, atol=1e-6)
    assert kittler(histogram_of(image)).level == int(naive.argmin())


def test_kittler_finds_where_two_normal_distributions_cross():
    # Equal spreads, shares 3 to 1: the densities cross at 115 + 12^2 ln 3 / 110 = 116.4.
    rng = np.random.default_rng(0)
    image = np.concatenate([rng.normal(60, 12, 300_000), rng.normal(170, 12, 100_000)])
    image = np.rint(image).clip(0, 255).astype(np.uint8).reshape(400, 1000)
    assert kittler(histogram_of(image)).level == pytest.approx(116.4, abs=4)


def test_kittler_with_a_saturated_peak_does_not_run_into_minus_infinity():
    image = np.random.default_rng(0).normal(40, 6, (100, 100)).clip(0, 254).astype(np.uint8)
    image[:10, :10] = 255
    image[20:24, 20:24] = 180
    assert 60 < kittler(histogram_of(image)).level <= 255


def test_kapur_by_hand():
    # Two even classes: 0..3 and 200..203 alike; any level between them keeps both entropies at ln 4.
    image = np.repeat(np.array([0, 1, 2, 3, 200, 201, 202, 203], np.uint8), 10).reshape(8, 10)
    assert 3 < kapur(histogram_of(image)).level <= 200


def test_sezan_puts_the_level_between_two_lobes():
    rng = np.random.default_rng(0)
    image = np.concatenate([rng.normal(60, 8, 30_000), rng.normal(180, 8, 10_000)]).clip(0, 255)
    level = sezan(histogram_of(image.astype(np.uint8).reshape(200, 200))).level
    assert 60 + 3 * 8 < level < 180 - 3 * 8


def test_sezan_of_one_lobe_is_where_it_ends():
    # A triangle of levels 80 to 120, its tip at 100.
    image = np.repeat(np.arange(80, 121), 20 - np.abs(np.arange(-20, 21)) + 1).astype(np.uint8)[None]
    threshold = sezan(histogram_of(image))
    assert 100 < threshold.level <= 121
    assert "One peak" in threshold.reason


def test_sezan_of_a_few_levels_far_apart_keeps_the_two_fullest_peaks():
    # Spread so evenly that the cumulative histogram crosses its mean often, however large the window.
    levels = [0, 6, 12, 12, 38, 44, 63, 111, 113, 151, 203, 219, 221, 230, 242, 248, 250]
    histogram = histogram_of(np.array([levels], np.uint8))
    peaks = find_peaks(np.cumsum(histogram.counts) / len(levels), 255)
    assert len(peaks) > 2
    # The first holds six pixels and ends at 44, the last holds seven and starts at 172; the others hold one each.
    assert (peaks[0][1], peaks[-1][0]) == (44, 172)
    assert sezan(histogram).level == (44 + 172) / 2


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(5))
def test_sezan_takes_any_few_levels(seed):
    rng = np.random.default_rng(seed)
    for _ in range(40):
        levels = rng.integers(0, 256, (1, rng.integers(2, 30)), dtype=np.uint8)
        assert 0 < sezan(histogram_of(levels)).level <= 256


def test_sezans_signal_by_hand():
    # All pixels at level 100: the cumulative histogram is a step, which lies below its sliding mean before it and
    # above from it on. With a window of 5 the signal is negative from 98, and largest at 100.
    cumulative = (np.arange(256) >= 100).astype(float)
    assert find_peaks(cumulative, 2) == [(98, 100)]


def test_li_keeps_what_is_above_scikit_images_threshold():
    grey = np.repeat(np.arange(256, dtype=np.uint8), 3).reshape(32, 24)
    np.testing.assert_array_equal(grey >= li(histogram_of(grey)).level, grey > threshold_li(grey))


def test_the_background_ends_with_the_level_up_to_which_its_share_is_whole():
    assert background_mode(np.array([2, 3])) == 1  # three of five are its share, two are not
    assert background_mode(np.array([3, 2])) == 0
