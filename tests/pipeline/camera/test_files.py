import cv2
import msgspec
import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.files import FORMATS, load_camera, save_camera
from dockpose.camera.port import SEA_WATER, FlatPort
from dockpose.files import FileError

# Numbers that need every digit of a double.
CAMERA = Camera(
    700 / 3, 1 / 3e-3, 320.1 + 1e-10, 239.9, 640, 480, (-0.1 / 3, 1e-7 / 3, 3.3e-05, -2 / 3e3, 1.2345678901234567)
)
ROS = """\
image_width: 1280
image_height: 720
camera_name: tank
camera_matrix:
  rows: 3
  cols: 3
  data: [901.5, 0., 640.25, 0., 902.5, 360.75, 0., 0., 1.]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.21, 1e-02, 0.0005, -0.0003, 0]
rectification_matrix:
  rows: 3
  cols: 3
  data: [1, 0, 0, 0, 1, 0, 0, 0, 1]
projection_matrix:
  rows: 3
  cols: 4
  data: [900, 0, 640, 0, 0, 900, 360, 0, 0, 0, 1, 0]
"""


@pytest.fixture
def write(tmp_path):
    def write(text):
        path = tmp_path / "camera.yaml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("file_format", FORMATS)
@pytest.mark.parametrize(
    "camera",
    [
        CAMERA,
        msgspec.structs.replace(CAMERA, distortion=(*CAMERA.distortion, 0.1, 0.2, 1 / 3)),
        msgspec.structs.replace(CAMERA, distortion=(*CAMERA.distortion, 0.1, 0.2, 1 / 3, *[1e-3 / 3] * 6)),
        msgspec.structs.replace(CAMERA, distortion=CAMERA.distortion[:4], fisheye=True),
    ],
)
def test_round_trip_is_exact(tmp_path, file_format, camera):
    if file_format == "kalibr":  # has four coefficients
        camera = msgspec.structs.replace(camera, distortion=camera.distortion[:4])
    save_camera(camera, tmp_path / "c.yaml", file_format)
    assert load_camera(tmp_path / "c.yaml") == camera


@pytest.mark.parametrize("model", ["equidistant", "fisheye"])
def test_reads_a_fisheye_of_ros_under_both_its_names(write, model):
    text = ROS.replace("plumb_bob", model).replace("cols: 5", "cols: 4").replace("-0.0003, 0]", "-0.0003]")
    camera = load_camera(write(text))
    assert camera.fisheye
    assert camera.distortion == (-0.21, 0.01, 0.0005, -0.0003)


@pytest.mark.parametrize(
    ("name", "value"), [("port", FlatPort(0.03, 0.01, water_index=SEA_WATER)), ("tone", "srgb"), ("tone", 2.2)]
)
def test_what_other_formats_have_no_place_for_is_kept_in_our_own_and_dropped_in_none(tmp_path, name, value):
    camera = Camera(700, 700, 320, 240, 640, 480, **{name: value})
    save_camera(camera, tmp_path / "c.yaml")
    assert load_camera(tmp_path / "c.yaml") == camera
    for file_format in FORMATS[1:]:
        with pytest.raises(ValueError, match=f"'{file_format}', which has no place for the {name}; use dockpose"):
            save_camera(camera, tmp_path / "c.yaml", file_format)


def test_reads_what_the_ros_calibrator_writes(write):
    expected = Camera(901.5, 902.5, 640.25, 360.75, 1280, 720, (-0.21, 0.01, 0.0005, -0.0003, 0.0))
    assert load_camera(write(ROS)) == expected


def test_kalibr_has_no_place_for_a_fifth_coefficient(tmp_path):
    with pytest.raises(ValueError, match="no place for the fifth coefficient"):
        save_camera(CAMERA, tmp_path / "c", "kalibr")


@pytest.mark.parametrize(("name", "file_format"), [("c.yml", "opencv"), ("c.xml", "opencv-xml")])
def test_opencv_reads_what_we_write_for_it(tmp_path, name, file_format):
    save_camera(CAMERA, tmp_path / name, file_format)
    storage = cv2.FileStorage(str(tmp_path / name), cv2.FileStorage_READ)
    np.testing.assert_array_equal(storage.getNode("camera_matrix").mat(), CAMERA.matrix)
    np.testing.assert_array_equal(storage.getNode("distortion_coefficients").mat(), [CAMERA.distortion])
    assert storage.getNode("image_width").real() == 640


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("image_width: 1280\n", "", "image_width"),
        ("camera_matrix:", "camera_matrix: 3\nother:", "camera_matrix"),
        ("cols: 3\n  data: [901.5", "cols: 2\n  data: [901.5", "camera_matrix says 3 x 2, but its data has 9"),
        ("rows: 3\n  cols: 3\n  data: [901.5", "rows: 1\n  cols: 9\n  data: [901.5", "camera_matrix is 1 x 9"),
        ("901.5", "-901.5", "fx is -901.5"),
        ("901.5", "broken", r"camera_matrix\.data"),
        ("901.5, 0.", "901.5, 3.", "camera_matrix is"),
        ("plumb_bob", "thin_prism", "distortion_model is 'thin_prism'"),
        ("plumb_bob", "equidistant", "distortion_coefficients has 5 values; equidistant has 4"),
        ("plumb_bob", "rational_polynomial", "distortion_coefficients has 5 values"),
        ("image_width: 1280", "image_width: [1280", "not valid YAML, line"),
    ],
)
def test_a_wrong_ros_file_says_which_key(write, old, new, message):
    assert old in ROS
    with pytest.raises(FileError, match=message) as raised:
        load_camera(write(ROS.replace(old, new, 1)))
    assert "camera.yaml" in str(raised.value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("camera: {fx_px: 1, fy_px: 1, cx_px: 1, cy_px: 1, width_px: 1, height_px: 1, focal: 3}\n", "focal"),
        ("camera: {fx_px: 1, fy_px: 1, cx_px: 1, cy_px: 1, width_px: 1}\n", "height_px"),
        ("camera: !!python/object/apply:os.getcwd []\n", "not valid YAML"),
        ("%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix 3\n", "expected a mapping"),
        *((text, r"camera\.yaml") for text in ("", "just words", "- a\n- b\n", "threshold: 3\n")),
    ],
)
def test_a_file_without_a_camera_or_with_a_wrong_one_is_refused(write, text, message):
    with pytest.raises(FileError, match=message):
        load_camera(write(text))


def test_a_file_that_is_no_text_or_is_missing_is_refused(tmp_path):
    (tmp_path / "c.yaml").write_bytes(b"\x89PNG\xff\xfe\x00")
    with pytest.raises(FileError, match=r"c\.yaml: is a picture"):
        load_camera(tmp_path / "c.yaml")
    with pytest.raises(FileError, match=r"none\.yaml: cannot be read"):
        load_camera(tmp_path / "none.yaml")
