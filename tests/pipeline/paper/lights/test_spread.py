import math

import numpy as np
import pytest
from dockpose.paper.lights import spread
from dockpose.simulate.optics.psf import Psf, point_spread

HOU = Psf("hou", theta0_rad=spread.HOU_THETA0_RAD)


def test_the_published_example_of_hou():
    assert spread.HOU_WATER.albedo == pytest.approx(0.87)
    assert spread.HOU_WATER.attenuation_per_m * spread.HOU_DISTANCE_M == pytest.approx(5.5)


@pytest.mark.parametrize("degrees", [0.1, 1.0, 10.0])
def test_the_share_of_hou_s_glow_within_an_angle_by_hand(degrees):
    # int of theta^(1 - m), constant within the inner cut-off t: t^(2 - m) / 2 + (A^(2 - m) - t^(2 - m)) / (2 - m)
    power, inner = 2 - 1 / 0.54, math.radians(HOU.inner_cutoff_deg)

    def within(angle):
        return inner**power / 2 + (angle**power - inner**power) / power

    glow = point_spread(HOU, spread.HOU_WATER, spread.HOU_DISTANCE_M)
    expected = within(math.radians(degrees)) / within(math.pi / 2)
    assert spread.glow_within(glow, math.radians(degrees)) == pytest.approx(expected, rel=0.02)
    assert spread.glow_within(glow, math.pi) == pytest.approx(1)


def test_pictures_are_exposed_alike_and_not_saturated():
    scenes = [spread.lamp_scene(HOU, spread.HOU_WATER, spread.HOU_DISTANCE_M, 1, tilt) for tilt in (0.0, 60.0)]
    square, dimmed = spread.lamp_pictures(scenes)
    assert (square.direct + square.glow).max() + 8 == pytest.approx(220, abs=0.1)
    assert square.image.max() < 250
    assert dimmed.direct.max() == pytest.approx(square.direct.max() / 2, rel=0.01)  # cos 60 degrees
    # The lamp is a disc of 15 pixels in radius, less its blurred edge.
    assert square.is_lamp.sum() == pytest.approx(math.pi * 15**2, rel=0.06)


def test_a_symmetric_glow_is_the_same_on_all_sides_and_a_rotated_one_is_narrower():
    square, turned = (
        spread.lamp_pictures([spread.lamp_scene(Psf(), spread.HOU_WATER, 1.0, 1, tilt)])[0] for tilt in (0.0, 50.0)
    )
    assert spread.lopsidedness(square, 30) == pytest.approx((1, 1), abs=0.01)
    sides, narrow = spread.lopsidedness(turned, 30)
    assert sides < 0.95
    assert narrow < 0.7


def lamps(left: int, right: int) -> spread.LampPicture:
    """Two discs of one level each, without glow."""
    y, x = np.mgrid[: spread.SIDE_PX, : spread.SIDE_PX] - spread.SIDE_PX // 2
    disc = x**2 + y**2 <= 100
    direct = np.hstack([left * disc, right * disc]).astype(np.float32)
    return spread.LampPicture(direct.astype(np.uint8), direct, np.zeros_like(direct))


def test_the_peaks_of_two_lamps_by_hand():
    assert (spread.two_peaks(lamps(200, 150)).bright, spread.two_peaks(lamps(200, 150)).dim) == (200, 150)
    assert spread.two_peaks(lamps(200, 150)).dip == 0
    assert spread.two_peaks(lamps(200, 200)).dip == 1


def test_the_peak_of_a_histogram_by_hand():
    picture = lamps(200, 200)
    assert picture.peak == 200
    assert picture.share_of_lamp_in_peak == 1
    assert picture.share_of_direct == 1
    assert picture.counts_of_lamp[200] == picture.counts[200] == picture.is_lamp.sum()
    assert picture.prominence == math.inf  # nothing just below
