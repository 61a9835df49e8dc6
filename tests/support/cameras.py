"""A camera that answers as OpenCV's Video4Linux backend does, in place of ``cv2.VideoCapture``.

It follows modules/videoio/src/cap_v4l.cpp: a format that the driver does not have leaves another one in force and is
still answered with yes, sizes and rates go to the nearest that there is, controls are clamped, unknown ones refused,
without CONVERT_RGB grey formats keep their depth, and a rate can be set only while no frames flow.
"""

import time
from collections.abc import Callable

import cv2
import numpy as np

FORMATS = ("YUYV", "MJPG")
SIZES = ((320, 240), (640, 480), (1280, 720))


class V4l2Camera:
    """One open camera; ``make`` returns a factory that takes the place of ``cv2.VideoCapture``."""

    def __init__(
        self,
        pictures: list[np.ndarray],
        formats: tuple[str, ...] = FORMATS,
        sizes: tuple[tuple[int, int], ...] = SIZES,
        rates_hz: tuple[float, ...] = (10.0, 30.0),
        controls: dict[int, tuple[int, int]] | None = None,
        is_there: bool = True,
        on_end: Callable[[], object] = lambda: None,
        again: Callable[[], bool] = lambda: False,
    ) -> None:
        self.pictures, self.formats, self.sizes, self.rates_hz = pictures, formats, sizes, rates_hz
        # Control and its lowest and highest value; a camera without exposure or gain lacks them.
        self.ranges = controls if controls is not None else {cv2.CAP_PROP_EXPOSURE: (3, 117), cv2.CAP_PROP_GAIN: (0, 4)}
        self.controls = {control: low for control, (low, _) in self.ranges.items()}
        self.on_end, self.again = on_end, again  # what happens at the end, and whether to begin anew instead
        self.is_there, self.format, self.size, self.rate_hz = is_there, formats[0], (640, 480), rates_hz[-1]
        self.is_streaming, self.interruptions = False, 0
        self.is_auto, self.converts, self.asked_width = True, True, None
        self.grabbed, self.stamp_s, self.released = -1, 0.0, False

    @classmethod
    def make(cls, *arguments, **more) -> "Opener":
        """Return what opens such a camera, and keeps the one opened last as its ``last``."""

        return Opener(lambda: cls(*arguments, **more))

    def isOpened(self) -> bool:
        return self.is_there

    def getBackendName(self) -> str:
        return "V4L2"

    def set(self, control: int, value: float) -> bool:
        number = round(value)
        if control == cv2.CAP_PROP_FOURCC:
            letters = bytes(number >> place & 0xFF for place in (0, 8, 16, 24)).decode().strip()
            self.interruptions += self.is_streaming
            self.is_streaming = False
            self.format = letters if letters in self.formats else self.formats[0]
            return True
        if control == cv2.CAP_PROP_FRAME_WIDTH:
            self.asked_width = number  # takes effect with the height
            return True
        if control == cv2.CAP_PROP_FRAME_HEIGHT:
            self.interruptions += self.is_streaming
            self.is_streaming = False
            wanted = (self.asked_width or self.size[0], number)
            self.size = min(self.sizes, key=lambda size: abs(size[0] - wanted[0]) + abs(size[1] - wanted[1]))
            return True
        if control == cv2.CAP_PROP_FPS:
            if self.is_streaming:
                raise RuntimeError("OpenCV would wait here until the stream rests, which it never does")
            self.rate_hz = min(self.rates_hz, key=lambda rate: abs(rate - number))
            return True
        if control == cv2.CAP_PROP_CONVERT_RGB:
            self.converts = bool(number)
            return True
        if control == cv2.CAP_PROP_AUTO_EXPOSURE:
            if cv2.CAP_PROP_EXPOSURE not in self.ranges or number not in (1, 3):
                return False
            self.is_auto = number == 3
            return True
        if control not in self.ranges or (control == cv2.CAP_PROP_EXPOSURE and self.is_auto):
            return False
        low, high = self.ranges[control]
        self.controls[control] = min(max(number, low), high)
        return True

    def get(self, control: int) -> float:
        if control == cv2.CAP_PROP_FOURCC:
            return float(cv2.VideoWriter.fourcc(*self.format.ljust(4)))
        known = {
            cv2.CAP_PROP_FRAME_WIDTH: float(self.size[0]),
            cv2.CAP_PROP_FRAME_HEIGHT: float(self.size[1]),
            cv2.CAP_PROP_FPS: self.rate_hz,
            cv2.CAP_PROP_POS_MSEC: 1000 * self.stamp_s,
        }
        return known[control] if control in known else float(self.controls.get(control, -1.0))

    def grab(self) -> bool:
        if self.grabbed + 1 >= len(self.pictures):
            if self.again():
                self.grabbed = -1
            else:
                self.on_end()
        time.sleep(1 / self.rate_hz)
        self.grabbed += 1
        self.is_streaming = True
        self.stamp_s = time.monotonic()
        return self.is_there and self.grabbed < len(self.pictures)

    def retrieve(self) -> tuple[bool, np.ndarray | None]:
        picture = self.pictures[self.grabbed]
        height, width = self.size[1], self.size[0]
        if picture.shape[:2] != (height, width):
            picture = cv2.resize(picture, (width, height))
        if self.format in ("Y16", "GREY") and not self.converts:
            return True, picture  # uint16 of Y16
        if self.format == "MJPG" and not self.converts:
            return True, np.frombuffer(jpeg_of(picture), np.uint8).reshape(1, -1)
        if picture.dtype == np.uint16:
            picture = np.right_shift(picture, 8).astype(np.uint8)
        return True, cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture

    def release(self) -> None:
        self.released = True


def jpeg_of(picture: np.ndarray) -> bytes:
    """A colour JPEG, as cameras send."""
    colour = cv2.cvtColor(picture, cv2.COLOR_GRAY2BGR) if picture.ndim == 2 else picture
    return cv2.imencode(".jpg", colour)[1].tobytes()


class Opener:
    """Takes the place of ``cv2.VideoCapture``; ``last`` is the camera that was opened last.

    Once ``is_unplugged``, no other one can be opened.
    """

    def __init__(self, make: Callable[[], V4l2Camera]) -> None:
        self._make, self.is_unplugged = make, False

    def __call__(self, number: int, backend: int = 0) -> V4l2Camera:
        self.last = self._make()
        self.last.is_there = self.last.is_there and not self.is_unplugged
        return self.last
