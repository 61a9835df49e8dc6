"""Each form, written here as its program writes it, gives the camera that the program meant: projections are equal."""

import io
import json
import struct

import cv2
import numpy as np
import pytest
import scipy.io
from dockpose import Camera
from dockpose.camera.files import load_camera
from dockpose.camera.formats.described import NoSizeError
from dockpose.camera.formats.words import READ
from dockpose.files import FileError

from tests.support.layout import ROOT

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


def as_bytes(content):
    """A file's bytes of its text, or of what it holds in JSON."""
    text = json.dumps(content) if isinstance(content, dict | list) else content
    return text if isinstance(text, bytes) else text.encode()


def rows(matrix):
    return json.dumps(np.asarray(matrix).tolist())


def opencv_file(ending, flags=0):
    storage = cv2.FileStorage(ending, cv2.FileStorage_WRITE | cv2.FileStorage_MEMORY | flags)
    names = ("image_width", "image_height", "Camera_Matrix", "Distortion_Coefficients")  # as an older sample has them
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
CALIBIO_TERMS = ("f", "ar", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6", "s1", "s2", "s3", "s4")
CALIBIO_TERMS += ("tauX", "tauY")
CALIBIO_CAMERA = {
    "CameraModelCRT": {"CameraModelBase": {"imageSize": {"width": WIDTH, "height": HEIGHT}}},
    "parameters": {
        name: {"val": value, "state": 0}
        for name, value in zip(CALIBIO_TERMS, (FX, FY / FX, CX, CY, *TILTED), strict=True)
    },
}
CALIBIO_MODEL = {"polymorphic_name": "libCalib::CameraModelOpenCV", "ptr_wrapper": {"valid": 1, "data": CALIBIO_CAMERA}}
CALIBIO = {"Calibration": {"cameras": [{"model": CALIBIO_MODEL}]}}
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
IMAGE = {"image_width": WIDTH, "image_height": HEIGHT}
BY_NAME = {"fx": FX, "fy": FY, "cx": CX, "cy": CY}
KS = {f"k{number}": each for number, each in enumerate(BENT, start=1)}
PINHOLE_TERMS = dict(zip(("k1", "k2", "p1", "p2"), FOUR, strict=True))
EUROC = {"camera_model": "pinhole", "intrinsics": [FX, FY, CX, CY], "resolution": [WIDTH, HEIGHT]}
EUROC |= {"distortion_model": "radial-tangential", "distortion_coefficients": FOUR, "T_BS": {"data": [1] * 16}}
OPENICC = {"focal_length": FX, "aspect_ratio": FY / FX, "principal_pt_x": CX, "principal_pt_y": CY, "skew": 0.0}
OPENICC |= {f"radial_distortion_{number}": each for number, each in enumerate(BENT, start=1)}
DEPTHAI = {"cameraType": 1, "distortionCoeff": BENT + [0.0] * 10, "intrinsicMatrix": K.tolist(), **SIZE}
DEPTHAI |= {"extrinsics": {"rotationMatrix": K.tolist()}}
BASALT = {"intrinsics": [{"camera_type": "kb4", "intrinsics": BY_NAME | KS}] * 2, "resolution": [[WIDTH, HEIGHT]] * 2}
NERF = {"fl_x": FX, "fl_y": FY, "cx": HALF[0], "cy": HALF[1], "w": WIDTH, "h": HEIGHT, **KS}
SVO = {"type": "pinhole", "intrinsics": {"cols": 1, "rows": 4, "data": [FX, FY, CX, CY]}}
SVO |= {"distortion": {"type": "equidistant", "parameters": {"cols": 1, "rows": 4, "data": BENT}}}
GYROFLOW = {
    "camera_model": "X1",
    "lens_model": "Wide",
    "calib_dimension": {"w": WIDTH, "h": HEIGHT},
    "orig_dimension": {"w": 2 * WIDTH, "h": 2 * HEIGHT},
    "input_horizontal_stretch": 1.0,
    "distortion_model": None,
    "compatible_settings": [{"width": 1920, "height": 1080}],
    "fisheye_params": {"RMS_error": 0.3, "camera_matrix": K.tolist(), "distortion_coeffs": BENT},
}


OTHER = {"camera_matrix": K.tolist(), **IMAGE}
# What is in a file, by whose it is; and of each the lens that was meant.
OF_FOUR = {
    "Kalibr": KALIBR,
    "EuRoC": EUROC,
    "VINS": IMAGE | {"model_type": "PINHOLE", "projection_parameters": BY_NAME, "distortion_parameters": PINHOLE_TERMS},
    "COLMAP OPENCV": colmap("OPENCV", FX, FY, *HALF, *FOUR),
    "ZED": (
        "[LEFT_CAM_VGA]\n" + "".join(f"{key}={value}\n" for key, value in BY_NAME.items()) + f"width={WIDTH}\n"
        f"height={HEIGHT}\n[LEFT_DISTO]\nk1={FOUR[0]}\nk2={FOUR[1]}\np1={FOUR[2]}\np2={FOUR[3]}\n[STEREO]\nBaseline=120\n"
    ),
    "numbers in blocks": {"intrinsics": BY_NAME, "distortion": PINHOLE_TERMS, **IMAGE},
    "the older SVO": (
        f"cam_model: Pinhole\ncam_width: {WIDTH}\ncam_height: {HEIGHT}\ncam_fx: {FX}\ncam_fy: {FY}\ncam_cx: {CX}\n"
        f"cam_cy: {CY}\n" + "".join(f"cam_d{number}: {each}\n" for number, each in enumerate(FOUR))
    ),
}
OF_FIVE = {
    "ORB-SLAM 2": ORB2,
    "ost.txt": OST,
    "OpenCV's XML": opencv_file(".xml"),
    "OpenCV's JSON": opencv_file(".json"),
    "a script's JSON": json.dumps(
        {"camera_matrix": K.tolist(), "dist_coeff": [FIVE], "image_size": [640, 480]}, indent="\t"
    ),
    "RealSense": {"fx": FX, "fy": FY, "ppx": CX, "ppy": CY, "coeffs": FIVE, "model": "Brown Conrady", **SIZE},
    "Metashape": AGISOFT,
    "Agisoft Lens": LENS,
    "MATLAB's JSON": MATLAB | {"K": TURNED.tolist()},
    "MATLAB's JSON before 2022": MATLAB | {"IntrinsicMatrix": TURNED.T.tolist()},
    "MATLAB's MAT": mat(params=MATLAB | {"IntrinsicMatrix": TURNED.T}),
    "MATLAB's intrinsics": mat(s=MATLAB | {"FocalLength": [FX, FY], "PrincipalPoint": [CX + 1, CY + 1], "Skew": 0.0}),
    "NumPy": npz(mtx=K, dist=np.array([FIVE]), rvecs=np.zeros((3, 3, 1))),
    "MC-Calib": {"camera_0": {"camera_matrix": K.tolist(), "distortion_vector": FIVE, "distortion_type": 0} | IMAGE},
    "KITTI": (
        f"corner_dist: 9.95e-02\nS_00: 6.4e+02 4.8e+02\nK_00: {' '.join(map(str, K.ravel()))}\n"
        f"D_00: {' '.join(map(str, FIVE))}\nS_rect_00: 6.2e+02 3.7e+02\n"
    ),
    "EasyMocap": {"K_01": K.tolist(), "D_01": FIVE, "W_01": WIDTH, "H_01": HEIGHT},
    "PhotonVision": (
        {"cameraIntrinsics": {"rows": 3, "cols": 3, "data": K.ravel().tolist()}, "resolution": SIZE}
        | {"distCoeffs": {"rows": 1, "cols": 5, "data": FIVE}, "calobjectSize": {"width": 7.0, "height": 7.0}}
    ),
    "lengths beside the lens": OTHER | {"dist": FIVE, "min_dist": 30.5, "mapping": {"baseline_dist_thr_ratio": 0.02}},
    "a lens called k": OTHER | {"k": FIVE},
    "a node's parameters": IMAGE
    | {"camera_matrix": {"data": K.ravel().tolist()}, "distortion_coefficients": {"data": FIVE}},
    "Anipose's TOML": (
        f"[cam_0]\nname = 'A'\nsize = [{WIDTH}, {HEIGHT}]\nmatrix = {rows(K)}\ndistortions = {FIVE}\n"
        "rotation = [0.1, 0.2, 0.3]\n[metadata]\nerror = 0.3\n"
    ),
    "Calib_Results.m": (
        f"%-- Focal length:\nfc = [ {FX} ; {FY} ];\ncc = [ {CX} ; {CY} ];\nalpha_c = 0.0;\n"
        f"kc = [ {' ; '.join(map(str, FIVE))} ];\nfc_error = [ 1.1 ; 1.2 ];\nnx = {WIDTH};\nny = {HEIGHT};\n"
    ),
    "Calib_Results.mat": mat(KK=K, kc=FIVE, nx=WIDTH, ny=HEIGHT, kc_error=[0.1] * 5, Tc_1=[90.0] * 3),
    "OpenCV's base64": opencv_file("c.yml", flags=cv2.FileStorage_BASE64),
    "the first of a stereo ost.txt": (
        OST.replace("[narrow_stereo]", "[narrow_stereo/left]")
        + "\n"
        + OST.replace("[narrow_stereo]", "[narrow_stereo/right]").replace(str(FX), "650")
    ),
    "the shape of an array": {"mtx": K.tolist(), "dist": FIVE, "img_shape": [HEIGHT, WIDTH]},
    "a file with boards, errors and a new matrix": (
        {"mtx": K.tolist(), "dist": FIVE, "newcameramtx": (K * 1.1).tolist(), "model": "HERO10 Black", **IMAGE}
        | {"rms": 0.3, "rows": 6, "cols": 9, "board_size": [9, 6], "dist_std": [0.1] * 5, "rvecs": [[0.1, 0.2, 0.3]]}
    ),
    "a text about the camera": {"camera": "front", "mtx": K.tolist(), "dist": FIVE, "img_size": [WIDTH, HEIGHT]},
    "two of OpenCV's blocks": (
        "%YAML:1.0\n"
        + "".join(
            f"{side}.height: {HEIGHT}\n{side}.width: {WIDTH}\n"
            f"{side}.D: !!opencv-matrix {{rows: 1, cols: 5, dt: d, data: {FIVE}}}\n"
            f"{side}.K: !!opencv-matrix {{rows: 3, cols: 3, dt: d, data: {matrix.ravel().tolist()}}}\n"
            for side, matrix in (("LEFT", K), ("RIGHT", K + 1))
        )
    ),
}
OF_FISHEYE = {
    "ORB-SLAM 3": ORB3,
    "camodocal's fisheye": BRANDT,
    "OpenCV's sample, fisheye": SIZE
    | {"camera_matrix": K.tolist(), "distortion_coefficients": BENT, "fisheye_model": 1},
    "COLMAP OPENCV_FISHEYE": colmap("OPENCV_FISHEYE", FX, FY, *HALF, *BENT),
    "Metashape's cameras, fisheye": DOCUMENT,
    "MC-Calib's fisheye, XML": (
        '<?xml version="1.0"?><opencv_storage><camera_0><camera_matrix type_id="opencv-matrix"><rows>3</rows>'
        f"<cols>3</cols><dt>d</dt><data>{' '.join(map(str, K.ravel()))}</data></camera_matrix><distortion_vector>"
        f"<rows>1</rows><cols>4</cols><dt>d</dt><data>{' '.join(map(str, BENT))}</data></distortion_vector>"
        f"<distortion_type>1</distortion_type><img_width>{WIDTH}</img_width><img_height>{HEIGHT}</img_height>"
        "</camera_0></opencv_storage>"
    ),
    "Gyroflow": GYROFLOW,
    "Gyroflow, old": GYROFLOW | {"use_opencv_fisheye": True, "use_opencv_standard": False, "calib_params": {}},
    "RealSense, numbered": SIZE | {"fx": FX, "fy": FY, "ppx": CX, "ppy": CY, "model": 5, "coeffs": [*BENT, 0]},
    "Theia": BY_NAME | SIZE | {"radial_distortion_coeffs": BENT, "camera_intrinsics_type": "FISHEYE"},
    "OpenICC": IMAGE | {"intrinsic_type": "FISHEYE", "fps": 30, "intrinsics": OPENICC},
    "Basalt": {"value0": BASALT},
    "DepthAI": {"boardName": "A", "cameraData": [[0, DEPTHAI]]},
    "Nerfstudio": NERF | {"camera_model": "OPENCV_FISHEYE", "frames": [{"transform_matrix": [[5.5] * 4] * 4}]},
    "OpenVSLAM": (
        "Camera:\n  model: fisheye\n"
        + "".join(f"  {key}: {value}\n" for key, value in (BY_NAME | KS).items())
        + f"  cols: {WIDTH}\n  rows: {HEIGHT}\n"
    ),
    "a fisheye in a block of its own": {"image_size": SIZE, "fisheye": {"K": K.tolist(), "D": BENT}},
    "SVO and maplab": {"cameras": [{"camera": IMAGE | SVO}]},
}
OF_EIGHT = {
    "ros2 topic echo": ECHO,
    "rostopic echo": 2 * ECHO.replace("\nd:", "\nD:").replace("\nk:", "\nK:"),
    "COLMAP FULL_OPENCV": colmap("FULL_OPENCV", FX, FY, *HALF, *EIGHT),
    "WPILib": OTHER | {"distortion_coefficients": EIGHT, "distortion_coefficients_rows": 8},
    "of PowerShell": ECHO.encode("utf-16"),
    "mrcal": (
        f"{{\n  'lensmodel': 'LENSMODEL_OPENCV8',\n\n  # a comment\n  'intrinsics': {[FX, FY, CX, CY, *EIGHT]},\n"
        f"  'extrinsics': [0, 0, 0, 1.5, 0, 0],\n  'imagersize': [{WIDTH}, {HEIGHT}],\n}}\n"
    ),
}
OF_NONE = {
    "Open3D": {"intrinsic_matrix": K.T.ravel().tolist(), **SIZE},
    "COLMAP PINHOLE": colmap("PINHOLE", FX, FY, *HALF),
    "Gyroflow, without a lens": GYROFLOW
    | {"fisheye_params": {"camera_matrix": K.tolist(), "distortion_coeffs": [0] * 4}},
    "BOP's scene_camera": {"0": {"cam_K": K.ravel().tolist(), "depth_scale": 1.0}},
    "Middlebury": (
        f"cam0=[{FX} 0 {CX}; 0 {FY} {CY}; 0 0 1]\ncam1=[1 0 1; 0 1 1; 0 0 1]\ndoffs=131.1\nwidth={WIDTH}\n"
        f"height={HEIGHT}\nndisp=280\n"
    ),
    "x and y": {"focal_length": {"x": FX, "y": FY}, "principal_point": {"x": CX, "y": CY}},
}
FORMS = {
    name: (content, meant)
    for meant, forms in (
        (pinhole(FOUR), OF_FOUR),
        (pinhole(FIVE), OF_FIVE),
        (fisheye(), OF_FISHEYE),
        (pinhole(EIGHT), OF_EIGHT),
        (pinhole(), OF_NONE),
        (pinhole(TILTED), {"calib.io": CALIBIO}),
        (pinhole(TILTED), {"tilted": {"camera_matrix": K.tolist(), "dist": TILTED, **SIZE}}),
        (pinhole(PRISM), {"thin prism": {"camera_matrix": K.tolist(), "dist": PRISM, **SIZE}}),
    )
    for name, content in forms.items()
}


@pytest.fixture
def write(tmp_path):
    def write(content, name="camera.file"):
        path = tmp_path / name
        path.write_bytes(as_bytes(content))
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


def test_a_principal_point_that_metashape_leaves_out_is_the_middle(write):
    camera = load_camera(
        write("".join(line for line in AGISOFT.splitlines() if not line.startswith(("  <cx", "  <cy"))))
    )
    assert (camera.cx, camera.cy) == (WIDTH / 2 - 0.5, HEIGHT / 2 - 0.5)


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


@pytest.mark.parametrize("length", [8, 12, 14])
@pytest.mark.parametrize("own", [FIVE, EIGHT])
def test_what_ends_in_zeros_is_the_shorter_model(write, length, own):
    bent = [*own, *[0.0] * (length - len(own))]
    assert load_camera(write(json.dumps({"mtx": K.tolist(), "dist": bent, **SIZE}))).distortion == tuple(own)


def test_a_file_without_a_size_needs_one(write):
    path = write(npz(mtx=K, dist=np.array(FIVE)))
    with pytest.raises(NoSizeError, match="--camera-size"):
        load_camera(path)
    assert load_camera(path, size=(648, 486)).width == 648


@pytest.mark.parametrize("size", [(1280, 960), (320, 240), (640, 270)])
def test_a_size_that_nobody_said_must_have_its_middle_near_the_principal_point(write, size):
    with pytest.raises(FileError, match=r"principal point .* far from the middle .* near that of 643 x 477"):
        load_camera(write(npz(mtx=K, dist=np.array(FIVE))), size=size)


def test_a_size_of_which_the_principal_point_is_not_the_middle_is_told(write):
    notes = []
    load_camera(write(json.dumps(OTHER | {"image_width": 1280, "image_height": 960})), tell=notes.append)
    assert "1280 x 960, which it says, and near that of 643 x 477: check" in notes[0]


@pytest.mark.parametrize(("more", "is_told"), [({}, True), ({"distortion_model": "plumb_bob"}, False)])
def test_four_coefficients_without_a_model_are_told(write, more, is_told):
    notes = []
    camera = load_camera(write(json.dumps(OTHER | {"D": [[each] for each in FOUR]} | more)), tell=notes.append)
    assert camera.distortion == tuple(FOUR)
    assert any("taken for k1, k2, p1, p2" in note for note in notes) == is_told


def test_the_words_on_what_is_read_are_the_same_everywhere():
    for path in ("docs/first-day.md", "static/controls.toml"):
        assert READ in " ".join((ROOT / path).read_text(encoding="utf-8").split()), path


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
        (BRANDT.replace("KANNALA_BRANDT", "MEI"), "'MEI' is not read"),
        (BRANDT.replace(f"mu: {FX}", "mu: wide"), "fx is 'wide'"),
        (ORB2.replace("Camera.cy", "Camera.sky"), "cy is missing"),
        (ORB3.replace("KannalaBrandt8", "Omni"), "'Omni'"),
        (colmap("FOV", FX, FY, *HALF, 0.9), "camera model 'FOV' is not read"),
        (colmap("OPENCV", FX, FY, *HALF), "OPENCV has 8 parameters; the line has 4"),
        (AGISOFT.replace("</k3>", "</k3><k4>0.1</k4>"), "its k4 has no place"),
        (json.dumps(CALIBIO).replace("CameraModelOpenCV", "CameraModelDoubleSphere"), "export it as OpenCV's"),
        (json.dumps(CALIBIO).replace("imageSize", "size_of_it"), "does not say for which pictures"),
        (MATLAB | {"K": [1, 2]}, "IntrinsicMatrix is 2; it must be 3 x 3"),
        ({"camera_matrix": [[1, 2], [3]]}, "it must be numbers"),
        ({"camera_matrix": K.tolist(), "dist": "bent"}, "distortion_coefficients is 'bent'"),
        *(
            (json.dumps(OTHER | {key: value}), f"its {key} is not read; call the lens's")
            for key, value in {"distortion_coefficents": FIVE, "distrotion": FOUR, "xi": 1.3, "alpha": 0.6}.items()
        ),
        (OTHER | {"fisheye": {"par": [0.02, -0.03]}}, r"its fisheye\.par is not read"),
        (OTHER | {"D": FOUR, "model": "double_sphere"}, "its model is 'double_sphere', which is not read"),
        (OTHER | {"D": FOUR, "distortion_type": 2}, "its distortion_type is 'number 2'"),
        (OTHER | {"D": FOUR, "camera_model": "fisheye", "lens_type": "brown"}, "says brown; which is it?|says fisheye"),
        (OTHER | {"resolution": [1280, 960]}, "its resolution says 1280 x 960 and its image_width, image_height 640"),
        ({"K": K.tolist(), "D": FIVE, "calibrated_at_width": 1280}, "its calibrated_at_width is not read"),
        ({"K": K.tolist(), "img_shape": [500, 505]}, "its img_shape .* may be height x width or not"),
        (OTHER | {"rgb": {"fx": 900.5}}, r"its rgb\.fx is not read beside the matrix"),
        ({**BY_NAME, **KS, **IMAGE}, "if it is a fisheye, write distortion_model: fisheye"),
        (BY_NAME | {"fx": 0.9, "fy": 1.2} | IMAGE, "its fx of 0.9 is no focal length"),
        (GYROFLOW | {"digital_lens": "gopro_superview"}, "its digital_lens is 'gopro_superview'"),
        (GYROFLOW | {"distortion_model": "poly5"}, "'poly5'"),
        (
            "cam_model: ATAN\ncam_fx: 0.5\ncam_fy: 0.8\ncam_cx: 0.5\ncam_cy: 0.5\ncam_d0: 0.9\n",
            "its cam_model is 'ATAN'",
        ),
        ({"intrinsics": [{"intrinsicId": "1"}], "views": []}, "is a scene of Meshroom"),
        ({"CalibrationInformation": {"Cameras": []}}, "is of an Azure Kinect"),
        (
            json.dumps(K.tolist()).replace(",", " ").strip("[]").replace("]", "").replace("[", ""),
            "numbers without names",
        ),
        ("version https://git-lfs.github.com/spec/v1\noid", "is what Git LFS leaves in place of a file"),
        ("\n<!DOCTYPE html><html>", "is a web page; download the file itself"),
        ('Device info:\n\n Intrinsic of "Color" / 640x480\n  Width: 640', "is what rs-enumerate-devices prints"),
        ("fx,fy,cx,cy\n1,2,3,4\n", "holds no keys, as image_width: 640, and is no other kind of camera file"),
        (b"\x93NUMPY\x01\x00", "is a single array of NumPy; bring matrix and lens"),
        (b"\x80\x04\x95pickle", "is a pickle of Python"),
        (b"\x1f\x8b\x08\x00", "is an archive, as ROS's calibrator packs; unpack it and bring ost.yaml"),
        (
            struct.pack("<QIiQQ8d", 1, 1, 4, WIDTH, HEIGHT, FX, FY, CX, CY, *FOUR),
            "is COLMAP's cameras.bin; bring cameras.txt",
        ),
        (
            b"".join(
                b"[LEFT_CAM_%s]\nfx=1400\nfy=1400\ncx=%d\ncy=%d\n" % each
                for each in ((b"2K", 1104, 621), (b"FHD", 960, 540))
            ),
            "say which as .*#NAME: LEFT_CAM_2K, LEFT_CAM_FHD",
        ),
        (
            ECHO.replace(
                "p: [700.0, 0.0, 319.5, 0.0, 0.0, 700.0, 239.5", "p: [1400.0, 0.0, 640.0, 0.0, 0.0, 1400.0, 477.0"
            ),
            "projection matrix is for pictures 2 times as large as its k is",
        ),
        ("fc = [ " + "1" * 5000 + "x", "not valid YAML|holds no keys"),  # whose search must not take for ever
        ("<opencv_storage><a>", "not valid XML"),
        ("<!DOCTYPE a [<!ENTITY b 'c'>]><a>&b;</a>", "defines entities"),
        ("<calibrations/>", "not a camera file"),
        ("{" * 100000, "not valid JSON"),
        ('{\n\t"fx": 1,\n}', "not valid JSON .*line [23]"),
        ("a: b: c", "not valid YAML, line 1 .*, and no other kind of camera file"),
        (GYROFLOW | {"use_opencv_standard": True}, "take a profile with use_opencv_fisheye"),
        (BY_NAME | SIZE | {"ppx": CX, "coeffs": FIVE, "model": 2}, "inverse Brown Conrady has none"),
        ("Pix4D camera calibration file 0\nF 4.9\n", "is of HALCON, Pix4D or Bundler"),
        ('{"sfm_data_version": "0.3", "views": []}', "bring cameras.txt, by openMVG_main_openMVG2Colmap"),
        ({"v2": {"projection_type": "brown", "focal_x": 1.1}}, "is of OpenSfM"),
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
