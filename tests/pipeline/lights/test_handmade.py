"""Rings whose lights are off their places, told from lights strewn at random."""

import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.lights.chance import Scene
from dockpose.lights.handmade import handmade_rings

FOCAL_PX, AREA_PX2, RADIUS_PX = 800.0, 640.0 * 480.0, 80.0


def scene(points_px: np.ndarray, numbers: int = 1) -> Scene:
    points = np.asarray(points_px, float)
    return Scene(points, np.ones(len(points)), AREA_PX2, FOCAL_PX, True, numbers, np.array([np.inf]))


def ring(rng: np.random.Generator, lights: int, along: float, across: float, tilt: float = 0.8) -> np.ndarray:
    """Points (N, 2) on an ellipse of axes 1 and ``tilt``, off their places by shares of the radius."""
    angles = 2 * np.pi * np.arange(lights) / lights + rng.normal(0, along, lights)
    radii = RADIUS_PX * (1 + rng.normal(0, across, lights))
    return radii[:, None] * np.column_stack([np.cos(angles), tilt * np.sin(angles)]) + [30, -20]


@pytest.mark.parametrize(("lights", "along", "across"), [(8, 0.03, 0.03), (12, 0.07, 0.01), (24, 0.05, 0.05)])
def test_all_lights_of_a_ring_are_found_in_their_order(lights, along, across):
    points = ring(np.random.default_rng(1), lights, along, across)
    found = handmade_rings(scene(points), np.arange(lights), (lights,))
    # In order around the ring, from whichever light and either way round.
    corners = found[0].polygon.corners
    steps = np.diff(np.append(corners, corners[0])) % lights
    assert (steps == steps[0]).all()
    assert steps[0] in (1, lights - 1)


def test_the_number_of_lights_is_that_of_the_groups_where_nothing_else_is_in_view():
    points = ring(np.random.default_rng(2), 8, 0.07, 0.01)
    found = handmade_rings(scene(points, 64), np.arange(8), range(5, 25))
    assert found[0].sides == len(found[0].members) == 8


def test_other_lights_are_left_out():
    rng = np.random.default_rng(3)
    points = np.vstack([ring(rng, 12, 0.04, 0.02), rng.uniform(-220, 220, (6, 2))])
    found = handmade_rings(scene(points), np.arange(len(points)), (12,))
    assert len(found[0].members & set(range(12))) >= 11
    assert len(found[0].members - set(range(12))) <= 1


def test_lights_strewn_at_random_form_no_ring():
    # The expected number of such rings that chance makes is below .01 / 2 a picture: of 60 pictures .3.
    rings = 0
    for seed in range(60):
        points = np.random.default_rng(seed).uniform([-320, -240], [320, 240], (8, 2))
        rings += bool(handmade_rings(scene(points), np.arange(8), (8,)))
    assert rings <= 3


def test_fewer_than_five_points_and_points_on_a_line_are_no_ring():
    line = np.column_stack([np.arange(8) * 20.0, np.arange(8) * 10.0])
    for points in (ring(np.random.default_rng(4), 4, 0.0, 0.0), line):
        assert handmade_rings(scene(points), np.arange(len(points)), (len(points),)) == []


def test_of_24_lights_that_hands_placed_nearly_all_are_used_and_not_the_few_that_are_in_their_places():
    # A fiftieth of the radius each way: about as many lights are off by more than the search for exact rings allows.
    camera = Camera(fx=FOCAL_PX, fy=FOCAL_PX, cx=319.5, cy=239.5, width=640, height=480)
    ys, xs = np.mgrid[:480, :640]
    used = 0
    for seed in range(12):
        image = np.full((480, 640), 5.0)
        for x, y in 1.5 * ring(np.random.default_rng(seed), 24, 0.02, 0.02) + [320, 240]:
            image += 200 * np.exp(-((xs - x) ** 2 + (ys - y) ** 2) / (2 * 2.0**2))
        found = estimate(np.clip(image, 0, 255).astype(np.uint8), camera, Dock(diameter=0.3, lights=24))
        used += found.lights_on_ring or 0
    assert used >= 0.95 * 12 * 24
