import msgspec
import numpy as np
import pytest
from dockpose import Camera
from dockpose.simulate import Lights, render
from dockpose.simulate.parts import Background, Lamp, Mirror, Occluder, Panel, Snow, Text

from tests.support.scenes import QUIET, changed, near


def test_the_background_may_be_coloured_and_the_panel_is_not():
    background = Background(level=100.0, colour=(0.5, 1.0, 0.25))
    scene = changed(background=background, panel=Panel(size_m=0.4, level=4.0), lights=Lights(level=0.0))
    image, _ = render(msgspec.structs.replace(scene, sensor=msgspec.structs.replace(QUIET, colour="bgr")))
    assert image[20, 20].tolist() == [50, 100, 25]
    assert image[240, 320].tolist() == [4, 4, 4]
    assert render(scene)[0][20, 20] == 100


def test_a_panel_keeps_its_outline_where_the_lens_bends_its_edges_inwards():
    camera = Camera(300, 300, 319.5, 239.5, 640, 480, (0.4, 0.0, 0.0, 0.0))
    light = {"background": Background(level=100.0), "lights": Lights(level=0.0)}
    image, _ = render(changed(camera=camera, panel=Panel(size_m=1.2, level=4.0), **light))
    middle_of_edge, corner = np.rint(camera.project([[0.0, -0.6, 1.0], [0.6, -0.6, 1.0]])).astype(int)
    assert corner[1] < middle_of_edge[1] - 20
    column, row = middle_of_edge
    assert image[row - 3, column] == 100
    assert image[row + 3, column] == 4
    assert image[corner[1] + 5, corner[0] - 5] == 4


def test_a_mirror_doubles_the_lights_above_the_surface():
    scene = changed(mirror=Mirror(height_m=0.25, ripple_deg=0.0), camera=Camera(400, 400, 319.5, 239.5, 640, 480))
    image, truth = render(scene)
    below = truth.lights_m[7] * [1, -1, 1] - [0, 0.5, 0]
    image_px = scene.camera.project(below[None])[0]
    assert near(image, image_px).max() > 20
    assert near(render(msgspec.structs.replace(scene, mirror=None))[0], image_px).max() < 5


def test_everything_else_in_the_water_shows_where_it_should():
    assert near(render(changed(lamps=(Lamp(position_m=(0.3, 0.2, 1.0)),)))[0], (319.5 + 210, 239.5 + 140)).max() > 100
    assert (render(changed(snow=Snow(count=200)))[0] > 5).sum() > 200
    text = render(changed(texts=(Text(text="2026-11-20 IPC", x_px=400.0, y_px=20.0),)))[0]
    assert (text[20:37, 400:620] == 255).sum() > 100
    assert text[60:100, 450:620].max() < 10
    panel = changed(background=Background(level=100.0), panel=Panel(size_m=0.4, level=4.0), lights=Lights(level=0.0))
    image = render(panel)[0]
    assert image[240, 320] == 4
    assert image[240, 20] == 100
    gradient = render(changed(background=Background(level=50.0, gradient_x=40.0), lights=Lights(level=0.0)))[0]
    assert (gradient[:, 0].mean(), gradient[:, -1].mean()) == pytest.approx((30, 70), abs=1)
    veil = render(changed(background=Background(level=0.0, backscatter_level=50.0), lights=Lights(level=0.0)))[0]
    assert veil[240, 320] > veil[10, 10] + 3


def test_an_occluder_hides_the_light_behind_it():
    bar = Occluder(x_px=424.5, y_px=239.5, width_px=30.0, height_px=60.0, angle_deg=20.0, level=7.0)
    image, truth = render(changed(occluders=(bar,)))
    assert np.flatnonzero(~truth.visible).tolist() == [0]
    assert near(image, (424.5, 239.5)).max() == 7
