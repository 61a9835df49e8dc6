"""Camera files: those of many programs are read, and our own, ROS's, OpenCV's and Kalibr's written."""

import os
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.formats.content import LARGEST_BYTES, content_of
from dockpose.camera.formats.described import NoSizeError
from dockpose.camera.formats.readers import cameras_in
from dockpose.camera.formats.words import READ, foreign_content
from dockpose.checks import check_one_of
from dockpose.files import FileError, read_small, to_yaml, write_whole
from dockpose.text import shown

_ZED = re.compile("(LEFT|RIGHT)_CAM_")  # whose smaller pictures are cut out of the larger ones
FORMATS = ("dockpose", "ros", "opencv", "opencv-xml", "kalibr")


def load_camera(
    path: str | Path, *, size: tuple[int, int] | None = None, tell: Callable[[str], None] = lambda note: None
) -> Camera:
    """Read a camera file, be it ours or that of another program; the docs list them.

    Parameters
    ----------
    path : str or Path
        The file; with ``#NAME`` behind it one of several cameras in it, without it the first.
    size : (int, int), pixels, optional
        Width and height of the pictures that it is for, where the file does not say it.
    tell : callable
        Gets a sentence on what was assumed or changed.

    Returns
    -------
    Camera
        The camera that it describes.

    Raises
    ------
    FileError
        If the file cannot be read, is of no known format, or lacks a number or has a wrong one; its kind `NoSizeError`
        where it does not say for which pictures it is.
    """
    file, wanted = split_name(path)
    content = content_of(read_small(file, LARGEST_BYTES, is_cut=True), str(file))
    if told := foreign_content(content):
        raise FileError(f"{file}: {told}")
    try:
        is_own = isinstance(content, dict) and isinstance(content.get("camera"), dict)
        found = {} if is_own and not wanted and not cameras_in(content["camera"]) else cameras_in(content)
        if is_own and not found:
            return msgspec.convert(content["camera"], Camera, strict=False)
        if wanted and wanted not in found:
            raise ValueError(f"has no camera {shown(wanted)}; it has {', '.join(map(shown, found)) or 'none'}")
        if not wanted and len(found) > 1 and len({each.size for each in found.values()}) > 1 and _ZED.match(min(found)):
            raise ValueError(f"has a camera for each size of pictures; say which as {file}#NAME: {', '.join(found)}")
        if found:
            name, notes = wanted or next(iter(found)), []
            camera = found[name].camera(size, notes.append)
            if not wanted and len(found) > 1:
                notes.insert(0, f"has the cameras {', '.join(found)}; {name} is taken, {file}#NAME takes another")
            for note in notes:
                tell(f"{file}: {note}")
            return camera
    except NoSizeError as error:
        raise NoSizeError(f"{file}: {error}") from error
    except ValueError as error:
        raise FileError(f"{file}: {error}") from error
    except (LookupError, TypeError, AttributeError, OverflowError) as error:
        raise FileError(f"{file}: is not as its program writes it ({shown(error)})") from error
    keys = ", ".join(map(str, content)) if isinstance(content, dict) else ""
    raise FileError(f"{file}: is not a camera file of a kind that is known ({READ}); its keys are {keys or 'none'}")


def split_name(path: str | Path) -> tuple[Path, str]:
    """The file that FILE or FILE#NAME names, and the name."""
    text = str(path)
    if "#" not in text or os.path.exists(path):
        return Path(path), ""
    file, _, name = text.rpartition("#")
    return Path(file), name


def save_camera(camera: Camera, path: str | Path, file_format: str = "dockpose") -> None:
    """Write a camera file that :func:`load_camera` reads back to the same numbers.

    Parameters
    ----------
    camera : Camera
        The camera to write.
    path : str or Path
        Where to write it; an existing file is replaced.
    file_format : {"dockpose", "ros", "opencv", "opencv-xml", "kalibr"}
        Our own YAML, ROS camera_info YAML, OpenCV FileStorage as YAML or XML, or Kalibr's camchain.

    Raises
    ------
    ValueError
        If the format is unknown, or has no place for a port, a tone curve or a coefficient.
    """
    check_one_of("file_format", file_format, FORMATS)
    is_long = file_format == "kalibr" and any(camera.distortion[4:])
    lacks = {"port": camera.port is not None, "tone": camera.tone != "linear", "fifth coefficient": is_long}
    for name, is_there in lacks.items():
        if is_there and file_format != "dockpose":
            raise ValueError(f"file_format is {file_format!r}, which has no place for the {name}; use dockpose")
    if file_format.startswith("opencv"):
        text = _opencv_text(camera, ".xml" if file_format.endswith("xml") else ".yml")
    elif file_format == "dockpose":
        text = to_yaml({"camera": msgspec.to_builtins(camera)})
    else:
        text = to_yaml(ros_content(camera) if file_format == "ros" else _kalibr_content(camera))
    write_whole(Path(path), text.encode())


def ros_content(camera: Camera) -> dict[str, Any]:
    """The content of a camera file as ROS's calibrator writes it."""
    # ROS requires five coefficients for plumb_bob, four for equidistant.
    distortion = list(camera.distortion) + [0.0] * max(0, (4 if camera.fisheye else 5) - len(camera.distortion))
    model = {4: "equidistant", 5: "plumb_bob"}.get(len(distortion), "rational_polynomial")
    matrix = [float(value) for value in camera.matrix.ravel()]
    projection = np.hstack([camera.matrix, np.zeros((3, 1))])
    return {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": "camera",
        "camera_matrix": {"rows": 3, "cols": 3, "data": matrix},
        "distortion_model": model,
        "distortion_coefficients": {"rows": 1, "cols": len(distortion), "data": distortion},
        "rectification_matrix": {"rows": 3, "cols": 3, "data": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]},
        "projection_matrix": {"rows": 3, "cols": 4, "data": [float(value) for value in projection.ravel()]},
    }


def _kalibr_content(camera: Camera) -> dict[str, Any]:
    return {
        "cam0": {
            "cam_overlaps": [],
            "camera_model": "pinhole",
            "distortion_coeffs": [*camera.distortion, *[0.0] * 4][:4],
            "distortion_model": "equi" if camera.fisheye else "radtan",
            "intrinsics": [camera.fx, camera.fy, camera.cx, camera.cy],
            "resolution": [camera.width, camera.height],
            "rostopic": "/camera/image_raw",
        }
    }


def _opencv_text(camera: Camera, ending: str) -> str:
    storage = cv2.FileStorage(ending, cv2.FileStorage_WRITE | cv2.FileStorage_MEMORY)
    storage.write("image_width", camera.width)
    storage.write("image_height", camera.height)
    storage.write("camera_matrix", camera.matrix)
    if camera.fisheye:  # OpenCV's own files do not name the lens model
        storage.write("distortion_model", "fisheye")
    storage.write("distortion_coefficients", np.array([camera.distortion or (0.0,) * (4 if camera.fisheye else 5)]))
    return storage.releaseAndGetString()
