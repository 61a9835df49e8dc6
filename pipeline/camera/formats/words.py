"""Files that are not read: what each of them is, and which file of the same program is read."""

import re
import struct
from collections.abc import Mapping
from typing import Any

from dockpose.camera.formats.fields import Fields, plain

# What is read, as the page, the docs and messages say it, and the usual ends of such files' names.
READ = "YAML, JSON, XML, TOML, INI, text, .npz and .mat of ROS, OpenCV, Kalibr, COLMAP, MATLAB and many more"
ENDINGS = [".yaml", ".yml", ".json", ".xml", ".toml", ".ini", ".conf", ".txt", ".m", ".cameramodel", ".npz", ".mat"]
_BOTH = "bring matrix and lens in one: np.savez('camera.npz', mtx=..., dist=...)"
# How a file begins, what it is, and what to bring.
_BY_BEGINNING = (
    (
        rb"\x1f\x8b|BZh|\xfd7zXZ|7z\xbc\xaf|.{257}ustar",
        "is an archive, as ROS's calibrator packs; unpack it and bring ost.yaml, or left.yaml or right.yaml of a pair",
    ),
    (rb"version https://git-lfs", "is what Git LFS leaves in place of a file; fetch it by git lfs pull"),
    (rb"\s*(?i:<!doctype html|<html)", "is a web page; download the file itself"),
    (
        rb".{,9999}?\bIntrinsic of \"",
        "is what rs-enumerate-devices prints; bring the camera_info of its ROS driver, or fx, fy, cx, cy as YAML",
    ),
    (rb"\x93NUMPY", f"is a single array of NumPy; {_BOTH}"),
    (rb"\x80[\x02-\x05]|\(dp?\d?\r?\n|\(lp\d\r?\n", f"is a pickle of Python, which is not safe to read; {_BOTH}"),
    (
        rb"(?i:MATLAB v?7\.3)|\x89HDF",
        "is a MAT file of version 7.3, or another HDF5 file; save a struct, as of toStruct, with -v7: "
        "save('c.mat', 's', '-v7')",
    ),
    (
        rb"# INTERNAL CAMERA PARAMETERS|ParGroup: Cam|Pix4D camera calibration|# Bundle file",
        "is of HALCON, Pix4D or Bundler, whose numbers are not in OpenCV's terms; calibrate with dockpose calibrate",
    ),
    (
        rb"[\s\[]{0,9}[-+.\d][-+\d.eE,;\s\[\]]*$",
        f"holds numbers without names, such as a matrix alone, without its lens; {_BOTH}",
    ),
)
_NORMAL = "is of OpenSfM, whose numbers are shares of the width; bring cameras.txt, by opensfm export_colmap"
# Keys that tell a program, anywhere in its file.
_BY_KEYS = (
    (
        {"intrinsicid", "intrinsics"},
        "is a scene of Meshroom, whose lenses are not read; calibrate with dockpose calibrate",
    ),
    (
        {"calibrationinformation"},
        "is of an Azure Kinect, whose numbers are shares of the width; bring the camera_info of its ROS driver",
    ),
    ({"projectiontype", "focal"}, _NORMAL),
    ({"projectiontype", "focalx"}, _NORMAL),
    ({"sfmdataversion"}, "is a scene of OpenMVG; bring cameras.txt, by openMVG_main_openMVG2Colmap"),
    ({"mappingcoefficients"}, "is MATLAB's fisheye model, which is not read; calibrate with dockpose calibrate"),
    (
        {"cameraanglex", "frames"},
        "says an angle of view and no lens; bring the transforms.json of Nerfstudio or Instant NGP, with fl_x",
    ),
)


def foreign(data: bytes) -> str:
    """What a file is that is not read, by how it begins; empty where it may be read."""
    if len(data) >= 48:
        cameras, number, model, width, height = struct.unpack_from("<QIiQQ", data)
        if 0 < cameras < 1e5 and 0 <= model < 20 and number < 1e6 and 0 < width < 1e5 and 0 < height < 1e5:
            return "is COLMAP's cameras.bin; bring cameras.txt, by colmap model_converter --output_type TXT"
    return next((told for begins, told in _BY_BEGINNING if re.match(begins, data, re.DOTALL)), "")


def foreign_content(content: Any) -> str:
    """What a file is that is not read, by its keys; empty where it may be read."""
    if isinstance(content, list) and content:  # OpenSfM's reconstructions
        content = content[0]
    if not isinstance(content, Mapping):
        return ""
    names = {plain(key.rpartition(".")[2]) for key, _, _ in Fields(content).entries}
    return next((told for keys, told in _BY_KEYS if keys <= names and "flx" not in names), "")
