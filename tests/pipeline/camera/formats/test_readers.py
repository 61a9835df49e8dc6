"""Each form, written here as its program writes it, gives the camera that the program meant: projections are equal."""

import io
import json

import cv2
import numpy as np
import pytest
import scipy.io
from dockpose import Camera
from dockpose.camera.files import FORMATS, load_camera, save_camera
from dockpose.camera.formats.described import NoSizeError
from dockpose.files import FileError

FX, FY, CX, CY, WIDTH, HEIGHT = 701.25, 699.5, 321.125, 238.0625, 640, 480
K = np.array([[FX, 0, CX], [0, FY, CY], [0, 0, 1]])
FOUR, FIVE = [-0.21, 0.062, 0.0012, -0.0007], [-0.21, 0.062, 0.0012, -0.0007, -0.011]
EIGHT = [*FIVE, 0.013, 0.002, -0.0004]
PRISM = [*EIGHT, 0.0011, -0.0003, 0.0007, 0.0002]
TILTED = [*PRISM, 0.012, -0.021]
BENT = [0.041, -0.0123, 0.0041, -0.0007]  # of a fisheye lens
POINTS_M = np.array([[x, y, z] for x in (-0.7, 0.1, 0.6) for y in (-0.5, 0.0, 0.4) for z in (1.3, 2.0)])


def pinhole(distortion=()):
    """OpenCV's picture of the points."""
    return cv2.projectPoints(POINTS_M, np.zeros(3), np.zeros(3), K, np.array(distortion, float))[0][:, 0]


def fisheye(distortion=BENT):
    return cv2.fisheye.projectPoints(POINTS_M[:, None], np.zeros(3), np.zeros(3), K, np.array(distortion))[0][:, 0]


def rows(matrix):
    return json.dumps(np.asarray(matrix).tolist())


def opencv_file(ending, names=("image_width", "image_height", "camera_matrix", "distortion_coefficients")):
    storage = cv2.FileStorage(ending, cv2.FileStorage_WRITE | cv2.FileStorage_MEMORY)
    for name, value in zip(names, (WIDTH, HEIGHT, K, np.array(FIVE)[:, None]), strict=True):
        storage.write(name, value)
    return storage.releaseAndGetString()


def npz(**arrays):
    file = io.BytesIO()
    np.savez(file, **arrays)
    return file.getvalue()


def mat(**variables):
    file = io.BytesIO()
    scipy.io.savemat(file, variables)
    return file.getvalue()


