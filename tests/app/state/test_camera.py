import json

import cv2
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.app.inputs.pictures import load_sample
from dockpose.app.state import camera as optics
from dockpose.app.state.changes import chips
from dockpose.app.state.parameters import put
from dockpose.app.state.scene import with_scene
from dockpose.app.state.tank import Tank
from dockpose.app.state.view import open_source, with_file, with_first_frame, with_frame, with_sample, with_upload
from dockpose.camera.files import save_camera
from dockpose.camera.port import SEA_WATER, FlatPort

CAMERA = Camera(812.0, 812.0, 319.5, 239.5, 640, 480)
MINE = Tank("Pool A", CAMERA, Dock(0.45, 8), knows_diameter=True)
PICTURE = cv2.imencode(".png", np.full((480, 640), 20, np.uint8))[1].tobytes()
SQUARE = cv2.imencode(".png", np.full((300, 300), 20, np.uint8))[1].tobytes()


@pytest.fixture
def sample():
    return open_source(None, None, None, MINE)


@pytest.fixture
def own(sample):
    return put(with_upload(sample, PICTURE, "a.png"), "min_area_px", 9)


def do(view, change, *arguments):
    """As the page changes a view."""
    return optics.kept(view, change(view, *arguments))


def fx_of(tank):
    assert tank.camera is not None
    return tank.camera.fx


def test_a_look_at_a_sample_never_touches_my_tank(own):
    for name in ("plain", "tilted", "flat_port"):
        look = do(own, with_sample, name)
        assert (look.tank, look.camera_of, look.dock_of) == (MINE, "picture", "picture")
        assert (look.camera, look.sample, look.settings) == (load_sample(name).camera, name, own.settings)
        look = do(do(look, put, "fx", 555), put, "diameter_cm", 99)
        assert (look.camera.fx, look.tank) == (555, MINE)
        look = do(look, with_scene, look.scene)
        assert look.tank == MINE
        back = with_upload(look, PICTURE, "b.png")
        assert (back.camera, back.dock, optics.is_in_force(back)) == (CAMERA, MINE.dock, True)
        assert (back.source, back.sample, back.truth, back.notes) == ("b.png", None, None, ())


def test_what_is_changed_on_an_own_picture_is_my_tank_s(own):
    changed = do(do(do(do(own, put, "fx", 900), put, "cy", 1), put, "lights", 0), put, "diameter_cm", 50)
    assert (fx_of(changed.tank), changed.tank.dock.diameter, changed.tank.name) == (900, 0.5, "Pool A")
    back = do(changed, optics.with_given_values)
    assert (back.tank, back.camera, back.dock) == (MINE, CAMERA, MINE.dock)
    other = do(changed, optics.with_tank, Tank("Pool B", dock=Dock(0.9, 4), knows_diameter=True))
    assert (do(put(other, "diameter_cm", 70), optics.with_given_values).dock.diameter, other.camera_of) == (
        0.9,
        "guess",
    )


def test_the_ratio_of_the_file_outlives_the_picture_on_which_it_was_changed(own, sample):
    stretched = do(own, put, "fx", 900)
    for view in (
        stretched,
        with_upload(stretched, PICTURE, "b.png"),
        with_upload(with_sample(stretched, "plain"), PICTURE, "c"),
    ):
        assert (view.camera.fx / view.camera.fy, view.given_fx_per_fy) == (pytest.approx(900 / 812), 1)
    assert with_sample(stretched, "plain").given_fx_per_fy == 1
    wide = Camera(1000, 800, 319.5, 239.5, 640, 480)
    assert optics.with_own_camera(stretched, wide, "wide").given_fx_per_fy == 1.25
    taken = do(do(with_sample(own, "plain"), put, "fx", 770), optics.with_these_as_mine)
    assert (with_upload(taken, PICTURE, "b.png").given_fx_per_fy, taken.camera.fx / taken.camera.fy) == (1, 1.1)


def test_guessed_camera_is_the_operators_once_a_number_is_typed_and_its_note_goes(sample):
    view = with_upload(open_source(None, None, None), SQUARE, "a.png")
    assert (view.camera_of, "60 degrees was assumed" in view.notes[0]) == ("guess", True)
    typed = do(view, put, "fx", 333)
    assert (typed.camera_of, typed.notes, fx_of(typed.tank)) == ("tank", (), 333)
    other = with_upload(sample, SQUARE, "a.png")  # My tank's camera is for another shape
    assert (other.camera_of, other.tank, other.dock) == ("guess", MINE, MINE.dock)


