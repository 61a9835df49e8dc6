"""OpenCV's readers of videos, streams and cameras, without their messages on standard error."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Protocol

import cv2

# FFmpeg reports every flaw of a file on standard error; -8 is its level "quiet". OpenCV reads this on first use.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
if "OPENCV_LOG_LEVEL" not in os.environ:
    # OpenCV 5 moved the function.
    _cv2: Any = cv2
    _set_log_level = _cv2.utils.logging.setLogLevel if hasattr(cv2.utils, "logging") else _cv2.setLogLevel
    _set_log_level(0)  # silent
_STAMP_PROPERTY: int | None = getattr(cv2, "CAP_PROP_PTS", None)  # since OpenCV 4.11


class Capture(Protocol):
    """The part of ``cv2.VideoCapture`` that is used."""

    def grab(self) -> bool:
        """Grab the next frame; False if there is none or it is corrupt."""
        ...

    def retrieve(self) -> tuple[bool, Any]:
        """Return the grabbed frame, (H, W, 3) BGR uint8."""
        ...

    def get(self, property: int, /) -> float:
        """Return a property."""
        ...

    def release(self) -> None:
        """Release the device or file."""
        ...


def open_file(path: str) -> cv2.VideoCapture:
    """Open a video file or address with FFmpeg; check the result's ``isOpened()``."""
    return cv2.VideoCapture(path, cv2.CAP_FFMPEG)


def open_stream(address: str, timeout_s: float) -> cv2.VideoCapture:
    """Open a stream such that each frame is available as soon as it arrives.

    FFmpeg decodes frames in as many threads as there are cores, and so holds back that many; one thread holds none
    back.
    """
    milliseconds = max(1, round(1000 * timeout_s))
    wanted: Sequence[int] = [
        *(cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, milliseconds),
        *(cv2.CAP_PROP_READ_TIMEOUT_MSEC, milliseconds),
        *(cv2.CAP_PROP_N_THREADS, 1),
    ]
    return cv2.VideoCapture(address, cv2.CAP_FFMPEG, wanted)


def stamp_of(capture: Capture) -> int:
    """Time stamp of the frame or packet that was grabbed last, in the video's own units or in microseconds."""
    if _STAMP_PROPERTY is None:
        return round(1000 * capture.get(cv2.CAP_PROP_POS_MSEC))
    return int(capture.get(_STAMP_PROPERTY))


def open_camera(number: int) -> cv2.VideoCapture:
    """Open a camera by its number, with whichever backend the system has."""
    return cv2.VideoCapture(number, cv2.CAP_ANY)
