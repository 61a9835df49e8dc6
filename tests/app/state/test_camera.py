import math

import pytest
from dockpose import Camera
from dockpose.app.errors import UserError
from dockpose.app.state import camera as optics
from dockpose.app.state import view as state
from dockpose.app.state.camera import with_camera_file, with_coefficient, with_port, with_port_value
from dockpose.camera.files import FORMATS
from dockpose.camera.port import SEA_WATER, FlatPort


@pytest.fixture(scope="module")
def view():
    return state.open_source(None, None, None)


def test_one_focal_length_or_both(view):
    assert optics.with_focal(view, "fx", 800, both=False).camera.fy == view.camera.fy
    both = optics.with_focal(view, "fy", 800, both=True).camera
    assert (both.fx, both.fy) == (800, 800)


def test_coefficients_come_and_go(view):
    bent = with_coefficient(view, 0, -0.2)
    assert bent.camera.distortion == (-0.2, 0, 0, 0, 0)
    assert with_coefficient(bent, 0, 0).camera.distortion == ()
    assert with_coefficient(view, 2, 9).camera.distortion[2] == 0.1
    with pytest.raises(UserError, match="k2 is nan"):
        with_coefficient(view, 1, math.nan)


def test_other_lenses_keep_their_number_of_coefficients(view):
    eight = state.open_source(None, Camera(700, 700, 319.5, 239.5, 640, 480, (0.1,) * 8), None)
    assert with_coefficient(eight, 1, 0).camera.distortion == (0.1, 0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1)
    fisheye = state.open_source(None, Camera(300, 300, 319.5, 239.5, 640, 480, (0.1,) * 4, fisheye=True), None)
    assert with_coefficient(fisheye, 3, 0.05).camera.distortion == (0.1, 0.1, 0.1, 0.05)
    with pytest.raises(UserError, match="four coefficients"):
        with_coefficient(fisheye, 4, 0.1)


def test_port_is_put_on_set_and_taken_off(view):
    through = with_port(view, True)
    assert through.camera.port == optics.DEFAULT_PORT
    changed = with_port_value(with_port_value(through, "air_gap_m", 35), "water_index", SEA_WATER)
    assert changed.camera.port == FlatPort(0.035, 0.010, water_index=SEA_WATER)
    dense = with_port_value(through, "glass_index", 99).camera.port
    assert dense is not None
    assert dense.glass_index == 2.0
    assert with_port(changed, False).camera.port is None


def test_field_of_view_is_narrower_in_the_water(view):
    assert optics.field_of_view_sentence(view.camera) == "Field of view: 49.1° wide, 37.8° high."
    words = optics.field_of_view_sentence(with_port(view, True).camera)
    assert "in air" in words
    assert "36.3° wide" in words  # sin 24.55 deg / 1.333


def test_names_of_indices():
    assert optics.index_name(optics.WATERS, 1.34) == "sea water"
    assert optics.index_name(optics.WATERS, 1.35) == optics.OTHER_INDEX


@pytest.mark.parametrize("file_format", FORMATS)
def test_camera_files_are_saved_and_loaded(view, file_format):
    changed = with_coefficient(state.with_intrinsic(view, "fx", 812.5), 0, -0.1)
    loaded = with_camera_file(view, optics.camera_file(changed.camera, file_format), "mine.yaml")
    assert loaded.camera == changed.camera == loaded.given_camera
    assert loaded.note == ""


def test_camera_file_of_half_the_size_is_scaled_and_says_so(view):
    small = optics.camera_file(view.camera.for_size(320, 240), "ros")
    loaded = with_camera_file(view, small, "mine.yaml")
    assert loaded.camera.fx == view.camera.fx
    assert "mine.yaml is for 320 x 240" in loaded.note


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (b"", r"mine\.yaml: holds no keys"),
        (b"\x89PNG\xff", r"mine\.yaml: is not a text file"),
        (b"camera: {fx_px: 1, colour: red}", r"mine\.yaml: .*"),
        (optics.camera_file(Camera(700, 700, 300, 300, 600, 600), "dockpose"), r"mine\.yaml: .*600 x 600"),
    ],
)
def test_camera_file_that_does_not_fit_is_named(view, data, words):
    with pytest.raises(ValueError, match=words):
        with_camera_file(view, data, "mine.yaml")


def test_port_needs_our_own_format_and_unknown_ones_are_refused(view):
    with pytest.raises(ValueError, match="port"):
        optics.camera_file(with_port(view, True).camera, "ros")
    with pytest.raises(UserError, match="no format"):
        optics.camera_file(view.camera, "../etc")


def test_default_values(view):
    back = optics.with_default_values(with_port(state.with_diameter_cm(view, 99), True))
    assert (back.camera, back.dock) == (state.guess_camera(view.image), state.DEFAULT_DOCK)
