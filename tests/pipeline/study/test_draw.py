import math

import numpy as np
import pytest
from dockpose.simulate import render, truth_of
from dockpose.study.draw import LEAST_SPACING_PX, MOST_LENGTHS, draw, picture_of

SEED = 7


@pytest.fixture(scope="module")
def many():
    return [draw(SEED, index) for index in range(300)]


def test_a_scene_depends_on_its_seed_and_number_alone(many):
    assert draw(SEED, 5) == many[5]
    assert draw(SEED, 6) != many[5]
    assert draw(SEED + 1, 5) != many[5]


def test_about_one_scene_in_five_has_no_dock(many):
    without = [one for one in many if not one.has_dock]
    assert 0.2 - 0.07 < len(without) / len(many) < 0.2 + 0.07  # three standard errors
    assert not any(truth_of(one.scene).visible.any() for one in without)
    strewn = [one for one in without if one.strays >= (one.scene.dock.lights or 0)]
    assert all(one.strays > 0 for one in without)
    assert 0.5 < len(strewn) / len(without) < 0.95  # of the others, some have as many strays by chance


def test_a_dock_faces_the_camera(many):
    for one in many:
        truth = truth_of(one.scene)
        cosine = -truth.normal @ truth.position_m / np.linalg.norm(truth.position_m)
        assert (cosine >= math.cos(math.radians(60)) - 1e-9) == one.has_dock


def test_all_numbers_of_lights_and_waters_come_up(many):
    assert {one.scene.dock.lights for one in many} == set(range(4, 25))
    assert min(one.turbidity for one in many) < 0.02
    assert max(one.turbidity for one in many) > 0.98
    assert max(one.strays for one in many if one.has_dock) == 10


def test_limits_of_range_and_spacing(many):
    for one in many:
        scene = one.scene
        z_m = scene.pose.position_m[2]
        assert scene.water.attenuation_per_m * z_m <= MOST_LENGTHS * (1 + 1e-9)
        radius_px = scene.camera.fx * scene.dock.radius / z_m
        assert 2 * math.pi * radius_px / (scene.dock.lights or 1) >= LEAST_SPACING_PX * (1 - 1e-9)
        assert len(scene.lights.missing) <= (scene.dock.lights or 0) // 3


@pytest.mark.parametrize("index", [0, 1, 2, 3])
def test_light_scaled_after_the_fact_is_that_of_the_scene(index):
    picture = picture_of(draw(SEED, index))
    image, truth = render(picture.scene)
    off = np.abs(image.astype(int) - picture.image)
    assert off.max() <= (0 if picture.scene.sensor.jpeg_quality is None else 8) + 1
    assert (off > 0).mean() < 1e-3
    assert np.array_equal(truth.position_m, picture.truth.position_m)


def test_the_brightest_light_is_as_bright_as_drawn():
    drawn = next(one for one in (draw(SEED, index) for index in range(50)) if one.has_dock and one.brightest > 400)
    picture = picture_of(drawn)
    assert picture.image.max() > 200
    assert 0 < picture.lit_share < 1
    assert 0 < picture.saturated_share <= picture.lit_share
