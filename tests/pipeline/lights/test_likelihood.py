import math

import numpy as np
import pytest
from dockpose.lights.likelihood import fitted_centres
from dockpose.lights.markers import find_markers, with_fitted_centres
from dockpose.thresholds import fixed, histogram_of

TRUTH = np.array([[30.3, 29.8]])
ROUGH, REACH = np.array([[30.0, 30.0]]), np.array([12])
LENS = np.array([30.0, 30.0]), 42.0
Y, X = np.mgrid[:61, :61].astype(float)


def centres_of(grey, points, reach, white, middle, far_px):
    """Centres and covariances, of lights of which no shape is known."""
    return fitted_centres(grey, points, reach, white, middle, far_px, np.zeros((len(points), 6)))


def spot(width_px: float = 2.5, height: float = 160.0) -> np.ndarray:
    return height * np.exp(-((X - TRUTH[0, 0]) ** 2 + (Y - TRUTH[0, 1]) ** 2) / (2 * width_px**2))


def fitted(picture: np.ndarray, reach: int = 12) -> tuple[np.ndarray, np.ndarray]:
    grey = np.clip(np.rint(picture), 0, 255).astype(np.uint8)
    return centres_of(grey, ROUGH, np.array([reach]), 250.0, *LENS)


@pytest.mark.parametrize(
    ("width", "height", "noise", "reach", "rel"),
    [
        *((width, 160.0, 2.0, 9, 0.3) for width in (0.8, 1.5, 2.5)),
        (2.5, 32.0, 4.0, 12, 0.4),  # noise of an eighth of its height hides no shape
    ],
)
def test_the_variance_of_a_gaussian_lamp_is_that_of_its_fisher_information(width, height, noise, reach, rel):
    # In noise s the information on one axis is the integral of the squared slope over s^2: pi h^2 / (2 s^2).
    rng, off, told = np.random.default_rng(2), [], []
    for _ in range(60):
        centres, covariances = fitted(20 + spot(width, height) + rng.normal(0, noise, X.shape), reach)
        off.append(centres - TRUTH)
        told.append(covariances[0])
    assert np.isfinite(told).all(axis=(1, 2)).mean() > (0.9 if noise > 2 else 0.99)
    bound = 2 * (noise**2 + 1 / 12) / (np.pi * height**2)
    assert np.nanmean(told, axis=0) == pytest.approx(bound * np.eye(2), rel=rel, abs=(rel - 0.2) * bound)
    assert np.mean(np.square(off)) < 1.6 * bound


@pytest.mark.parametrize("height", [600.0, 3000.0])
def test_a_white_lamp_is_centred_by_its_flank(height):
    centres, covariances = fitted(20 + spot(2.0, height))
    np.testing.assert_allclose(centres, TRUTH, atol=0.02)
    assert 0 < covariances[0, 0, 0] < 0.02**2


@pytest.mark.parametrize("slope", [0.5, 2.0])
def test_sloping_water_does_not_move_it(slope):
    np.testing.assert_allclose(fitted(60 + slope * (X - 30) + spot(2.5, 120))[0], TRUTH, atol=0.01)


def test_a_cut_lamp_has_a_larger_variance():
    grey = np.clip(np.rint(20 + spot()), 0, 255).astype(np.uint8)
    whole = centres_of(grey, ROUGH, REACH, 250.0, *LENS)[1]
    centres, cut = centres_of(np.ascontiguousarray(grey[:, :33]), ROUGH, REACH, 250.0, *LENS)
    assert cut[0, 0, 0] > 1.3 * whole[0, 0, 0] or np.isnan(cut[0, 0, 0])
    assert abs(centres[0, 0] - TRUTH[0, 0]) < 0.6


@pytest.mark.parametrize("grey", [np.zeros((61, 61), np.uint8), np.full((61, 61), 255, np.uint8)])
def test_what_is_no_light_keeps_its_place_and_has_no_covariance(grey):
    centres, covariances = centres_of(grey, ROUGH, REACH, 250.0, *LENS)
    np.testing.assert_array_equal(centres, ROUGH)
    assert np.isnan(covariances).all()


