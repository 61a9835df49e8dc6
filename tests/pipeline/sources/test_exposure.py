"""What is said of the exposure: drawn lights that are cut off, drown in noise, or are good."""

import re

import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.sources import ExposureWatch, Frame
from dockpose.sources.exposure import exposure_hint

CAMERA = Camera(fx=700.0, fy=700.0, cx=319.5, cy=239.5, width=640, height=480)
LONGER = "if the dock is in view, double the exposure"


def spots(peak: float, noise: float = 0.0, water: float = 20.0, kind: type = np.uint8) -> np.ndarray:
    """Ten Gaussian spots of two pixels' deviation, on a ring, of that height before they are cut off."""
    y, x = np.mgrid[:480, :640]
    levels = np.full((480, 640), water)
    for angle in 2 * np.pi * np.arange(10) / 10:
        levels += peak * np.exp(-((x - 320 - 120 * np.cos(angle)) ** 2 + (y - 240 - 120 * np.sin(angle)) ** 2) / 8)
    levels += noise * np.random.default_rng(0).standard_normal(levels.shape)
    top = np.iinfo(kind).max
    return np.clip(np.rint(levels * (top / 255)), 0, top).astype(kind)


def hint_of(image):
    return exposure_hint(image, estimate(image, CAMERA, Dock(0.30, 10)))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16])
@pytest.mark.parametrize(
    ("peak", "sentence"),
    [
        (150, ""),
        (300, ""),  # a few pixels of each
        (600, "10 of 10 lights are saturated: halve the exposure."),
        (2500, "10 of 10 lights are saturated: take a quarter of the exposure."),
    ],
)
def test_what_to_do_about_saturated_lights(kind, peak, sentence):
    assert hint_of(spots(peak, kind=kind)).sentence == sentence


def test_colour_counts_by_its_brightest_channel():
    grey = spots(600)
    assert hint_of(np.dstack([grey // 8, grey // 8, grey])).verdict == "saturated"


@pytest.mark.parametrize(
    ("water", "what"), [(20.0, "double the exposure, or have"), (160.0, "have brighter lamps, or")]
)
def test_what_to_do_about_drowned_lights(water, what):
    hint = hint_of(spots(20, noise=4.0, water=water))
    assert hint.verdict == "drowned"
    assert re.match(r"(\d+) of \1 lights hardly stand out of the water, by \d times its noise: ", hint.sentence)
    assert what in hint.sentence


def test_lights_twelve_times_above_the_noise_are_good():
    assert hint_of(spots(50, noise=4.0)).verdict == "good"


@pytest.mark.parametrize(
    ("level", "verdict", "words"),
    [
        (30, "dark", f"The picture is dark, its brightest level 30 of 255: {LONGER}."),
        (120, "unknown", ""),
        (255, "saturated", "100 % of the picture is saturated: halve the exposure."),
    ],
)
def test_pictures_without_a_dock(level, verdict, words):
    hint = hint_of(np.full((480, 640), level, np.uint8))
    assert (hint.verdict, hint.sentence) == (verdict, words)


def test_a_hint_comes_once_when_it_holds_for_a_while():
    watch, dock = ExposureWatch(), Dock(0.30, 10)
    bright, good = ((Frame(image, 0, 0.0, ""), estimate(image, CAMERA, dock)) for image in (spots(600), spots(150)))
    assert not any(watch.see(*(bright if number % 10 == 0 else good)) for number in range(40))
    said = [watch.see(*bright) for _ in range(60)]
    assert [text for text in said if text] == ["10 of 10 lights are saturated: halve the exposure."]
    assert watch.hint.verdict == "saturated"
    assert not any(watch.see(*good) for _ in range(30))
    assert watch.hint.verdict == "good"
    assert not any(watch.see(*bright) for _ in range(30))