KALIBR = f"""\
cam0:
  cam_overlaps: [1]
  camera_model: pinhole
  distortion_coeffs: {FOUR}
  distortion_model: radtan
  intrinsics: [{FX}, {FY}, {CX}, {CY}]
  resolution: [{WIDTH}, {HEIGHT}]
  rostopic: /cam0/image_raw
cam1:
  T_cn_cnm1: [[1.0, 0.0, 0.0, -0.1], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
  camera_model: pinhole
  distortion_coeffs: {BENT}
  distortion_model: equi
  intrinsics: [{FX}, {FY}, {CX}, {CY}]
  resolution: [{WIDTH}, {HEIGHT}]
"""
EUROC = f"""\
# General sensor definitions.
sensor_type: camera
T_BS:
  cols: 4
  rows: 4
  data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]
resolution: [{WIDTH}, {HEIGHT}]
camera_model: pinhole
intrinsics: [{FX}, {FY}, {CX}, {CY}]
distortion_model: radial-tangential
distortion_coefficients: {FOUR}
"""
ORB2 = "%YAML:1.0\n\n#----\n# Camera Parameters\n#----\n" + "".join(
    f"Camera.{name}: {value}\n"
    for name, value in [
        *zip(("fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3"), (FX, FY, CX, CY, *FIVE), strict=True),
        *(("width", WIDTH), ("height", HEIGHT), ("fps", 30.0), ("RGB", 1)),
    ]
)
ORB3 = '%YAML:1.0\nFile.version: "1.0"\nCamera.type: "KannalaBrandt8"\n' + "".join(
    f"{name}: {value}\n"
    for name, value in [
        *((f"Camera1.{n}", v) for n, v in zip(("fx", "fy", "cx", "cy"), (FX, FY, CX, CY), strict=True)),
        *((f"Camera1.k{n}", v) for n, v in enumerate(BENT, start=1)),
        *(("Camera.width", WIDTH), ("Camera.height", HEIGHT)),
    ]
)
VINS = f"""\
%YAML:1.0
---
model_type: PINHOLE
camera_name: camera
image_width: {WIDTH}
image_height: {HEIGHT}
distortion_parameters:
   k1: {FOUR[0]:e}
   k2: {FOUR[1]:e}
   p1: {FOUR[2]:e}
   p2: {FOUR[3]:e}
projection_parameters:
   fx: {FX}
   fy: {FY}
   cx: {CX}
   cy: {CY}
"""
BRANDT = f"""\
%YAML:1.0
---
model_type: KANNALA_BRANDT
camera_name: camera
image_width: {WIDTH}
image_height: {HEIGHT}
projection_parameters: {{k2: {BENT[0]}, k3: {BENT[1]}, k4: {BENT[2]}, k5: {BENT[3]},
  mu: {FX}, mv: {FY}, u0: {CX}, v0: {CY}}}
"""
ECHO = f"""\
header:
  stamp:
    sec: 12
    nanosec: 5
  frame_id: cam
height: {HEIGHT}
width: {WIDTH}
distortion_model: rational_polynomial
d:
{"".join(f"- {value!r}" + chr(10) for value in EIGHT)}k:
{"".join(f"- {value!r}" + chr(10) for value in K.ravel().tolist())}r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [700.0, 0.0, 319.5, 0.0, 0.0, 700.0, 239.5, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
"""
ROS1 = f"""\
header:
  seq: 7
  stamp: {{secs: 1, nsecs: 5}}
  frame_id: "cam"
height: {HEIGHT}
width: {WIDTH}
distortion_model: "plumb_bob"
D: {FIVE}
K: {K.ravel().tolist()}
R: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
P: [700.0, 0.0, 319.5, 0.0, 0.0, 700.0, 239.5, 0.0, 0.0, 0.0, 1.0, 0.0]
---
"""
OST = f"""\
# oST version 5.0 parameters


[image]

width
{WIDTH}

height
{HEIGHT}

[narrow_stereo]

camera matrix
{FX} 0.000000 {CX}
0.000000 {FY} {CY}
0.000000 0.000000 1.000000

distortion
{" ".join(map(str, FIVE))}

rectification
1.000000 0.000000 0.000000
"""
CALIBIO = {
    "Calibration": {
        "cameras": [
            {
                "model": {
                    "polymorphic_id": 2147483649,
                    "polymorphic_name": "libCalib::CameraModelOpenCV",
                    "ptr_wrapper": {
                        "valid": 1,
                        "data": {
                            "CameraModelCRT": {"CameraModelBase": {"imageSize": {"width": WIDTH, "height": HEIGHT}}},
                            "parameters": {
                                name: {"val": value, "state": 0}
                                for name, value in zip(
                                    ("f", "ar", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2",
                                     "s3", "s4", "tauX", "tauY"),
                                    (FX, FY / FX, CX, CY, *TILTED), strict=True,
                                )
                            },
                        },
                    },
                }
            }
        ]
    }
}  # fmt: skip
AGISOFT = f"""\
<?xml version="1.0" encoding="UTF-8"?>
<calibration>
  <projection>frame</projection>
  <width>{WIDTH}</width>
  <height>{HEIGHT}</height>
  <f>{FY}</f>
  <cx>{CX - WIDTH / 2 + 0.5}</cx>
  <cy>{CY - HEIGHT / 2 + 0.5}</cy>
  <b1>{FX - FY}</b1>
  <k1>{FIVE[0]}</k1>
  <k2>{FIVE[1]}</k2>
  <k3>{FIVE[4]}</k3>
  <p1>{FIVE[3]}</p1>
  <p2>{FIVE[2]}</p2>
  <date>2026-01-01T00:00:00Z</date>
</calibration>
"""
LENS = f"""\
<calibration><projection>frame</projection><width>{WIDTH}</width><height>{HEIGHT}</height><fx>{FX}</fx><fy>{FY}</fy>
<cx>{CX + 0.5}</cx><cy>{CY + 0.5}</cy><k1>{FIVE[0]}</k1><k2>{FIVE[1]}</k2><k3>{FIVE[4]}</k3><p1>{FIVE[2]}</p1>
<p2>{FIVE[3]}</p2></calibration>"""
DOCUMENT = f"""\
<document version="1.5.0"><chunk><sensors><sensor id="0" type="fisheye"><resolution width="{WIDTH}" height="{HEIGHT}"/>
<calibration type="fisheye" class="initial"><resolution width="{WIDTH}" height="{HEIGHT}"/><f>500</f></calibration>
<calibration type="fisheye" class="adjusted"><resolution width="{WIDTH}" height="{HEIGHT}"/><f>{FY}</f>
<cx>{CX - WIDTH / 2 + 0.5}</cx><cy>{CY - HEIGHT / 2 + 0.5}</cy><b1>{FX - FY}</b1><k1>{BENT[0]}</k1><k2>{BENT[1]}</k2>
<k3>{BENT[2]}</k3><k4>{BENT[3]}</k4></calibration></sensor></sensors></chunk></document>"""
TURNED = K + [[0, 0, 1], [0, 0, 1], [0, 0, 0]]  # as MATLAB counts pixels
MATLAB = {
    "RadialDistortion": [FIVE[0], FIVE[1], FIVE[4]],
    "TangentialDistortion": FIVE[2:4],
    "ImageSize": [HEIGHT, WIDTH],
    "WorldUnits": "mm",
    "ReprojectionErrors": [[0.1, 0.2]],
}