def test_camera_file_is_the_operators_whatever_is_looked_at(sample):
    loaded = do(
        sample,
        optics.with_camera_file,
        optics.camera_file(Camera(600, 600, 319.5, 239.5, 640, 480), "dockpose"),
        "c.yaml",
    )
    assert (loaded.camera.fx, fx_of(loaded.tank), loaded.tank.dock) == (600, 600, MINE.dock)
    assert optics.in_force_words(loaded) == "In use here: My tank's camera and the dock of the sample."


def test_a_calibrated_camera_is_my_tank_s_whichever_picture_is_open(sample, own):
    new = Camera(650, 650, 319.5, 239.5, 640, 480)
    used = do(own, optics.with_calibrated_camera, new)
    assert (used.camera, used.camera_of, used.tank.camera, used.notes) == (new, "tank", new, ())
    square = with_upload(sample, SQUARE, "a.png")
    used = do(square, optics.with_calibrated_camera, new)
    assert (used.tank.camera, used.camera_of, used.camera) == (new, "guess", square.camera)
    assert "The calibrated camera, for 640 x 480, is My tank's; this picture has another shape." in used.notes
    assert with_upload(used, PICTURE, "b.png").camera == new
    sample_square = do(sample, optics.with_calibrated_camera, Camera(650, 650, 149.5, 149.5, 300, 300))
    assert (sample_square.camera_of, sample_square.camera) == ("picture", sample.camera)


def test_picture_with_a_yaml_beside_it_says_which_it_uses(sample, tmp_path):
    (tmp_path / "dive.png").write_bytes(PICTURE)
    other = Camera(500, 500, 319.5, 239.5, 640, 480)
    save_camera(other, tmp_path / "dive.yaml", "dockpose")
    view = with_file(sample, tmp_path / "dive.png", "dive.png")
    assert (view.camera, view.dock, view.tank) == (other, MINE.dock, MINE)
    assert optics.in_force_words(view) == "In use here: the camera of dive.yaml and My tank's dock."
    assert do(view, optics.with_my_tank).camera == CAMERA


def test_origin_of_what_a_picture_brings(sample):
    assert optics.origin(sample) == "the sample"
    assert optics.in_force_words(sample) == "In use here: camera and dock of the sample."
    assert optics.in_force_words(do(sample, put, "fx", 600)).endswith("of the sample, changed by hand.")
    assert optics.origin(with_scene(sample, sample.scene)) == "the simulated scene"
    assert optics.origin(with_first_frame(sample, sample.image, "x", None, None)) == "the sequence"


def test_sequence_is_seen_with_my_tank_unless_it_brings_its_own(sample):
    first = with_first_frame(sample, sample.image, "frame 1", None, None)
    assert (first.camera, first.camera_of, first.dock) == (CAMERA, "tank", MINE.dock)
    later = with_frame(do(first, put, "fx", 900), sample.image, "frame 2")
    assert (later.camera.fx, later.camera_of) == (900, "tank")
    brought = with_first_frame(sample, sample.image, "frame 1", Camera(1, 1, 1, 1, 640, 480), None)
    assert (brought.camera_of, brought.dock_of, brought.tank) == ("picture", "tank", MINE)
    assert with_frame(brought, sample.image, "frame 2").camera_of == "picture"


def test_another_tank_is_in_force_on_own_pictures_only(sample, own):
    other = Tank("Pool B", Camera(700, 700, 319.5, 239.5, 640, 480), Dock(0.3, 12))
    assert do(own, optics.with_tank, other).camera == other.camera
    look = do(sample, optics.with_tank, other)
    assert (look.tank, look.camera) == (other, sample.camera)


def test_what_is_given_or_in_force_can_be_my_tank_but_no_assumption(sample):
    view = open_source(None, CAMERA, Dock(0.2, 6), MINE)
    assert (view.tank.camera, view.tank.dock, optics.is_in_force(view)) == (CAMERA, Dock(0.2, 6), True)
    mine = do(sample, optics.with_these_as_mine)
    assert (mine.tank.camera, mine.tank.dock, optics.is_in_force(mine)) == (sample.camera, sample.dock, True)
    guess = optics.with_these_as_mine(with_upload(open_source(None, None, None), SQUARE, "a.png"))
    assert (guess.tank.camera, guess.camera_of) == (None, "guess")


