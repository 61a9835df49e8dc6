"""Tone curves: levels by hand, there and back, and what they do to centres."""

import msgspec
import numpy as np
import pytest
from dockpose import Camera, Dock, estimate
from dockpose.camera.tone import decoded, encoded, linear, linear_level
from dockpose.lights.markers import grey_centres
from dockpose.simulate import Pose, Scene, render


def test_levels_by_hand():
    # IEC 61966-2-1: half the light is level 188 of 255, and the straight part ends at level 10.31 with slope 12.92.
    assert 255 * float(encoded(np.array([0.5]), "srgb")[0]) == pytest.approx(187.5, abs=0.1)
    assert float(decoded(np.array([0.02]), "srgb")[0]) == pytest.approx(0.02 / 12.92)
    assert float(decoded(np.array([0.5]), 2.0)[0]) == 0.25
    np.testing.assert_allclose(encoded(np.array([-0.1, 2.0]), "srgb"), [0, 1], atol=1e-12)


@pytest.mark.parametrize("tone", ["linear", "srgb", 0.5, 2.2])
def test_there_and_back(tone):
    light = np.linspace(0, 1, 101)
    np.testing.assert_allclose(decoded(encoded(light, tone), tone), light, atol=1e-9)


@pytest.mark.parametrize(("depth", "step"), [(np.uint8, 1), (np.uint16, 16), (np.uint16, 256)])
def test_pictures_of_each_depth_become_light(depth, step):
    grey = np.array([[0, 128 * step, 256 * step - 1]], depth)
    light = linear(grey, step, 2.0)
    assert light.dtype == np.uint16
    np.testing.assert_allclose(light / 65535, (grey / (256 * step - 1)) ** 2.0, atol=1e-5)
    assert linear(grey, step, "linear") is grey
    assert linear_level(250, step, "linear") == 250 * step
    assert linear_level(128, step, 2.0) == light[0, 1]


@pytest.mark.parametrize("tone", ["rec709", 0, 6.0, float("nan"), True])
def test_no_such_curve(tone):
    with pytest.raises(ValueError, match="tone is"):
        Camera(700, 700, 319.5, 239.5, 640, 480, tone=tone)


def test_a_picture_of_another_size_or_turned_has_the_same_curve():
    camera = Camera(700, 700, 319.5, 239.5, 640, 480, tone=2.2)
    assert camera.for_size(320, 240).tone == camera.rotated(90).tone == 2.2


def test_a_lamp_on_sloping_water_is_centred_by_its_light():
    # In light the water's slope adds to the lamp and can be taken off; stored by a curve it cannot.
    y, x = np.mgrid[:61, :61].astype(float)
    light = 0.15 + 0.003 * (x - 30) + 0.6 * np.exp(-((x - 30.3) ** 2 + (y - 29.8) ** 2) / (2 * 2.5**2))
    box, rough = np.array([[25, 25, 35, 35]]), np.array([[30.0, 30.0]])
    for tone in ("srgb", 2.2):
        grey = np.rint(255 * encoded(light, tone)).astype(np.uint8)
        assert abs(grey_centres(grey, box, rough)[0, 0] - 30.3) > 0.03
        found = grey_centres(linear(grey, 1, tone), box, rough)
        np.testing.assert_allclose(found, [[30.3, 29.8]], atol=0.015)


def test_another_curve_finds_the_groups_anew():
    camera = Camera(700, 700, 319.5, 239.5, 640, 480, tone=2.2)
    scene = Scene(camera=camera, dock=Dock(0.3, 8), pose=Pose(position_m=(0.1, 0.0, 1.5)))
    image = render(scene)[0]
    told = estimate(image, scene.camera, scene.dock)
    untold = estimate(image, msgspec.structs.replace(scene.camera, tone="linear"), scene.dock)
    again = estimate(image, scene.camera, scene.dock, previous=untold)
    assert untold.markers is not None
    assert told.selected.position_m == pytest.approx([0.1, 0.0, 1.5], abs=0.003)
    assert again.to_dict()["markers"] == told.to_dict()["markers"] != untold.to_dict()["markers"]
