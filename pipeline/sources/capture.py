"""OpenCV's readers of videos, streams and cameras, without their noise on standard error."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Protocol

import cv2

# FFmpeg writes every flaw of a file to standard error; -8 is its level "quiet". OpenCV reads it on first use.
os.environ.setdefault("OPENCV_FFMPEG_LOGLEVEL", "-8")
if "OPENCV_LOG_LEVEL" not in os.environ:
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)


class Capture(Protocol):
    """What is used of ``cv2.VideoCapture``."""

    def grab(self) -> bool:
        """Take the next frame; False where there is none or it is corrupt."""
        ...

    def retrieve(self) -> tuple[bool, Any]:
        """Return the frame that was taken, (H, W, 3) BGR uint8."""
        ...

    def get(self, property: int, /) -> float:
        """Return a property."""
        ...

    def release(self) -> None:
        """Let go of it."""
        ...


def open_file(path: str) -> cv2.VideoCapture:
    """Open a video file or address with FFmpeg; ``isOpened()`` of what is returned tells whether it could be."""
    return cv2.VideoCapture(path, cv2.CAP_FFMPEG)


def open_stream(address: str, timeout_s: float) -> cv2.VideoCapture:
    """Open a stream so that each frame comes as soon as it is there.

    FFmpeg decodes frames in as many threads as there are cores, and so gives each out only when as many more came;
    one thread holds none back.
    """
    milliseconds = max(1, round(1000 * timeout_s))
    wanted: Sequence[int] = [
        *(cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, milliseconds),
        *(cv2.CAP_PROP_READ_TIMEOUT_MSEC, milliseconds),
        *(cv2.CAP_PROP_N_THREADS, 1),
    ]
    return cv2.VideoCapture(address, cv2.CAP_FFMPEG, wanted)


def open_camera(number: int) -> cv2.VideoCapture:
    """Open a camera by its number, by whatever means the system has."""
    return cv2.VideoCapture(number, cv2.CAP_ANY)