def test_only_chosen_lights_are_fitted_in_the_part_where_they_are():
    grey = np.clip(np.rint(20 + spot() + np.roll(spot(), 20, axis=1)), 0, 255).astype(np.uint8)
    histogram = histogram_of(grey)
    markers = find_markers(grey, histogram, fixed(histogram, 100), 1)
    moved = with_fitted_centres(markers, np.array([True, False]), grey, 250.0, (30.0, 30.0))
    assert np.isnan(moved.covariances_px2[1]).all()
    np.testing.assert_allclose(moved.points_px[0], TRUTH[0], atol=0.01)
    np.testing.assert_array_equal(moved.points_px[1], markers.points_px[1])
    part = with_fitted_centres(
        markers, np.array([True, False]), np.ascontiguousarray(grey[4:, 6:]), 250.0, (30.0, 30.0), (6, 4)
    )
    np.testing.assert_allclose(part.points_px, moved.points_px, atol=1e-9)


def test_what_is_no_disc_is_not_fitted_in_noise_either():
    rng, halves = np.random.default_rng(3), spot(3.0, 80) + np.roll(spot(3.0, 80), 9, axis=1)
    for _ in range(10):
        centres, covariances = fitted(20 + halves + rng.normal(0, 4, X.shape), reach=15)
        np.testing.assert_array_equal(centres, ROUGH)
        # The middle is four pixels and a half from one of the two.
        assert not covariances[0, 0, 0] < 1.5**2


@pytest.mark.parametrize("radius_px", [30, 60])
def test_a_large_lamp_is_fitted_in_squares(radius_px):
    rng, side = np.random.default_rng(4), 5 * radius_px
    truth = np.array([2.5 * radius_px + 0.3, 2.5 * radius_px - 0.2])
    y, x = np.mgrid[:side, :side].astype(float)
    # The flank of a blur of one pixel is a disc's share of each pixel, but for 1e-3 of it at these radii.
    off = radius_px - np.hypot(x - truth[0], y - truth[1])
    share = np.vectorize(lambda step: 0.5 * (1 + math.erf(step / math.sqrt(2))))(off)
    grey = np.clip(np.rint(20 + 160 * share + rng.normal(0, 2, x.shape)), 0, 255).astype(np.uint8)
    shapes = np.zeros((1, 6))
    centres, covariances = fitted_centres(grey, np.rint(truth)[None], np.array([2 * radius_px]), 250.0, *LENS, shapes)
    # Its shape is in pixels, whatever the squares; they make the flank flatter.
    assert shapes[0, 0] == pytest.approx(160, rel=0.02)
    assert shapes[0, 1] == pytest.approx(radius_px, rel=0.01)
    assert 0.8 < shapes[0, 2] < 3
    # Around an edge of slope 160 / sqrt(2 pi), in noise s of 2 levels, s^2 over the integral of the squared slope along
    # x, which is sqrt(pi) R h^2 / 2; squares of three pixels lose less than half of it.
    bound = 2.0**2 * 2 / (math.sqrt(math.pi) * radius_px * 160**2)
    assert bound < covariances[0, 0, 0] < 2 * bound
    np.testing.assert_allclose(centres[0], truth, atol=4 * math.sqrt(2 * bound))


def test_a_light_of_no_shape_weighs_little_among_others():
    y, x = np.mgrid[:60, :420].astype(float)
    lamps = [(30.2 + 60 * k, 29.7) for k in range(7)]
    grey = 20 + np.sum([160 * np.exp(-((x - u) ** 2 + (y - v) ** 2) / 12.5) for u, v in lamps], axis=0)
    grey[24:36, 204:236] = 190  # a bar that runs into the fourth
    grey = np.rint(grey).clip(0, 255).astype(np.uint8)
    histogram = histogram_of(grey)
    markers = find_markers(grey, histogram, fixed(histogram, 100), 1)
    moved = with_fitted_centres(markers, np.ones(7, dtype=bool), grey, 250.0, (209.5, 29.5))
    bar = int(np.argmax(markers.areas_px))
    others = np.delete(np.arange(7), bar)
    np.testing.assert_allclose(np.sort(moved.points_px[others, 0]), [30.2, 90.2, 150.2, 270.2, 330.2, 390.2], atol=0.02)
    sigmas_px = np.sqrt(moved.covariances_px2[:, 0, 0])
    assert (sigmas_px[others] < 0.02).all()
    assert abs(markers.points_px[bar, 0] - 210.2) < 3 * sigmas_px[bar]
    np.testing.assert_array_equal(moved.points_px[bar], markers.points_px[bar])
    few = with_fitted_centres(
        markers.part(np.isin(np.arange(7), [bar, others[0]])), np.ones(2, bool), grey, 250.0, (209.5, 29.5)
    )
    assert few.covariances_px2 is None


