import math

import pytest
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.state.camera import with_port
from dockpose.app.state.parameters import DISTORTION, LENS, PARAMETERS, PORT, SCENE, Limits, put
from dockpose.app.state.scene import SOURCE_NAME
from dockpose.app.state.view import open_source

NO_NUMBERS = [math.nan, math.inf, -math.inf, "700", None, True, [700], b"7"]


@pytest.mark.parametrize("name", PARAMETERS)
@pytest.mark.parametrize("value", NO_NUMBERS, ids=repr)
def test_what_is_no_number_is_refused_in_a_sentence(view, name, value):
    with pytest.raises(UserError, match="must be a number"):
        put(view, name, value)


def test_numbers_of_a_port_are_there_with_a_port(view):
    assert [one.is_there(view) for one in (LENS | PORT).values()] == [True] * 4 + [False] * 4
    assert all(one.is_there(with_port(view, True)) for one in (LENS | PORT).values())


def test_unknown_number_is_refused(view):
    with pytest.raises(UserError, match="width"):
        put(view, "width", 3)


@pytest.mark.parametrize("name", PARAMETERS)
def test_every_number_has_its_words_and_reads_back_what_was_put_brought_into_its_range(view, name):
    parameter = PARAMETERS[name]
    limits = parameter.range(view)
    assert parameter.label
    assert parameter.hint.endswith(".")
    for value, end in ((-1e300, limits.low), (1e300, limits.high)):
        assert parameter.get(put(view, name, value)) == pytest.approx(end)
    for share in (0.25, 0.6):
        value = round((limits.low + share * (limits.high - limits.low)) / limits.step) * limits.step
        changed = put(view, name, value)
        assert parameter.get(changed) == pytest.approx(value, abs=1e-6)
        assert parameter.range(changed) == limits
        assert name not in PORT or changed.camera.port is not None  # it puts one on
        assert changed.image is view.image


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [
        *[("fx", 900.5, 900.5), ("fx", -5, 128), ("fy", 1e300, 3200), ("cx", -1, 0), ("cy", 9e9, 479)],
        *[("diameter_cm", 45, 45), ("diameter_cm", 0, 1), ("diameter_cm", -3, 1), ("diameter_cm", 1e9, 300)],
        *[("level", 100, 100), ("level", -1, 0), ("level", 256, 255), ("level", 99.6, 100)],
        *[("z_cm", 1e9, 2000), ("z_cm", -5, 10), ("snow", 0, 0), ("surface_cm", 0, 0)],
    ],
)
def test_the_ends_of_some_ranges(view, name, value, expected):
    changed = put(view, name, value)
    assert PARAMETERS[name].get(changed) == pytest.approx(expected)
    assert changed.image is view.image


def test_where_numbers_stand_in_the_view(view):
    changed = put(put(put(view, "cx", 7), "diameter_cm", 45), "level", 99)
    assert (changed.camera.cx, changed.dock, changed.settings.level) == (7, Dock(0.45, view.dock.lights), 99)
    assert changed.given_camera == view.camera
    scene = put(put(put(view, "z_cm", 150), "snow", 0), "surface_cm", 0).scene
    assert scene is not None
    assert (scene.pose.position_m[2], scene.snow, scene.mirror) == (1.5, None, None)


def test_limits_hold_still_while_a_slider_moves_and_include_what_was_given():
    odd = Camera(5000, 60, -20, 600, 640, 480)
    view = open_source(None, odd, Dock(4.0))
    diameter = PARAMETERS["diameter_cm"]
    limits = {name: parameter.range(view) for name, parameter in LENS.items()}
    assert all(limits[name].clamp(getattr(odd, name)) == getattr(odd, name) for name in LENS)
    assert diameter.range(view).high == 800
    moved = put(put(view, "fx", 300), "diameter_cm", 20)
    assert {name: parameter.range(moved) for name, parameter in LENS.items()} == limits
    assert diameter.range(moved) == diameter.range(view)


def test_sliders_reach_a_fifth_to_either_side_of_what_was_given_and_as_far_as_what_was_typed(view):
    fx, diameter = PARAMETERS["fx"], PARAMETERS["diameter_cm"]
    assert fx.track(view) == Limits(560, 840, 0.7)
    assert diameter.track(view) == Limits(24, 36, 0.03)
    assert fx.track(put(view, "fx", 800)) == fx.track(view)
    assert fx.track(put(view, "fx", 900)) == Limits(560, 900, 0.7)
    assert diameter.track(put(view, "diameter_cm", 5)) == Limits(5, 36, 0.03)
    for name in ("lights", "level", "k1", "z_cm"):
        assert PARAMETERS[name].track(view) == PARAMETERS[name].range(view)
    odd = open_source(None, Camera(5000, 60, -20, 0, 640, 480), None)
    assert PARAMETERS["cx"].track(odd) == PARAMETERS["cx"].range(odd)
    assert PARAMETERS["cy"].track(odd) == PARAMETERS["cy"].range(odd)


def test_coefficients_come_and_go(view):
    bent = put(view, "k1", -0.2)
    assert bent.camera.distortion == (-0.2, 0, 0, 0, 0)
    assert put(bent, "k1", 0).camera.distortion == ()
    assert put(view, "p1", 9).camera.distortion[2] == 0.1


def test_other_lenses_keep_their_number_of_coefficients():
    eight = open_source(None, Camera(700, 700, 319.5, 239.5, 640, 480, (0.1,) * 8), None)
    assert put(eight, "k2", 0).camera.distortion == (0.1, 0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1)
    fisheye = open_source(None, Camera(300, 300, 319.5, 239.5, 640, 480, (0.1,) * 4, fisheye=True), None)
    assert put(fisheye, "p2", 0.05).camera.distortion == (0.1, 0.1, 0.1, 0.05)
    with pytest.raises(UserError, match="four coefficients"):
        put(fisheye, "k3", 0.1)


def test_given_distortion_is_within_the_limits():
    strong = open_source(None, Camera(700, 700, 319.5, 239.5, 640, 480, (3.0, -5.0, 0.2, -0.3, 9.0)), None)
    assert all(abs(one.get(strong)) <= one.range(strong).high for one in DISTORTION.values())


@pytest.mark.parametrize("name", SCENE)
def test_numbers_of_the_scene_show_the_scene(view, name):
    turned = put(view, name, SCENE[name].range(view).high)
    assert (turned.is_stale, turned.sample, turned.source) == (True, None, SOURCE_NAME)
    assert turned.camera == view.camera
