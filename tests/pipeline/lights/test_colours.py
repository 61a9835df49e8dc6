import numpy as np
import pytest
from dockpose.lights.colours import tell_colours
from dockpose.paper.tables import coded_dock
from dockpose.simulate import Lights, Pose, Scene, Sensor, render
from dockpose.simulate.optics.water import PRESETS

from tests.support.scenes import CAMERA

DOCK = coded_dock(0.30)


def pictured(water="tank", kind="bgr", z_m=1.0):
    scene = Scene(
        camera=CAMERA,
        dock=DOCK,
        pose=Pose(position_m=(0.0, 0.0, z_m), theta_x_deg=20.0, theta_y_deg=10.0),
        lights=Lights(colours=DOCK.colours),
        water=PRESETS[water],
        sensor=Sensor(colour=kind),
    )
    image, truth = render(scene)
    return image, (truth.lights_px, np.full(12, 20))


def told(image, lights):
    return tell_colours(image, *lights)


@pytest.mark.parametrize("water", ["clear", "tank", "coastal"])
@pytest.mark.parametrize("kind", ["bgr", "bayer"])
def test_colours_are_told_in_water(water, kind):
    assert told(*pictured(water, kind)) == list(DOCK.colours)


@pytest.mark.parametrize(("red_left", "green_left"), [(0.2, 1.0), (0.1, 0.5)])
def test_colours_are_told_when_water_has_taken_most_of_the_red(red_left, green_left):
    image, lights = pictured()
    dimmed = (image * [1.0, green_left, red_left]).astype(np.uint8)
    assert told(dimmed, lights) == list(DOCK.colours)


def test_red_lights_cannot_be_told_when_their_band_is_gone():
    image, lights = pictured()
    labels = told((image * [1.0, 1.0, 0.01]).astype(np.uint8), lights)
    assert [label for label, true in zip(labels, DOCK.colours, strict=True) if true == "red"] == [None, None]
    assert [label for label, true in zip(labels, DOCK.colours, strict=True) if true == "blue"] == ["blue", "blue"]


def test_16_bits_tell_the_same():
    image, lights = pictured()
    assert told(image.astype(np.uint16) * 257, lights) == list(DOCK.colours)


def test_a_grey_picture_and_lights_that_are_none_tell_nothing():
    image, lights = pictured()
    assert told(image[:, :, 0], lights) == [None] * 12
    assert tell_colours(image, *(each[:0] for each in lights)) == []
    assert told(np.zeros_like(image), lights) == [None] * 12


def test_a_light_at_the_edge_is_no_fault():
    image, _ = pictured()
    assert len(told(image, (np.array([[0.0, 0.0], [639.4, 479.4]]), np.array([5, 9])))) == 2