def colmap(model, *values):
    head = "# Camera list with one line of data per camera:\n#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    return f"{head}# Number of cameras: 1\n1 {model} {WIDTH} {HEIGHT} {' '.join(map(repr, values))}\n"


HALF = (CX + 0.5, CY + 0.5)
SIZE = {"width": WIDTH, "height": HEIGHT}
FORMS = {
    "Kalibr": (KALIBR, pinhole(FOUR)),
    "EuRoC": (EUROC, pinhole(FOUR)),
    "ORB-SLAM 2": (ORB2, pinhole(FIVE)),
    "ORB-SLAM 3": (ORB3, fisheye()),
    "VINS": (VINS, pinhole(FOUR)),
    "camodocal's fisheye": (BRANDT, fisheye()),
    "ros2 topic echo": (ECHO, pinhole(EIGHT)),
    "rostopic echo": (ROS1 + ROS1, pinhole(FIVE)),
    "ost.txt": (OST, pinhole(FIVE)),
    "OpenCV's XML": (opencv_file(".xml"), pinhole(FIVE)),
    "OpenCV's JSON": (opencv_file(".json"), pinhole(FIVE)),
    "OpenCV's older sample": (
        opencv_file(".yml", ("image_Width", "image_Height", "Camera_Matrix", "Distortion_Coefficients")),
        pinhole(FIVE),
    ),
    "OpenCV's sample, fisheye": (
        json.dumps({"camera_matrix": K.tolist(), "distortion_coefficients": BENT, "fisheye_model": 1, **SIZE}),
        fisheye(),
    ),
    "a script's JSON": (
        json.dumps({"camera_matrix": K.tolist(), "dist_coeff": [FIVE], "image_size": [640, 480]}, indent="\t"),
        pinhole(FIVE),
    ),
    "a script's mtx": (json.dumps({"mtx": K.tolist(), "dist": [FIVE], **SIZE}), pinhole(FIVE)),
    "a script's K": (json.dumps({"K": K.ravel().tolist(), "D": FIVE, "img_size": [640, 480]}), pinhole(FIVE)),
    "Open3D": (json.dumps({"intrinsic_matrix": K.T.ravel().tolist(), **SIZE}), pinhole()),
    "RealSense": (
        json.dumps({"fx": FX, "fy": FY, "ppx": CX, "ppy": CY, "coeffs": FIVE, "model": "Brown Conrady", **SIZE}),
        pinhole(FIVE),
    ),
    "numbers by name": (
        json.dumps({"fx": FX, "fy": FY, "cx": CX, "cy": CY, "k1": -0.2, "k2": 0.1, **SIZE}),
        pinhole([-0.2, 0.1, 0, 0]),
    ),
    "calib.io": (json.dumps(CALIBIO), pinhole(TILTED)),
    "COLMAP OPENCV": (colmap("OPENCV", FX, FY, *HALF, *FOUR), pinhole(FOUR)),
    "COLMAP FULL_OPENCV": (colmap("FULL_OPENCV", FX, FY, *HALF, *EIGHT), pinhole(EIGHT)),
    "COLMAP PINHOLE": (colmap("PINHOLE", FX, FY, *HALF), pinhole()),
    "COLMAP OPENCV_FISHEYE": (colmap("OPENCV_FISHEYE", FX, FY, *HALF, *BENT), fisheye()),
    "Metashape": (AGISOFT, pinhole(FIVE)),
    "Metashape's cameras, fisheye": (DOCUMENT, fisheye()),
    "Agisoft Lens": (LENS, pinhole(FIVE)),
    "MATLAB's JSON": (json.dumps(MATLAB | {"K": TURNED.tolist()}), pinhole(FIVE)),
    "MATLAB's JSON before 2022": (json.dumps(MATLAB | {"IntrinsicMatrix": TURNED.T.tolist()}), pinhole(FIVE)),
    "MATLAB's MAT": (mat(params=MATLAB | {"IntrinsicMatrix": TURNED.T}), pinhole(FIVE)),
    "MATLAB's intrinsics": (
        mat(s=MATLAB | {"FocalLength": [FX, FY], "PrincipalPoint": [CX + 1, CY + 1], "Skew": 0.0}),
        pinhole(FIVE),
    ),
    "NumPy": (npz(mtx=K, dist=np.array([FIVE]), rvecs=np.zeros((3, 3, 1))), pinhole(FIVE)),
    "thin prism": (json.dumps({"camera_matrix": K.tolist(), "dist": PRISM, **SIZE}), pinhole(PRISM)),
    "tilted": (json.dumps({"camera_matrix": K.tolist(), "dist": TILTED, **SIZE}), pinhole(TILTED)),
}


