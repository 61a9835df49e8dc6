import cv2
import numpy as np
import pytest
from dockpose.thresholds import histogram_of
from dockpose.thresholds.outlines import by_outlines
from dockpose.thresholds.scales import _are_round, at_scales

PLACES = np.array([[120, 100], [300, 90], [470, 160], [200, 330], [420, 360]])


def drawn(radius_px, height, noise=3.0, slope=0.0, seed=0):
    """Gaussian lights of one width at PLACES, on water that grows brighter to the right, with noise."""
    y, x = np.mgrid[:480, :640]
    light = sum(height * np.exp(-((x - u) ** 2 + (y - v) ** 2) / (2 * radius_px**2)) for u, v in PLACES)
    noisy = 40 + slope * x + light + np.random.default_rng(seed).normal(0, noise, (480, 640))
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)


def shapes_of(found):
    assert found.groups is not None
    return found.groups.shapes()


def centres(image, min_area_px=4):
    """Centres (N, 2) of the groups of each scale."""
    return [shapes_of(found).moments for found in at_scales(histogram_of(image), min_area_px)]


def are_lights(found):
    apart = np.linalg.norm(found[:, None] - PLACES, axis=2)
    return len(found) == len(PLACES) and apart.min(axis=0).max() < 2


@pytest.mark.parametrize(("radius_px", "height"), [(1, 60), (3, 20), (6, 12), (12, 8)])
def test_lights_of_any_width_are_found_in_noise_that_hides_their_pixels(radius_px, height):
    assert any(are_lights(found) for found in centres(drawn(radius_px, height, noise=4.0)))


def test_lights_on_a_slope_that_is_brighter_than_they_are_are_found():
    assert any(are_lights(found) for found in centres(drawn(2, 25, slope=0.3)))


def test_lights_that_only_others_make_sure_are_found_among_faint_peaks():
    # Of the difference of blurs by 1.6 and 2.56 px .23 of the height is left, and .091 of the noise: 4.8 times as much.
    histogram = histogram_of(drawn(2, 9.5, noise=5.0))
    clear = [shapes_of(found).moments for found in at_scales(histogram, 4)]
    faint = [shapes_of(found).moments for found in at_scales(histogram, 4, faint=True)]
    assert not any(len(found) >= 4 for found in clear)
    off = [np.linalg.norm(found[:, None] - PLACES, axis=2).min(axis=0) for found in faint]
    assert any((off_px < 2).all() for off_px in off)


@pytest.mark.parametrize("seed", range(5))
def test_noise_alone_has_next_to_no_lights(seed):
    # Six standard deviations: less than one peak in all scales of a hundred such pictures.
    assert sum(len(found) for found in centres(drawn(1, 0, noise=8.0, seed=seed))) <= 1


def test_an_even_picture_has_none():
    assert centres(np.full((480, 640), 90, np.uint8)) == []


@pytest.mark.parametrize("looks", [at_scales, by_outlines])
def test_a_picture_that_is_masked_as_a_whole_has_none(looks):
    image = drawn(3, 60)
    assert list(looks(histogram_of(image, np.zeros_like(image)), 4)) == []


def test_three_times_the_contrast_has_the_same_lights():
    image = drawn(3, 20)
    one, three = (max(centres(picture), key=are_lights) for picture in (image, 3 * image))
    assert are_lights(one)
    assert are_lights(three)


@pytest.mark.parametrize("noise_levels", [0, 2])
def test_the_rim_of_a_large_disc_is_no_row_of_lights(noise_levels):
    y, x = np.mgrid[:480, :640]
    covered = np.clip(60.5 - np.hypot(x - 320, y - 240), 0, 1)
    seen = 40 + 160 * cv2.GaussianBlur(covered, (0, 0), 0.7)  # as by a lens
    noise = np.random.default_rng(0).normal(0, noise_levels, seen.shape)
    assert all(len(found) <= 1 for found in centres(np.rint(seen + noise).astype(np.uint8)))


def test_masked_pixels_have_no_lights():
    image = drawn(3, 60)
    counted = np.ones_like(image)
    counted[:200] = 0
    found = list(at_scales(histogram_of(np.where(counted > 0, image, 0).astype(np.uint8), counted), 4))
    assert found
    assert all(shapes_of(one).moments[:, 1].min() > 200 for one in found)


@pytest.mark.parametrize(("along", "is_round"), [(1.0, True), (1.5, True), (2.6, True), (3.8, False), (20.0, False)])
@pytest.mark.parametrize("turn_rad", [0.0, 0.6, np.pi / 2])
@pytest.mark.parametrize("height", [0.5, 200.0])
def test_peaks_are_round_and_ridges_are_not_however_high(along, is_round, turn_rad, height):
    # A Gaussian's curvatures are as the squares of its widths: up to 1 : 10 it is round, as Lowe has it.
    y, x = np.mgrid[-6:7, -6:7].astype(float)
    u, v = x * np.cos(turn_rad) + y * np.sin(turn_rad), y * np.cos(turn_rad) - x * np.sin(turn_rad)
    response = height * np.exp(-(u**2 / along**2 + v**2) / 2 / 3**2)
    assert _are_round(response, np.array([6]), np.array([6])).tolist() == [is_round]


def test_of_too_many_peaks_of_one_scale_the_clearest_are_kept():
    y, x = np.mgrid[:480, :640]
    places = [(u, v) for u in range(30, 620, 60) for v in range(30, 460, 50)]  # 90
    heights = 12.0 + np.arange(len(places))
    image = np.full((480, 640), 30.0)
    for (u, v), height in zip(places, heights, strict=True):
        image[v - 9 : v + 10, u - 9 : u + 10] += height * np.exp(
            -((x[:19, :19] - 9) ** 2 + (y[:19, :19] - 9) ** 2) / (2 * 2.0**2)
        )
    noisy = np.clip(np.rint(image + np.random.default_rng(1).normal(0, 1, image.shape)), 0, 255).astype(np.uint8)
    for found in centres(noisy):
        nearest = np.linalg.norm(found[:, None] - np.array(places), axis=2).argmin(axis=1)
        assert len(found) <= 60
        if len(found) == 60:
            assert np.sort(nearest)[:25].min() >= 20  # of 30 that go, by noise and pixels some of the next