def test_a_light_in_the_glow_of_something_brighter_keeps_its_centroid():
    # What is fitted there is the glow, whose middle is twice the lamp's radius away, or anything on its slope.
    rng = np.random.default_rng(0)
    y, x = np.mgrid[:200, :900].astype(float)
    lamps = np.array([(120.0 + 110 * k, 100.0) for k in range(7)])
    alone = 20 + np.sum([15 * np.clip(6.5 - np.hypot(x - u, y - v), 0, 1) for u, v in lamps], axis=0)
    glow = 120 * np.exp(-((x - lamps[3, 0] - 12) ** 2 + (y - lamps[3, 1]) ** 2) / 800)
    histogram = histogram_of(np.rint(alone).astype(np.uint8))
    markers = find_markers(alone, histogram, fixed(histogram, 27), 1)
    middle = int(np.argmin(np.abs(markers.points_px[:, 0] - lamps[3, 0])))
    moved = with_fitted_centres(
        markers, np.ones(7, dtype=bool), alone + glow + rng.normal(0, 1, x.shape), 250.0, (449.5, 99.5)
    )
    assert moved.covariances_px2 is not None
    np.testing.assert_array_equal(moved.points_px[middle], markers.points_px[middle])
    assert moved.covariances_px2[middle].trace() > 100 * np.delete(moved.covariances_px2, middle, 0)[0].trace()


def test_vignetting_pulls_no_centre_inwards():
    # A lens that keeps 40 % of the light from the corners takes 0.5 % a pixel off at the place of these lamps. Over a
    # disc of radius r a share g a pixel moves the centre of brightness by g r^2 / 4, here 0.02 px.
    rng, side, radius = np.random.default_rng(6), 241, 4.0
    middle = (side - 1) / 2
    y, x = np.mgrid[:side, :side] - middle
    around = np.arange(10) * math.tau / 10
    lamps = 80 * np.column_stack([np.cos(around), np.sin(around)]) + [0.3, -0.2]
    off = radius - np.min([np.hypot(x - u, y - v) for u, v in lamps], axis=0)
    share = np.vectorize(lambda step: 0.5 * (1 + math.erf(step)))(off)  # a blur of 0.7 px
    lens = 1 - 0.4 * (x**2 + y**2) / (2 * middle**2)
    grey = np.clip(np.rint(lens * (20 + 180 * share) + rng.normal(0, 1, x.shape)), 0, 255).astype(np.uint8)
    start, reach, of_lens = np.rint(lamps + middle), np.full(10, 8), np.array([middle, middle])

    def outwards_px(far_px: float) -> float:
        centres, _ = centres_of(grey, start, reach, 250.0, of_lens, far_px)
        return float(((centres - middle - lamps) * lamps / 80).sum(axis=1).mean())

    # Each centre is known to some 0.004 px, their mean to 0.0015. As if the corners were far, nothing is darker there.
    assert outwards_px(1e6) < -0.008
    assert abs(outwards_px(math.sqrt(2) * middle)) < 0.0045


def test_a_place_outside_the_picture_has_no_light():
    grey = np.clip(np.rint(20 + spot()), 0, 255).astype(np.uint8)
    centres, covariances = centres_of(grey, np.array([[-15.0, 30.0], [30.0, 90.0]]), np.full(2, 12), 250.0, *LENS)
    np.testing.assert_array_equal(centres, [[-15, 30], [30, 90]])
    assert np.isnan(covariances).all()


def test_a_fit_that_begins_with_the_light_of_the_frame_before_ends_where_one_that_begins_anew_does():
    grey = np.clip(np.rint(spot() + 20), 0, 255).astype(np.uint8)
    shapes = np.zeros((1, 6))
    anew, covariance = fitted_centres(grey, ROUGH, REACH, 250.0, *LENS, shapes)
    assert shapes[0, 0] > 100
    shapes[0, 1:3] *= 1.1  # it has come nearer since
    again, same = fitted_centres(grey, ROUGH, REACH, 250.0, *LENS, shapes)
    np.testing.assert_allclose(again, anew, atol=0.2 * np.sqrt(covariance[0, 0, 0]))
    np.testing.assert_allclose(same, covariance, rtol=0.1, atol=1e-8)
