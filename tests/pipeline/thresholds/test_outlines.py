"""Discs by their outlines: where their middles are, and what shows none."""

import math

import cv2
import numpy as np
import pytest
from dockpose import Dock, estimate
from dockpose.lights.growing import TOLERANCE_PX
from dockpose.pixels.bright import PixelGroups
from dockpose.pose.circle import rotation_from_angles
from dockpose.thresholds import histogram_of
from dockpose.thresholds.outlines import by_outlines

from tests.support.scenes import CAMERA

FINER = 8  # the pictures are drawn so many times as large, then made smaller


def drawn(discs, shape=(120, 160), level=20.0, noise=0.0):
    """A picture of discs x, y, radius, level, each over those before it."""
    large = np.full((shape[0] * FINER, shape[1] * FINER), level, np.float32)
    for x, y, radius, bright in discs:
        middle = [round((place + 0.5) * FINER - 0.5) for place in (x, y)]
        cv2.circle(large, middle, round(radius * FINER), float(bright), -1)
    small = cv2.resize(large, shape[::-1], interpolation=cv2.INTER_AREA)
    return np.clip(small + np.random.default_rng(1).normal(0, noise, shape), 0, 255).astype(np.uint8)


def nearest_px(image, places):
    """How far each of the places (N, 2) is from the nearest middle, by the radius that is best for all."""
    off = []
    for found in by_outlines(histogram_of(image), 2):
        assert isinstance(found.groups, PixelGroups)
        middles = found.groups.centres_px
        off.append(np.linalg.norm(np.array(places)[:, None] - middles, axis=2).min(axis=1))
    return min(off, key=max)


@pytest.mark.parametrize("radius", [2.5, 3.3, 5.0, 7.0])
def test_middles_of_discs_that_run_together_are_within_half_of_what_a_ring_allows(radius):
    places = [(30.2, 30.7), (30.2 + 1.4 * radius, 30.7), (100.0, 60.4), (60.6, 90.0)]
    image = drawn([(x, y, radius, 255) for x, y in places], noise=1.0)
    assert nearest_px(image, places).max() < TOLERANCE_PX / 2


def test_a_dim_disc_under_a_bright_one_is_seen_by_what_is_left_of_its_outline():
    # A quarter of it is hidden.
    places = [(50.0, 50.0), (100.0, 40.0), (60.0, 95.0), (120.0, 90.0)]
    image = drawn([(x, y, 8, 60) for x, y in places] + [(59.0, 50.0, 7, 250)], noise=1.0)
    assert nearest_px(image, places).max() < TOLERANCE_PX / 2


@pytest.mark.parametrize("noise", [0.0, 3.0])
def test_water_shows_no_discs(noise):
    slope = np.linspace(20, 90, 160) + np.zeros((120, 1))
    image = np.clip(slope + np.random.default_rng(2).normal(0, noise, slope.shape), 0, 255).astype(np.uint8)
    assert list(by_outlines(histogram_of(image), 2)) == []
    assert list(by_outlines(histogram_of(np.full((120, 160), 7, np.uint8)), 2)) == []


def ring(count, radius_px, tilt_deg=35.0):
    """Places of a 0.30 m ring's lights 1.5 m away, and discs of that radius there."""
    turn = 2 * np.pi * np.arange(count) / count + 0.1
    lights = 0.15 * np.column_stack([np.cos(turn), np.sin(turn), 0 * turn])
    points = CAMERA.project(lights @ rotation_from_angles(math.radians(tilt_deg), 0.1).T + [0.05, 0.02, 1.5])
    return [(x, y, radius_px, 255) for x, y in points]


def test_a_ring_whose_lights_all_run_together_is_found_where_their_number_is_told():
    # Of 20 lights 22 pixels apart at the sides, 14 px across: 18 px apart above and below, where they overlap.
    image = drawn(ring(20, 13.0), (480, 640), noise=1.0)
    found = estimate(image, CAMERA, Dock(0.30, 20))
    pose = found.selected
    assert pose is not None
    assert found.lights_on_ring is not None
    assert found.lights_on_ring >= 15
    assert np.linalg.norm(pose.position_m - [0.05, 0.02, 1.5]) < 0.015
    assert math.degrees(math.acos(abs(float(pose.normal @ rotation_from_angles(math.radians(35.0), 0.1)[:, 2])))) < 2


@pytest.mark.parametrize("count", [8, 12, 20, 24])
def test_a_hoop_is_no_ring_of_lights(count):
    image = np.full((480, 640), 20, np.uint8)
    cv2.ellipse(image, (330, 250), (70, 55), 30, 0, 360, 250, 14)
    image = cv2.GaussianBlur(image, (0, 0), 1.0) + np.random.default_rng(3).integers(0, 4, image.shape, np.uint8)
    assert estimate(image, CAMERA, Dock(0.30, count)).status != "ok"
