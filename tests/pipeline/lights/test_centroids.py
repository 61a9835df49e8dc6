import numpy as np
import pytest
from dockpose.lights.centroids import (
    _median,
    _rise,
    brightest,
    is_nearest,
    median_along_edge,
    nearest,
    weighted_centres,
    window_at,
)
from hypothesis import given
from hypothesis import strategies as st


@given(st.lists(st.integers(0, 255), min_size=1, max_size=60))
def test_median_is_numpys(values):
    assert _median(np.array(values, dtype=float)) == np.median(values)


def test_a_window_ends_at_the_pictures_edges():
    grey = np.zeros((10, 20))
    assert window_at(grey, 5, 8, 3) == (2, 8, 5, 11)
    assert window_at(grey, 1, 1, 3) == (0, 4, 0, 4)
    assert window_at(grey, 8, 18, 3) == (5, 9, 15, 19)


def test_levels_of_a_window_and_along_its_edge():
    grey = np.arange(30.0).reshape(5, 6)
    grey[2, 3] = 99
    assert brightest(grey, (1, 3, 2, 4)) == 99
    assert brightest(grey, (0, 1, 0, 5)) == 11
    # Corners count twice.
    window = grey[1:4, 2:5]
    expected = np.median(np.concatenate([window[0], window[-1], window[:, 0], window[:, -1]]))
    assert median_along_edge(grey, 1, 3, 2, 4) == expected


def test_the_two_nearest_others_are_found_nearest_first():
    points = np.array([[0.0, 0], [10, 0], [0, 4], [-7, 0], [0, 30]])
    assert nearest(points, 0, 20.0).tolist() == [2, 3]
    assert nearest(points, 0, 6.0).tolist() == [2, -1]
    assert nearest(points, 4, 20.0).tolist() == [-1, -1]
    assert nearest(points[::-1].copy(), 4, 20.0).tolist() == [2, 1]
    beside = np.array([1, -1])
    assert is_nearest(points, 0, beside, 4, 3)
    assert is_nearest(points, 0, beside, 5, 0)  # as far from both
    assert not is_nearest(points, 0, beside, 6, 0)


Y, X = np.mgrid[:41, :41].astype(float)


def disc(x, y, height=100.0, radius=3.0):
    """A light of a flat top and soft flanks, which ends within a window of 8 pixels."""
    return height * np.clip((radius + 2 - np.hypot(X - x, Y - y)) / 2, 0, 1)


def centre_of(grey, points, reach=8, foot=0.2):
    points = np.atleast_2d(np.array(points, dtype=float))
    return weighted_centres(grey, points, np.full(len(points), reach), foot)


def test_a_centre_is_that_of_what_is_above_the_foot():
    grey = 30 + disc(20.3, 19.6)
    above = np.maximum(grey - 30 - 20, 0)
    expected = [(above * X).sum() / above.sum(), (above * Y).sum() / above.sum()]
    np.testing.assert_allclose(centre_of(grey, (20, 20)), [expected], atol=1e-9)
    np.testing.assert_array_equal(centre_of(grey, (20, 20), reach=0), [[20, 20]])
    np.testing.assert_array_equal(centre_of(np.full((41, 41), 30.0), (20.2, 20)), [[20.2, 20]])


def test_a_rise_counts_as_far_as_it_is_beyond_the_noise_of_medians_by_hand():
    """Neighbours differ by 2 sigma / sqrt(pi) on average, and a median of n is off by pi / 2 sigma^2 / n."""
    low, high = np.tile([0.0, 2.0], 5), np.tile([10.0, 12.0], 5)
    sigma = np.sqrt(np.pi) / 2 * 2.0
    variance = np.pi / 2 * sigma**2 * (1 / 10 + 1 / 10)
    assert _rise(low, high) == pytest.approx(10 * 10**2 / (10**2 + variance), rel=1e-4)


@pytest.mark.parametrize("slope", [(0.0, 1.0), (1.2, 0.0), (-0.8, 0.9)])
def test_water_that_rises_evenly_moves_no_centre(slope):
    # By 16 to 20 levels over the window, of a light of 100: more than the light's own flank would, but less than .4.
    grey = 60 + slope[0] * (X - 20) + slope[1] * (Y - 20) + disc(20, 20)
    np.testing.assert_allclose(centre_of(grey, (20, 20)), [[20, 20]], atol=0.01)


def test_water_that_does_not_go_on_rising_is_a_lights_own_flank():
    # A light of reach 8 that is 5 px off the window's middle: one of the window's edges cuts it.
    grey = 30 + disc(25, 20, radius=3.5)
    above = np.maximum(grey - 30 - 0.2 * (grey[19:22, 19:22].max() - 30), 0)
    above[:, 29:] = 0
    expected = (above * X).sum() / above.sum()
    np.testing.assert_allclose(centre_of(grey, (20, 20)), [[expected, 20]], atol=0.01)


def test_each_pixel_counts_for_the_nearest_light():
    grey = 30 + disc(15, 20) + disc(26, 20)
    np.testing.assert_allclose(centre_of(grey, [(15, 20), (26, 20)]), [[15, 20], [26, 20]], atol=0.05)


def test_a_rise_beyond_noise_is_told_and_noise_is_none():
    """Of two edges of 20 and 12 pixels, in noise s, medians differ by s sqrt(pi / 2 (1 / 20 + 1 / 12)) by chance."""
    rng, noise = np.random.default_rng(3), 4.0
    by_chance = noise * np.sqrt(np.pi / 2 * (1 / 20 + 1 / 12))
    rises = np.array([_rise(rng.normal(0, noise, 20), rng.normal(0, noise, 12)) for _ in range(300)])
    # A rise r is taken for r^3 / (r^2 + s^2): of normal r by its moments .58 of its size.
    size = np.sqrt(np.mean(rises**2)) / by_chance
    r = rng.normal(0, 1, 100_000)
    assert size == pytest.approx(np.sqrt(np.mean((r**3 / (r**2 + 1)) ** 2)), rel=0.25)
    steep = [_rise(rng.normal(0, noise, 20), rng.normal(40, noise, 12)) for _ in range(50)]
    assert np.mean(steep) == pytest.approx(40, rel=0.05)
    assert _rise(np.full(5, 7.0), np.full(9, 12.0)) == 5
