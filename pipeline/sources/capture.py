"""What a live source is read through, and OpenCV's cameras, without their messages on standard error."""

from __future__ import annotations

import os
from typing import Any, Protocol

import cv2
import numpy as np

if "OPENCV_LOG_LEVEL" not in os.environ:
    # OpenCV 5 moved the function.
    _cv2: Any = cv2
    _set_log_level = _cv2.utils.logging.setLogLevel if hasattr(cv2.utils, "logging") else _cv2.setLogLevel
    _set_log_level(0)  # silent


class Capture(Protocol):
    """An open camera or stream."""

    @property
    def time_s(self) -> float | None:
        """Time of the frame that was grabbed last by the source's own clock, in seconds; None where it has none."""
        ...

    def grab(self) -> bool:
        """Wait for the next frame; False if there is none or it is corrupt."""
        ...

    def retrieve(self) -> tuple[bool, np.ndarray | None]:
        """Return the frame that was grabbed last, (H, W) or (H, W, 3) BGR, uint8 or uint16."""
        ...

    def release(self) -> None:
        """Release the device or the connection."""
        ...


class Camera:
    """A camera of this machine, by its number, with whichever backend the system has; check ``is_open``."""

    time_s = None

    def __init__(self, number: int) -> None:
        self._capture = cv2.VideoCapture(number, cv2.CAP_ANY)

    @property
    def is_open(self) -> bool:
        """Whether there is a camera of that number, and no other program has it."""
        return self._capture.isOpened()

    def grab(self) -> bool:
        """Wait for the next frame; False if there is none."""
        return self._capture.grab()

    def retrieve(self) -> tuple[bool, np.ndarray | None]:
        """Return the frame that was grabbed last, (H, W, 3) BGR uint8."""
        good, image = self._capture.retrieve()
        return good, image if good else None

    def release(self) -> None:
        """Release the camera."""
        self._capture.release()
