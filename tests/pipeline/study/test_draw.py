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


def test_scenes_are_within_their_limits(many):
    for one in many:
        scene, truth = one.scene, truth_of(one.scene)
        lights, z_m = scene.dock.lights or 0, scene.pose.position_m[2]
        cosine = -truth.normal @ truth.position_m / np.linalg.norm(truth.position_m)
        assert (cosine >= math.cos(math.radians(60)) - 1e-9) == one.has_dock
        assert cosine < -0.49 or one.has_dock
        assert one.has_dock or one.strays > 0
        assert scene.water.attenuation_per_m * z_m <= MOST_LENGTHS * (1 + 1e-9)
        radius_px = scene.camera.fx * scene.dock.radius / z_m
        assert 2 * math.pi * radius_px / lights >= LEAST_SPACING_PX * (1 - 1e-9)
        assert len(scene.lights.missing) <= lights // 3
    assert {one.scene.dock.lights for one in many} == set(range(4, 25))
    assert min(one.turbidity for one in many) < 0.02
    assert max(one.turbidity for one in many) > 0.98
    assert max(one.strays for one in many if one.has_dock) == 10


def test_about_one_scene_in_five_has_no_dock(many):
    without = [one for one in many if not one.has_dock]
    assert len(without) / len(many) == pytest.approx(0.2, abs=0.07)  # three standard errors
    strewn = [one for one in without if one.strays >= (one.scene.dock.lights or 0)]
    assert 0.5 < len(strewn) / len(without) < 0.95  # of the others, some have as many strays by chance


@pytest.mark.parametrize("index", [0, 1, 2, 3])
def test_light_scaled_after_the_fact_is_that_of_the_scene(index):
    picture = picture_of(draw(SEED, index))
    image, truth = render(picture.scene)
    off = np.abs(image.astype(int) - picture.image)
    assert off.max() <= (0 if picture.scene.sensor.jpeg_quality is None else 8) + 1
    assert (off > 0).mean() < 1e-3
    assert np.array_equal(truth.position_m, picture.truth.position_m)


def test_the_brightest_light_is_as_bright_as_drawn(many):
    picture = picture_of(next(one for one in many if one.has_dock and one.brightest > 400))
    assert picture.image.max() > 200
    assert 0 < picture.saturated_share <= picture.lit_share < 1
