"""Camera files in YAML: ROS camera_info, OpenCV FileStorage and our own."""

from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import check_one_of
from dockpose.files import FileError, read_yaml, to_yaml, write_whole

FORMATS = ("dockpose", "ros", "opencv")
# Lens models as ROS and OpenCV name them, and how many coefficients each has; the last two are the same model.
_DISTORTION_MODELS = {"plumb_bob": (4, 5), "rational_polynomial": (8,), "equidistant": (4,), "fisheye": (4,)}
_FISHEYE_MODELS = ("equidistant", "fisheye")


class Matrix(msgspec.Struct):
    """A matrix of so many rows and columns."""

    rows: int
    cols: int
    data: list[float]


class CalibrationFile(msgspec.Struct):
    """The keys that ROS camera_info and OpenCV's calibration share; others are ignored."""

    image_width: int
    image_height: int
    camera_matrix: Matrix
    distortion_coefficients: Matrix
    distortion_model: str | None = None


def load_camera(path: str | Path) -> Camera:
    """Read a camera file in any of the three formats.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    Camera
        The camera that it describes.

    Raises
    ------
    FileError
        If the file cannot be read, is not YAML, lacks a key, or has one of the wrong type or shape.
    """
    content = read_yaml(path)
    try:
        if "camera" in content:
            return msgspec.convert(content["camera"], Camera, strict=False)
        if "camera_matrix" in content or "image_width" in content:
            return camera_of_calibration(msgspec.convert(content, CalibrationFile, strict=False))
    except (msgspec.ValidationError, ValueError) as error:
        raise FileError(f"{path}: {error}") from error
    raise FileError(
        f"{path}: is not a camera file: it has neither the key camera (dockpose) nor camera_matrix (ROS, OpenCV); "
        f"its keys are {', '.join(map(str, content)) or 'none'}"
    )


def save_camera(camera: Camera, path: str | Path, file_format: str = "dockpose") -> None:
    """Write a camera file that :func:`load_camera` reads back to the same numbers.

    Parameters
    ----------
    camera : Camera
        The camera to write.
    path : str or Path
        Where to write it; an existing file is replaced.
    file_format : {"dockpose", "ros", "opencv"}
        Our own YAML, ROS camera_info YAML or OpenCV FileStorage YAML.

    Raises
    ------
    ValueError
        If the format is unknown, or cannot hold a port or a tone curve.
    """
    check_one_of("file_format", file_format, FORMATS)
    for name, is_there in (("port", camera.port is not None), ("tone", camera.tone != "linear")):
        if is_there and file_format != "dockpose":
            raise ValueError(f"file_format is {file_format!r}, which has no place for the {name}; use dockpose")
    if file_format == "opencv":
        write_whole(Path(path), _opencv_text(camera).encode())
        return
    content = {"camera": msgspec.to_builtins(camera)} if file_format == "dockpose" else _ros_content(camera)
    write_whole(Path(path), to_yaml(content).encode())


def camera_of_calibration(file: CalibrationFile) -> Camera:
    """Return the camera that ROS camera_info or OpenCV's calibration describes."""
    matrix = _values("camera_matrix", file.camera_matrix)
    if matrix.shape != (3, 3):
        raise ValueError(f"camera_matrix is {matrix.shape[0]} x {matrix.shape[1]}; it must be 3 x 3")
    (fx, skew, cx), (zero, fy, cy), last = matrix.tolist()
    if skew != 0 or zero != 0 or last != [0, 0, 1]:
        raise ValueError(f"camera_matrix is {matrix.tolist()}; it must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]")
    distortion = _values("distortion_coefficients", file.distortion_coefficients).ravel()
    model = file.distortion_model
    if model is not None:
        check_one_of("distortion_model", model, _DISTORTION_MODELS)
        if len(distortion) not in (0, *_DISTORTION_MODELS[model]):
            wanted = " or ".join(map(str, _DISTORTION_MODELS[model]))
            raise ValueError(f"distortion_coefficients has {len(distortion)} values; {model} has {wanted}")
    coefficients = tuple(distortion.tolist())
    size = file.image_width, file.image_height
    return Camera(fx, fy, cx, cy, *size, coefficients, fisheye=model in _FISHEYE_MODELS)


def _values(name: str, matrix: Matrix) -> np.ndarray:
    if matrix.rows < 0 or matrix.cols < 0 or matrix.rows * matrix.cols != len(matrix.data):
        raise ValueError(f"{name} says {matrix.rows} x {matrix.cols}, but its data has {len(matrix.data)} values")
    return np.array(matrix.data).reshape(matrix.rows, matrix.cols)


def _ros_content(camera: Camera) -> dict[str, Any]:
    # ROS requires five coefficients for plumb_bob, four for equidistant.
    distortion = list(camera.distortion) + [0.0] * max(0, (4 if camera.fisheye else 5) - len(camera.distortion))
    model = {4: "equidistant", 5: "plumb_bob", 8: "rational_polynomial"}[len(distortion)]
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


def _opencv_text(camera: Camera) -> str:
    storage = cv2.FileStorage(".yml", cv2.FileStorage_WRITE | cv2.FileStorage_MEMORY)
    storage.write("image_width", camera.width)
    storage.write("image_height", camera.height)
    storage.write("camera_matrix", camera.matrix)
    if camera.fisheye:  # OpenCV's own files do not name the lens model
        storage.write("distortion_model", "fisheye")
    storage.write("distortion_coefficients", np.array([camera.distortion or (0.0,) * (4 if camera.fisheye else 5)]))
    return storage.releaseAndGetString()