def test_diameter_is_assumed_until_somebody_gives_it_or_a_picture_brings_it(sample):
    assert sample.assumed == ()
    view = with_upload(open_source(None, CAMERA, None), PICTURE, "a.png")
    assert (view.assumed, view.dock.diameter) == (("dock",), 0.3)
    with_eight = do(view, put, "lights", 8)
    assert (with_eight.assumed, with_eight.tank.dock.lights) == (("dock",), 8)  # which do not say how large the ring is
    assert do(view, put, "diameter_cm", 45).assumed == ()
    assert do(do(view, put, "diameter_cm", 45), put, "diameter_cm", 30).assumed == ()
    (offer,) = [chip for chip in chips(view) if "assumed" in chip.label]
    entered = do(view, offer.press)
    assert (entered.assumed, entered.dock) == ((), view.dock)
    assert with_upload(entered, PICTURE, "b.png").assumed == ()
    assert not [chip for chip in chips(entered) if "assumed" in chip.label]


def test_port_is_put_on_set_and_taken_off(view):
    through = optics.with_port(view, True)
    assert through.camera.port == optics.DEFAULT_PORT
    changed = put(put(through, "air_gap_mm", 35), "water_index", SEA_WATER)
    assert changed.camera.port == FlatPort(0.035, 0.010, water_index=SEA_WATER)
    dense = put(through, "glass_index", 99).camera.port
    assert dense is not None
    assert dense.glass_index == 2.0
    assert optics.with_port(changed, False).camera.port is None


def test_field_of_view_is_narrower_in_the_water(view):
    assert optics.field_of_view_sentence(view.camera) == "Field of view: 49.1° wide, 37.8° high."
    words = optics.field_of_view_sentence(optics.with_port(view, True).camera)
    assert "in air" in words
    assert "36.3° wide" in words  # sin 24.55 deg / 1.333


def test_camera_files_are_saved_and_loaded(view):
    changed = put(put(view, "fx", 812.5), "k1", -0.1)
    loaded = optics.with_camera_file(view, optics.camera_file(changed.camera, "ros"), "mine.yaml")
    assert loaded.camera == changed.camera == loaded.given_camera
    assert loaded.notes == ()


def test_a_camera_file_without_a_size_is_for_the_picture_in_view_and_notes_are_shown(view):
    data = b'{"mtx": [[800, 0.1, 320], [0, 810, 240], [0, 0, 1]], "dist": [0, 0, 0, 0, 0]}'
    loaded = optics.with_camera_file(view, data, "mine.json")
    assert (loaded.camera.fy, loaded.camera.width, loaded.camera.height) == (810, 640, 480)
    assert loaded.notes == ("mine.json: its skew of 0.1 pixels is taken as none",)


def test_the_note_on_the_first_of_several_cameras_names_the_file_that_was_sent(view):
    data = json.dumps({f"K{n}": [[700, 0, 319.5], [0, 700, 239.5], [0, 0, 1]] for n in (1, 2)}).encode()
    note = optics.with_camera_file(view, data, "pair.json").note
    assert note == "pair.json: has the cameras 1, 2; 1 is taken, pair.json#NAME takes another"


def test_camera_file_of_half_the_size_is_scaled_and_says_so(view):
    small = optics.camera_file(view.camera.for_size(320, 240), "ros")
    loaded = optics.with_camera_file(view, small, "mine.yaml")
    assert loaded.camera.fx == view.camera.fx
    assert "My tank is for 320 x 240; its values were scaled to 640 x 480" in loaded.notes[0]


def test_camera_file_of_another_shape_waits_for_ones_own_pictures_where_the_one_shown_has_its_own(view, sample):
    square = Camera(700, 700, 299.5, 299.5, 600, 600)
    data = optics.camera_file(square, "dockpose")
    kept = optics.with_camera_file(view, data, "mine.yaml")
    assert (kept.tank.camera, kept.camera) == (square, view.camera)
    assert kept.notes == ("mine.yaml is for pictures of 600 x 600; the one shown keeps its own camera.",)
    assert with_upload(kept, SQUARE, "own.png").camera_of == "tank"
    with pytest.raises(ValueError, match=r"mine\.yaml: .*600 x 600"):
        optics.with_camera_file(with_upload(sample, PICTURE, "own.png"), data, "mine.yaml")


def test_camera_file_whose_shape_is_off_by_rounding_is_used_at_once(view):
    rounded = Camera(350, 350, 159.5, 119.0, 320, 239)  # half of 640 x 479, as halving a picture rounds
    found = optics.with_camera_file(view, optics.camera_file(rounded, "dockpose"), "half.yaml")
    assert (found.camera_of, found.camera.fx) == ("tank", pytest.approx(700, rel=0.01))


def test_port_needs_our_own_format_and_unknown_ones_are_refused(view):
    with pytest.raises(ValueError, match="port"):
        optics.camera_file(optics.with_port(view, True).camera, "ros")
    with pytest.raises(ValueError, match="file_format is"):
        optics.camera_file(view.camera, "../etc")
