"""Saturated regions that are too wide for lights."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from dockpose.lights.markers import find_markers
from dockpose.thresholds import METHODS, histogram_of


def test_lights_beside_glare_are_found_and_the_glare_is_none():
    """A saturated wall that fills half of the picture is no light, however bright; lamps beside it are."""
    image = np.full((480, 640), 20, np.uint8)
    image[:, :320] = 255
    lamps = [(400, 100), (560, 100), (400, 380), (560, 380), (480, 240)]
    for lamp in lamps:
        cv2.circle(image, lamp, 6, 200, -1)
    histogram = histogram_of(image)
    threshold = METHODS["hats"](histogram, 5, None)
    assert 20 < threshold.level <= 200
    found = find_markers(image, histogram, threshold, 5)
    assert sorted(np.rint(found.points_px).astype(int).tolist()) == sorted(map(list, lamps))


@pytest.mark.parametrize("radius", [60, 70])
def test_a_wide_light_is_no_glare(radius):
    """A disc of an eighth of 640 x 480 has a radius of 110 pixels; what is smaller may be a light, though many are."""
    image = np.full((480, 640), 20, np.uint8)
    for x, y in [(110, 110), (320, 110), (530, 110), (110, 360), (320, 360), (530, 360)]:
        cv2.circle(image, (x, y), radius, 255, -1)
    assert histogram_of(image).without_glare.counted is None
