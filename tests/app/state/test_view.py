import hashlib
import math

import cv2
import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.app.errors import UserError
from dockpose.app.inputs.pictures import load_sample
from dockpose.app.state import view as state
from dockpose.app.state.camera import with_these_as_mine
from dockpose.app.state.scene import with_scene
from dockpose.app.state.view import MeasuredPose, number_text, typed_number
from dockpose.camera.image import ImageError
from dockpose.pose.known import KnownPose
from dockpose.sidecar import sample_names, sample_path


def png(width, height):
    return cv2.imencode(".png", np.full((height, width), 20, np.uint8))[1].tobytes()


def test_starts_on_the_first_sample(view):
    sample = load_sample(sample_names()[0])
    assert (view.source, view.sample, view.camera, view.dock) == ("plain", "plain", sample.camera, sample.dock)
    assert view.truth == sample.truth
    assert view.note == ""


def test_opens_a_picture_with_the_values_beside_it_which_given_ones_go_before():
    view = state.open_source(str(sample_path("tilted")), None, None)
    assert (view.source, view.sample, view.camera) == ("tilted.png", None, load_sample("tilted").camera)
    assert view.truth is not None
    camera, dock = Camera(800, 810, 300, 200, 640, 480), Dock(2.0, 12)
    view = state.open_source(str(sample_path("tilted")), camera, dock)
    assert (view.camera, view.dock) == (camera, dock)


def test_camera_of_another_shape_is_refused_and_a_missing_picture_named():
    with pytest.raises(ValueError, match="640 x 480"):
        state.open_source(None, Camera(800, 800, 300, 300, 600, 600), None)
    with pytest.raises(ImageError, match=r"nowhere\.png"):
        state.open_source("nowhere.png", None, None)


def test_picture_of_unknown_camera_gets_a_guess_and_a_note(tmp_path):
    (tmp_path / "tank.png").write_bytes(png(400, 300))
    view = state.open_source(str(tmp_path / "tank.png"), None, None)
    assert math.degrees(view.camera.field_of_view_rad[0]) == pytest.approx(60)
    assert (view.camera.cx, view.camera.cy) == (199.5, 149.5)
    assert view.dock == state.DEFAULT_DOCK
    assert "400 x 300" in view.notes[0]


@pytest.mark.parametrize("name", ["", "../../etc/passwd", None, 3, ["plain"]])
def test_unknown_sample_is_refused(view, name):
    with pytest.raises(ValueError, match="sample is"):
        state.with_sample(view, name)


def test_upload_at_half_size_scales_the_camera_and_one_of_another_shape_gets_a_guess_and_both_say_so(view):
    uploaded = state.with_upload(with_these_as_mine(view), png(320, 240), "a.png")
    assert uploaded.camera.fx == view.camera.fx / 2
    assert "scaled" in uploaded.notes[0]
    uploaded = state.with_upload(with_these_as_mine(view), png(300, 300), "a.png")
    assert uploaded.notes[0].startswith("The camera of My tank is for 640 x 480. No camera is known")
    assert (uploaded.camera.width, uploaded.camera.height) == (300, 300)
    assert uploaded.camera.fx == pytest.approx(150 / math.tan(math.radians(30)))
    assert "60 degrees" in uploaded.notes[0]


def test_the_checksum_is_that_of_the_bytes_that_were_opened(view, tmp_path):
    data = sample_path("tilted").read_bytes()
    right = hashlib.sha256(data).hexdigest()
    (tmp_path / "tank.png").write_bytes(data)
    (tmp_path / "beside.png").write_bytes(data)
    (tmp_path / "beside.yaml").write_bytes(sample_path("tilted").with_suffix(".yaml").read_bytes())
    opened = state.open_source(str(tmp_path / "tank.png"), None, None)
    assert opened.sha256 == right
    assert (opened.list_name, opened.item) == ("beside", "tank.png")
    for name in ("tank.png", "beside.png"):
        assert state.with_file(view, tmp_path / name, name).sha256 == right
    (tmp_path / "tank.png").unlink()  # a file that is gone or changed meanwhile does not matter
    assert opened.sha256 == right
    assert state.with_upload(view, data, "mine.png").sha256 == right
    assert state.with_sample(view, "tilted").sha256 == right
    assert view.sha256 == hashlib.sha256(sample_path("plain").read_bytes()).hexdigest()
    # Simulated pictures and frames have none.
    assert with_scene(view, view.scene).sha256 is None
    assert state.with_frame(view, view.image, "dive.mp4, frame 1").sha256 is None


@pytest.mark.parametrize(
    ("text", "number"), [("", None), (" ", None), ("0", 0), (" 1,5 ", 1.5), ("−4", -4), ("-.5", -0.5), ("007", 7)]
)
def test_blank_is_never_zero_and_zero_never_blank(text, number):
    assert typed_number("z", text) == number
    assert number is None or typed_number("z", number_text(number)) == number


@pytest.mark.parametrize(
    ("name", "text", "number"),
    [
        *[("z (cm)", "1,58 m", 158), ("z (cm)", "1.58m", 158), ("z (cm)", "-4 mm", -0.4), ("z (cm)", "12cm", 12)],
        *[("Side (mm)", "2.4 cm", 24), ("θx (°)", "12°", 12), ("θx (°)", "−3 deg", -3), ("fx (px)", "700,5 px", 700.5)],
    ],
)
def test_a_unit_that_is_typed_is_heeded(name, text, number):
    assert typed_number(name, text) == pytest.approx(number, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "text"), [("z (cm)", "2 °"), ("z (cm)", "2 px"), ("θx (°)", "2 m"), ("fx (px)", "2 cm"), ("z (cm)", "m")]
)
def test_a_unit_of_something_else_is_refused(name, text):
    with pytest.raises(UserError, match=f"is '{text}'; it must be a number"):
        typed_number(name, text)


@pytest.mark.parametrize("text", ["T", "1t", "-", "1e400", "nan", "1 2", "1.2.3", "1.5m", "1,58 x"])
def test_what_is_no_number_is_refused_by_name(text):
    with pytest.raises(UserError, match=r"^Measured z is .*it must be a number"):
        typed_number("Measured z", text)


def test_only_a_whole_pose_is_one():
    assert MeasuredPose(1, 2, 3, 4, 5).pose == KnownPose((0.01, 0.02, 0.03), 4, 5)
    for missing in MeasuredPose.__struct_fields__:
        values = dict.fromkeys(MeasuredPose.__struct_fields__, 1.0) | {missing: None}
        assert MeasuredPose(**values).pose is None
