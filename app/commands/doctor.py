"""``dockpose doctor``: versions, decoders and one known pose, for a report of a fault."""

import argparse
import contextlib
import os
import platform
from collections.abc import Iterator
from importlib.metadata import PackageNotFoundError, version

import cv2
import numpy as np
from av.codec import codecs_available
from dockpose import estimate
from dockpose.app.commands.console import EXIT_ALL_READ, put
from dockpose.app.inputs.pictures import load_sample
from dockpose.pose.known import pose_error
from dockpose.sidecar import FIRST_SAMPLE
from dockpose.text import one_line

EXIT_BROKEN = 1
OK, WARNING, BROKEN = "ok", "warning", "broken"
_NEEDED = ("dockpose", "numpy", "scipy", "scikit-image", "numba", "av", "viser", "msgspec", "matplotlib")
# All builds of OpenCV are the one folder cv2.
_OPTIONAL = ("opencv-python-headless", "opencv-python", "opencv-contrib-python", "opencv-contrib-python-headless")
_OPTIONAL += ("pandas", "rosbags", "mcap")
_FEW_NEED = ("tiff", "bmp", "webp", "hevc", "av1")
_PICTURES, _VIDEOS = ("png", "jpg", "tiff", "bmp", "webp"), ("ffv1", "mjpeg", "h264", "hevc", "av1")
_MOST_ERROR_M, _MOST_ERROR_DEG = 0.005, 0.5
Finding = tuple[str, str, str]  # state, what was looked at, what was found


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose doctor``; returns the exit status, which is 1 where something is broken."""
    broken = 0
    for check in CHECKS:
        try:
            found = list(check())
        except Exception as error:  # whatever is wrong here is what people want to read
            text = str(error).replace(os.path.expanduser("~/"), "~/")  # that folder's path tells a name
            found = [(BROKEN, check.__name__, one_line(f"{type(error).__name__}: {text}"))]
        for state, what, text in found:
            broken += state == BROKEN
            put(f"{state:7} {what:20} {text}")
    put(f"{broken} broken, see above" if broken else "nothing is broken")
    return EXIT_BROKEN if broken else EXIT_ALL_READ


def versions() -> Iterator[Finding]:
    """Yield those of Python, of the system and of the packages; a missing one is broken if it is needed."""
    yield OK, "python", f"{platform.python_implementation()} {platform.python_version()}"
    yield OK, "system", f"{platform.platform()}, {os.cpu_count()} cores"
    yield OK, "opencv", cv2.__version__
    for name in (*_NEEDED, *_OPTIONAL):
        with contextlib.suppress(PackageNotFoundError):
            yield OK, name, version(name)
            continue
        if name in _NEEDED:
            yield BROKEN, name, "not installed"


def decoders() -> Iterator[Finding]:
    """Yield whether each kind of picture comes back from its own file, and whether each video's has a decoder."""
    can = {name: _comes_back(name) for name in _PICTURES} | {name: name in codecs_available for name in _VIDEOS}
    for name, is_read in can.items():
        state = OK if is_read else WARNING if name in _FEW_NEED else BROKEN
        yield state, name, "can be read" if is_read else "cannot be read"


def _comes_back(kind: str) -> bool:
    with contextlib.suppress(cv2.error):
        return cv2.imdecode(cv2.imencode(f".{kind}", np.eye(8, dtype=np.uint8))[1], cv2.IMREAD_UNCHANGED) is not None
    return False


def known_pose() -> Iterator[Finding]:
    """Yield how far the pose of one picture is off."""
    sample = load_sample(FIRST_SAMPLE)
    found = estimate(sample.image, sample.camera, sample.dock)
    error = pose_error(found.selected, sample.truth)
    if error is None:
        yield BROKEN, "known pose", found.message
        return
    error_m, error_deg = float(error.distance_m), float(np.degrees(error.angle_rad))
    state = OK if error_m <= _MOST_ERROR_M and error_deg <= _MOST_ERROR_DEG else BROKEN
    yield state, "known pose", f"sample {FIRST_SAMPLE} is off by {1000 * error_m:.2f} mm and {error_deg:.3f} deg"


CHECKS = (versions, decoders, known_pose)