@pytest.fixture
def write(tmp_path):
    def write(content, name="camera.file"):
        path = tmp_path / name
        path.write_bytes(content if isinstance(content, bytes) else content.encode())
        return path

    return write


@pytest.mark.parametrize("form", FORMS)
def test_reads_the_camera_that_the_other_program_meant(write, form):
    content, expected_px = FORMS[form]
    camera = load_camera(write(content), size=(WIDTH, HEIGHT))
    assert (camera.width, camera.height) == (WIDTH, HEIGHT)
    np.testing.assert_allclose(camera.project(POINTS_M), expected_px, rtol=0, atol=1e-9)
    rays = camera.rays(expected_px)
    np.testing.assert_allclose(rays[:, :2] / rays[:, 2:], POINTS_M[:, :2] / POINTS_M[:, 2:], rtol=0, atol=1e-9)


@pytest.mark.parametrize(("model", "count"), [("SIMPLE_RADIAL", 1), ("RADIAL", 2), ("SIMPLE_PINHOLE", 0)])
def test_colmap_with_one_focal_length(write, model, count):
    camera = load_camera(write(colmap(model, 600.0, *HALF, *FOUR[:count])))
    assert (camera.fx, camera.fy, camera.cx, camera.cy) == (600, 600, CX, CY)
    assert (*camera.distortion, 0, 0)[:2] == (*FOUR[:count], 0, 0)[:2]
    assert not any(camera.distortion[2:])


def test_one_of_several_cameras_is_named_and_else_the_first_taken_with_a_note(write):
    notes = []
    path = write(KALIBR)
    assert not load_camera(path, tell=notes.append).fisheye
    assert notes == [f"{path}: has the cameras cam0, cam1; cam0 is taken, {path}#NAME takes another"]
    assert load_camera(f"{path}#cam1").fisheye
    with pytest.raises(FileError, match="has no camera 'cam7'; it has 'cam0', 'cam1'"):
        load_camera(f"{path}#cam7")


def test_a_stereo_file_of_opencv_holds_two_cameras(write):
    names = {"M1": K.tolist(), "D1": FIVE, "M2": (K * [[2], [2], [1]]).tolist(), "D2": FOUR, **SIZE}
    path = write(json.dumps(names))
    assert load_camera(path).distortion == tuple(FIVE)
    assert load_camera(f"{path}#2").fx == 2 * FX


def test_a_file_whose_name_has_the_sign_is_itself(write):
    assert load_camera(write(ORB2, "a#b.yaml")).fx == FX


@pytest.mark.parametrize(("share", "is_taken"), [(1e-6, True), (9e-4, True), (1.1e-3, False)])
def test_a_small_skew_is_none_with_a_note(write, share, is_taken):
    notes, skewed = [], K.copy()
    skewed[0, 1] = share * FX
    path = write(json.dumps({"camera_matrix": skewed.tolist(), **SIZE}))
    if is_taken:
        assert load_camera(path, tell=notes.append) == Camera(FX, FY, CX, CY, WIDTH, HEIGHT)
        assert "skew" in notes[0]
        return
    with pytest.raises(FileError, match="camera_matrix is"):
        load_camera(path)


