"""Bright spots that somebody clicks, on water drawn here, with centres and sizes known by hand."""

import numpy as np
import pytest
from dockpose.lights.by_hand import EXACT_PX, ByHand, markers_at

Y, X = np.mgrid[:120, :160].astype(float)
RNG = np.random.default_rng(3)
NOISE = RNG.normal(0, 1.5, X.shape)


def lamp(x, y, radius_px, height=160.0):
    return height / (1 + np.exp(3 * (np.hypot(X - x, Y - y) - radius_px)))


def at(grey, lights_px, snap: bool | tuple[bool, ...] = True):
    levels = grey.clip(0, 255).astype(np.uint8)
    return markers_at(ByHand(tuple(lights_px), snap), np.rint(grey).clip(0, 255), levels, 250.0, (79.5, 59.5))


@pytest.mark.parametrize(("radius_px", "off_px"), [(2, 3.0), (5, 4.0), (14, 9.0)])
def test_a_spot_is_taken_by_its_centre_from_wherever_on_it_one_clicks(radius_px, off_px):
    grey = 20 + NOISE + lamp(80.3, 59.8, radius_px)
    for angle in np.arange(0, 2 * np.pi, np.pi / 4):
        clicked = (80.3 + off_px * np.cos(angle), 59.8 + off_px * np.sin(angle))
        found = at(grey, [clicked])
        np.testing.assert_allclose(found.points_px, [[80.3, 59.8]], atol=0.15)
        assert 1 < found.areas_px[0] / (np.pi * radius_px**2) < 3  # its flank is a part of it


def test_the_texture_of_a_lamp_is_no_spot():
    grey = 20 + NOISE + lamp(80.3, 59.8, 14) + 30 * (np.hypot(X - 86, Y - 64) < 2)
    off = at(grey, [(85.0, 63.0)]).points_px - [[80.3, 59.8]]
    assert np.hypot(*off.T) < 2  # the speck has a hundredth of the lamp's light, half a radius off its middle


def test_a_spot_in_the_halo_of_a_large_lamp_is_taken_alone():
    grey = 20 + NOISE + 100 * np.exp(-((X - 60) ** 2 + (Y - 60) ** 2) / 800) + lamp(90.3, 60.2, 3, 120)
    np.testing.assert_allclose(at(grey, [(91, 61)]).points_px, [[90.3, 60.2]], atol=0.2)


def test_where_there_is_no_spot_a_light_stays_where_it_was_set():
    found = at(20 + NOISE, [(30.25, 40.5)])
    np.testing.assert_array_equal(found.points_px, [[30.25, 40.5]])
    assert found.covariances_px2 is not None
    np.testing.assert_allclose(found.covariances_px2, EXACT_PX**2 * np.eye(2)[None])


def test_of_several_lights_some_may_be_snapped_and_some_exact():
    grey = 20 + NOISE + lamp(40.3, 60.2, 3) + lamp(110.3, 60.2, 3)
    found = at(grey, [(42.0, 61.0), (112.0, 61.0)], snap=(True, False))
    np.testing.assert_allclose(found.points_px, [[40.3, 60.2], [112.0, 61.0]], atol=0.1)


def test_two_lights_that_run_together_stay_where_they_were_set():
    found = at(20 + NOISE + lamp(80, 60, 4), [(78, 60), (82, 61)])
    np.testing.assert_array_equal(found.points_px, [[78, 60], [82, 61]])


@pytest.mark.parametrize(
    ("lights_px", "why"),
    [
        ([[1, 2], [700, 3]], "light 2 is at 700, 3, outside the picture, which has 640 x 480 pixels"),
        ([[1, 479.5]], "light 1 is at 1, 479.5, outside the picture"),
        ([[1, 2], [1.5, 2]], "light 2 is at 1.5, 2, where light 1 is already"),
        ([[float("nan"), 2]], "light 1 is at nan, 2; x and y must be finite numbers"),
        ([[1, 2, 3]], "it must be pairs of numbers x, y"),
        ("abc", "it must be pairs of numbers x, y"),
    ],
)
def test_what_can_be_no_light_is_named(lights_px, why):
    with pytest.raises(ValueError, match=why):
        ByHand.checked(lights_px, False, 640, 480)


@pytest.mark.parametrize("snap", [2, [True], "yes"])
def test_snap_is_a_flag_or_one_for_each_light(snap):
    with pytest.raises(ValueError, match="it must be true or false, or one of these for each light"):
        ByHand.checked([[1, 2], [30, 4]], snap, 640, 480)
