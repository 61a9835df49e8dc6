import pytest
from dockpose import Camera
from dockpose.app.state import camera as optics
from dockpose.app.state import view as state
from dockpose.app.state.camera import with_camera_file, with_given_values, with_port
from dockpose.app.state.changes import with_lights
from dockpose.app.state.parameters import put
from dockpose.camera.files import FORMATS
from dockpose.camera.port import SEA_WATER, FlatPort


def test_port_is_put_on_set_and_taken_off(view):
    through = with_port(view, True)
    assert through.camera.port == optics.DEFAULT_PORT
    changed = put(put(through, "air_gap_mm", 35), "water_index", SEA_WATER)
    assert changed.camera.port == FlatPort(0.035, 0.010, water_index=SEA_WATER)
    dense = put(through, "glass_index", 99).camera.port
    assert dense is not None
    assert dense.glass_index == 2.0
    assert with_port(changed, False).camera.port is None


def test_field_of_view_is_narrower_in_the_water(view):
    assert optics.field_of_view_sentence(view.camera) == "Field of view: 49.1° wide, 37.8° high."
    words = optics.field_of_view_sentence(with_port(view, True).camera)
    assert "in air" in words
    assert "36.3° wide" in words  # sin 24.55 deg / 1.333


def test_the_tone_curve_is_chosen_by_name_or_gamma(view):
    assert optics.with_tone(view, "srgb").camera.tone == "srgb"
    odd = optics.with_tone(view, "1.8")
    assert odd.camera.tone == 1.8
    assert optics.tone_names(odd.camera) == ["linear", "srgb", "2.2", "1.8"]
    assert optics.with_tone(odd, "linear").camera == view.camera


def test_names_of_indices():
    assert optics.index_name(optics.WATERS, 1.34) == "sea water"
    assert optics.index_name(optics.WATERS, 1.35) == optics.OTHER_INDEX


@pytest.mark.parametrize("file_format", FORMATS)
def test_camera_files_are_saved_and_loaded(view, file_format):
    changed = put(put(view, "fx", 812.5), "k1", -0.1)
    loaded = with_camera_file(view, optics.camera_file(changed.camera, file_format), "mine.yaml")
    assert loaded.camera == changed.camera == loaded.given_camera
    assert loaded.notes == ()


def test_camera_file_of_half_the_size_is_scaled_and_says_so(view):
    small = optics.camera_file(view.camera.for_size(320, 240), "ros")
    loaded = with_camera_file(view, small, "mine.yaml")
    assert loaded.camera.fx == view.camera.fx
    assert "My tank is for 320 x 240; its values were scaled to 640 x 480" in loaded.notes[0]


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
    with pytest.raises(ValueError, match="file_format is"):
        optics.camera_file(view.camera, "../etc")


def test_default_values(view):
    back = optics.with_default_values(with_port(put(view, "diameter_cm", 99), True))
    assert (back.camera, back.dock) == (state.guess_camera(view.image), state.DEFAULT_DOCK)


def test_back_to_the_given_values(view):
    changed = with_lights(put(put(view, "cy", 1), "diameter_cm", 99), 0)
    back = with_given_values(changed)
    assert (back.camera, back.dock) == (view.camera, view.dock)