@pytest.mark.parametrize("length", [12, 14])
@pytest.mark.parametrize("own", [FIVE, EIGHT])
def test_what_ends_in_zeros_is_the_shorter_model(write, length, own):
    bent = [*own, *[0.0] * (length - len(own))]
    assert load_camera(write(json.dumps({"mtx": K.tolist(), "dist": bent, **SIZE}))).distortion == tuple(own)


def test_a_file_without_a_size_needs_one(write):
    path = write(npz(mtx=K, dist=np.array(FIVE)))
    with pytest.raises(NoSizeError, match="--camera-size"):
        load_camera(path)
    assert load_camera(path, size=(648, 486)).width == 648


def test_the_region_of_a_sensor_is_taken_off(write):
    roi = "x_offset: 100\n  y_offset: 50\n  height: 200\n  width: 300\n"
    camera = load_camera(write(ECHO.replace("x_offset: 0\n  y_offset: 0\n  height: 0\n  width: 0\n", roi)))
    assert (camera.cx, camera.cy, camera.width, camera.height) == (CX - 100, CY - 50, 300, 200)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (KALIBR.replace("pinhole", "omni"), "camera model 'omni' is not read; calibrate with pinhole-radtan"),
        (KALIBR.replace("radtan", "fov"), "distortion model 'fov' is not read"),
        (KALIBR.replace(f"{CX}, ", ""), "intrinsics has 3 values"),
        (VINS.replace("PINHOLE", "MEI"), "'MEI' is not read"),
        (VINS.replace(f"fx: {FX}", "fx: wide"), "fx is 'wide'"),
        (ORB2.replace("Camera.cy", "Camera.sky"), "cy is missing"),
        (ORB3.replace("KannalaBrandt8", "Omni"), "'Omni'"),
        (colmap("FOV", FX, FY, *HALF, 0.9), "camera model 'FOV' is not read"),
        (colmap("OPENCV", FX, FY, *HALF), "OPENCV has 8 parameters; the line has 4"),
        (AGISOFT.replace("</k3>", "</k3><k4>0.1</k4>"), "its k4 has no place"),
        (json.dumps(CALIBIO).replace("CameraModelOpenCV", "CameraModelDoubleSphere"), "export it as OpenCV's"),
        (json.dumps(CALIBIO).replace("imageSize", "size_of_it"), "does not say for which pictures"),
        (json.dumps(MATLAB | {"K": [1, 2]}), "IntrinsicMatrix is 2; it must be 3 x 3"),
        (json.dumps({"camera_matrix": [[1, 2], [3]]}), "it must be numbers"),
        (json.dumps({"camera_matrix": K.tolist(), "dist": "bent"}), "distortion_coefficients is 'bent'"),
        ("<opencv_storage><a>", "not valid XML"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "defines entities"),
        ("<calibrations/>", "not a camera file"),
        ("{" * 100000, "not valid YAML"),
        ("[" * 100000, "nested too deeply|not valid YAML"),
        (b"PK\x03\x04junk", "damaged archive"),
        (b"MATLAB 7.3 MAT-file, Platform: GLNXA64", "save a struct, as of toStruct, with -v7"),
    ],
)
def test_what_cannot_be_read_is_one_sentence(write, content, message):
    with pytest.raises(FileError, match=message) as raised:
        load_camera(write(content))
    assert "camera.file" in str(raised.value)
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("file_format", FORMATS)
def test_other_programs_read_what_is_written_for_them(tmp_path, file_format):
    camera = Camera(FX, FY, CX, CY, WIDTH, HEIGHT, FOUR)
    save_camera(camera, tmp_path / "c", file_format)
    np.testing.assert_allclose(load_camera(tmp_path / "c").project(POINTS_M), pinhole(FOUR), rtol=0, atol=1e-9)
    if file_format == "opencv-xml":
        storage = cv2.FileStorage((tmp_path / "c").read_text(), cv2.FileStorage_READ | cv2.FileStorage_MEMORY)
        np.testing.assert_array_equal(storage.getNode("camera_matrix").mat(), K)


def test_kalibr_has_no_place_for_a_fifth_coefficient(tmp_path):
    with pytest.raises(ValueError, match="no place for the fifth coefficient"):
        save_camera(Camera(FX, FY, CX, CY, WIDTH, HEIGHT, FIVE), tmp_path / "c", "kalibr")
