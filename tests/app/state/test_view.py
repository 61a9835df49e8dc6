import math

import cv2
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.sidecar import load_sample
from dockpose.app.resources import sample_names, sample_path
from dockpose.app.state import view as state
from dockpose.camera.image import ImageError

NO_NUMBERS = [math.nan, math.inf, -math.inf, "700", None, True, [700], b"7"]
SETTERS = {
    "fx": lambda view, value: state.with_intrinsic(view, "fx", value),
    "cy": lambda view, value: state.with_intrinsic(view, "cy", value),
    "diameter": state.with_diameter_cm,
    "lights": state.with_lights,
    "level": state.with_level,
    "area": state.with_min_area,
}


@pytest.fixture
def view():
    return state.open_source(None, None, None)


def png(width, height):
    return cv2.imencode(".png", np.full((height, width), 20, np.uint8))[1].tobytes()


def test_starts_on_the_first_sample(view):
    sample = load_sample(sample_names()[0])
    assert (view.source, view.sample, view.camera, view.dock) == (sample.name, sample.name, sample.camera, sample.dock)
    assert view.truth == sample.truth
    assert view.note == ""


def test_opens_a_picture_with_the_values_beside_it():
    view = state.open_source(str(sample_path("tilted")), None, None)
    assert (view.source, view.sample, view.camera) == ("tilted.png", None, load_sample("tilted").camera)
    assert view.truth is not None


def test_given_camera_and_dock_go_before_those_beside_the_picture():
    camera, dock = Camera(800, 810, 300, 200, 640, 480), Dock(2.0, 12)
    view = state.open_source(str(sample_path("tilted")), camera, dock)
    assert (view.camera, view.dock) == (camera, dock)


def test_camera_of_another_shape_is_refused():
    with pytest.raises(ValueError, match="640 x 480"):
        state.open_source(None, Camera(800, 800, 300, 300, 600, 600), None)


def test_picture_of_unknown_camera_gets_a_guess_and_a_note(tmp_path):
    (tmp_path / "tank.png").write_bytes(png(400, 300))
    view = state.open_source(str(tmp_path / "tank.png"), None, None)
    assert math.degrees(view.camera.field_of_view_rad[0]) == pytest.approx(60)
    assert (view.camera.cx, view.camera.cy) == (199.5, 149.5)
    assert view.dock == state.DEFAULT_DOCK
    assert "400 x 300" in view.note


def test_missing_picture_is_named():
    with pytest.raises(ImageError, match=r"nowhere\.png"):
        state.open_source("nowhere.png", None, None)


def test_sample_brings_its_own_values_and_keeps_the_settings(view):
    changed = state.with_min_area(state.with_intrinsic(view, "fx", 900), 9)
    tilted = state.with_sample(changed, "tilted")
    assert tilted.camera == load_sample("tilted").camera
    assert tilted.settings.min_area_px == 9
    assert tilted.sample == "tilted"


@pytest.mark.parametrize("name", ["", "../../etc/passwd", None, 3, ["plain"]])
def test_unknown_sample_is_refused(view, name):
    with pytest.raises(UserError, match="no sample"):
        state.with_sample(view, name)


def test_upload_of_the_same_size_keeps_camera_and_dock(view):
    changed = state.with_diameter_cm(state.with_intrinsic(view, "fx", 900), 45)
    uploaded = state.with_upload(changed, png(640, 480), "a.png")
    assert (uploaded.camera, uploaded.dock) == (changed.camera, changed.dock)
    assert (uploaded.source, uploaded.sample, uploaded.truth, uploaded.note) == ("a.png", None, None, "")


def test_upload_at_half_size_scales_the_camera_and_says_so(view):
    uploaded = state.with_upload(view, png(320, 240), "a.png")
    assert uploaded.camera.fx == view.camera.fx / 2
    assert "scaled" in uploaded.note


def test_upload_of_another_shape_gets_a_guessed_camera_and_says_so(view):
    uploaded = state.with_upload(view, png(300, 300), "a.png")
    assert (uploaded.camera.width, uploaded.camera.height) == (300, 300)
    assert uploaded.camera.fx == pytest.approx(150 / math.tan(math.radians(30)))
    assert "60 degrees" in uploaded.note


@pytest.mark.parametrize("data", [b"", b"junk", png(64, 48)[:60]])
def test_upload_that_is_no_picture_is_named(view, data):
    with pytest.raises(ImageError, match=r"notes\.png"):
        state.with_upload(view, data, "notes.png")


@pytest.mark.parametrize("setter", SETTERS.values(), ids=SETTERS.keys())
@pytest.mark.parametrize("value", NO_NUMBERS, ids=repr)
def test_what_is_no_number_is_refused_in_a_sentence(view, setter, value):
    with pytest.raises(UserError, match="must be a number"):
        setter(view, value)


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [("fx", 900.5, 900.5), ("fx", -5, 128), ("fy", 1e300, 3200), ("cx", -1, 0), ("cy", 9e9, 479)],
)
def test_intrinsics_are_brought_into_range(view, name, value, expected):
    changed = state.with_intrinsic(view, name, value)
    assert getattr(changed.camera, name) == expected
    assert changed.given_camera == view.camera
    assert changed.image is view.image


def test_unknown_intrinsic_is_refused(view):
    with pytest.raises(UserError, match="width"):
        state.with_intrinsic(view, "width", 3)


def test_limits_hold_still_while_a_slider_moves_and_include_what_was_given():
    odd = Camera(5000, 60, -20, 600, 640, 480)
    view = state.open_source(None, odd, Dock(4.0))
    limits = state.intrinsic_limits(view)
    assert all(limits[name].clamp(getattr(odd, name)) == getattr(odd, name) for name in state.INTRINSICS)
    assert state.diameter_limits_cm(view).high == 800
    moved = state.with_diameter_cm(state.with_intrinsic(view, "fx", 300), 20)
    assert state.intrinsic_limits(moved) == limits
    assert state.diameter_limits_cm(moved) == state.diameter_limits_cm(view)


@pytest.mark.parametrize(("centimetres", "metres"), [(45, 0.45), (0, 0.01), (-3, 0.01), (1e9, 3.0)])
def test_diameter_is_typed_in_centimetres(view, centimetres, metres):
    assert state.with_diameter_cm(view, centimetres).dock == Dock(metres, view.dock.lights)


@pytest.mark.parametrize(("value", "lights"), [(0, None), (-2, None), (1, 3), (8, 8), (8.4, 8), (1000, 60)])
def test_number_of_lights(view, value, lights):
    assert state.with_lights(view, value).dock.lights == lights


@pytest.mark.parametrize(("value", "level"), [(100, 100), (-1, 0), (256, 255), (99.6, 100)])
def test_level(view, value, level):
    assert state.with_level(view, value).settings.level == level


def test_method_takes_the_level_it_starts_from(view):
    settings = state.with_method(view, "fixed", 166).settings
    assert (settings.method, settings.level) == ("fixed", 166)


@pytest.mark.parametrize("method", ["otsus", "", None, 1, ["hats"]])
def test_unknown_method_is_refused(view, method):
    with pytest.raises(UserError, match="no threshold method"):
        state.with_method(view, method, 100)


def test_back_to_the_given_values(view):
    changed = state.with_lights(state.with_diameter_cm(state.with_intrinsic(view, "cy", 1), 99), 0)
    back = state.with_given_values(changed)
    assert (back.camera, back.dock) == (view.camera, view.dock)
