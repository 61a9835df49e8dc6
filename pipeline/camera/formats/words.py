"""Files that are not read: what each of them is, and which file of the same program is read."""

import re
import struct
from collections.abc import Mapping
from typing import Any

from dockpose.camera.formats.fields import Fields, plain
from dockpose.text import ARCHIVES, ELSEWHERE, kind_in_words

# What is read, as the page, the docs and messages say it, and the usual ends of such files' names.
READ = "YAML, JSON, XML, TOML, INI, text, .npz and .mat of ROS, OpenCV, Kalibr, COLMAP, MATLAB and many more"
ENDINGS = [".yaml", ".yml", ".json", ".xml", ".toml", ".ini", ".conf", ".txt", ".m", ".cameramodel", ".npz", ".mat"]
_BOTH = "bring matrix and lens in one: np.savez('camera.npz', mtx=..., dist=...)"
_BY_HAND = "calibrate with dockpose calibrate"
# How a file begins, what it is, and what to bring.
_BY_BEGINNING = {
    rb".{257}ustar|" + b"|".join(map(re.escape, ARCHIVES)): "is an archive, as ROS's calibrator packs; unpack it and "
    "bring ost.yaml, or left.yaml or right.yaml of a pair",
    rb".{,9999}?\bIntrinsic of \"": "is what rs-enumerate-devices prints; bring the camera_info of its ROS driver, "
    "or fx, fy, cx, cy as YAML",
    rb"\x93NUMPY": f"is a single array of NumPy; {_BOTH}",
    rb"\x80[\x02-\x05]|\(dp?\d?\r?\n|\(lp\d\r?\n": f"is a pickle of Python, which is not safe to read; {_BOTH}",
    rb"(?i:MATLAB v?7\.3)|\x89HDF": "is a MAT file of version 7.3, or another HDF5 file; save a struct, as of "
    "toStruct, with -v7: save('c.mat', 's', '-v7')",
    rb"# INTERNAL CAMERA PARAMETERS|ParGroup: Cam|Pix4D camera calibration|# Bundle file": "is of HALCON, Pix4D or "
    f"Bundler, whose numbers are not in OpenCV's terms; {_BY_HAND}",
    rb"[\s\[]{0,9}[-+.\d][-+\d.eE,;\s\[\]]*$": "holds numbers without names, such as a matrix alone, without its lens; "
    + _BOTH,
}
_NORMAL = "is of OpenSfM, whose numbers are shares of the width; bring cameras.txt, by opensfm export_colmap"
# Keys that tell a program, anywhere in its file.
_BY_KEYS = {
    "intrinsicid intrinsics": f"is a scene of Meshroom, whose lenses are not read; {_BY_HAND}",
    "calibrationinformation": "is of an Azure Kinect, whose numbers are shares of the width; bring the camera_info of "
    "its ROS driver",
    "projectiontype focal": _NORMAL,
    "projectiontype focalx": _NORMAL,
    "sfmdataversion": "is a scene of OpenMVG; bring cameras.txt, by openMVG_main_openMVG2Colmap",
    "mappingcoefficients": f"is MATLAB's fisheye model, which is not read; {_BY_HAND}",
    "cameraanglex frames": "says an angle of view and no lens; bring the transforms.json of Nerfstudio or Instant NGP, "
    "with fl_x",
}


def foreign(data: bytes) -> str:
    """What a file is that is not read, by how it begins; empty where it may be read."""
    if len(data) >= 48:
        cameras, number, model, width, height = struct.unpack_from("<QIiQQ", data)
        if 0 < cameras < 1e5 and 0 <= model < 20 and number < 1e6 and 0 < width < 1e5 and 0 < height < 1e5:
            return "is COLMAP's cameras.bin; bring cameras.txt, by colmap model_converter --output_type TXT"
    if kind := kind_in_words(data.lstrip(), ELSEWHERE):
        return f"is {kind}"
    return next((told for begins, told in _BY_BEGINNING.items() if re.match(begins, data, re.DOTALL)), "")


def foreign_content(content: Any) -> str:
    """What a file is that is not read, by its keys; empty where it may be read."""
    if isinstance(content, list) and content:  # OpenSfM's reconstructions
        content = content[0]
    if not isinstance(content, Mapping):
        return ""
    names = {plain(key.rpartition(".")[2]) for key, _, _ in Fields(content).entries}
    return next((told for keys, told in _BY_KEYS.items() if {*keys.split()} <= names and "flx" not in names), "")
