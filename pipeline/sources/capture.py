"""What cameras are asked for, OpenCV's cameras without their messages, and streams without delay."""

import abc
import errno
import math
import os
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import av
import cv2
import numpy as np
from av.error import FFmpegError, HTTPNotFoundError, HTTPUnauthorizedError
from dockpose.sources.ffmpeg import best_video, opened, picture_of
from dockpose.sources.frames import Callback, SourceError
from dockpose.sources.guard import Guard
from dockpose.sources.kinds import CaptureSettings

if "OPENCV_LOG_LEVEL" not in os.environ:
    # OpenCV 5 moved the function.
    _cv2: Any = cv2
    _set_log_level = _cv2.utils.logging.setLogLevel if hasattr(cv2.utils, "logging") else _cv2.setLogLevel
    _set_log_level(0)  # silent

# Grey formats, which OpenCV would otherwise turn into three equal colours of 8 bits.
_GREY_FORMATS = ("GREY", "Y8", "Y800", "Y10", "Y12", "Y16")
# OpenCV's backend that hands out pixels and JPEG data as the camera sends them, where it is asked to.
_WITH_RAW_DATA = "V4L2"
_JPEG_BEGINS = b"\xff\xd8"
_JPEG_FORMATS = ("MJPG", "JPEG")
# Video4Linux counts 1 as manual (V4L2_EXPOSURE_MANUAL), other systems 0 as not automatic.
_MANUAL_EXPOSURE = 1 if sys.platform.startswith("linux") else 0
_SAME_RATE = 0.02  # 29.97 is as good as 30


class Capture(abc.ABC):
    """A live source that is open; what it says of itself is that of the frame which was grabbed last."""

    def __init__(self, *, grey: bool = False) -> None:
        self._grey = grey
        self._frame: av.VideoFrame | None = None
        self.about = ""  # what it gives, in words, as "1280 x 720 MJPG at 30 frames/s"
        self.packets: tuple[av.Packet, ...] = ()  # as it was sent
        self.time_s: float | None = None  # by its own clock
        self.unix_at_zero_s: float | None = None  # time of day at the zero of ``time_s``
        self.left_out = 0  # pictures before it, for lack of packets
        self.is_idle = False  # whether a grab that gives nothing was merely too early

    def ask(self, settings: CaptureSettings) -> tuple[str, ...]:
        """Set what can be set, and say in words what was refused; of a stream its sender decides."""
        return ()

    @abc.abstractmethod
    def grab(self) -> bool:
        """Wait for the next frame; False if there is none, or if it is corrupt."""

    def retrieve(self) -> np.ndarray | None:
        """Return the frame that was grabbed last, (H, W) or (H, W, 3) BGR, uint8 or uint16."""
        return None if self._frame is None else picture_of(self._frame, grey=self._grey)

    @property
    def shown(self) -> Callable[[], np.ndarray] | None:
        """Returns the frame as it is shown, where only its brightness was retrieved."""
        return partial(picture_of, self._frame) if self._grey and self._frame is not None else None

    @abc.abstractmethod
    def release(self) -> None:
        """Let go of it."""


class Camera(Capture):
    """A camera of this machine, by its number, with whichever backend the system has. Raises SourceError without one.

    With Video4Linux, grey formats keep all their levels (GREY is uint8, Y10 to Y16 are uint16), and of Motion JPEG the
    data are there as they were sent; other pictures are BGR, uint8. This was tried with no real camera, but with one
    that answers as OpenCV's source says that Video4Linux does.
    """

    def __init__(self, number: int, *, grey: bool = False) -> None:
        super().__init__(grey=grey)
        self._decoder = Guard(av.VideoCodecContext.create("mjpeg", "r"))
        self._capture = cv2.VideoCapture(number, cv2.CAP_ANY)
        if not self._capture.isOpened():
            self.release()
            raise SourceError(f"camera {number}: no camera has that number, or another program uses it")
        self.about = self._words()

    def ask(self, settings: CaptureSettings) -> tuple[str, ...]:
        """Set what can be set, and say in words what was refused."""
        # In this order: the format limits the sizes, and both the rates. What is so already is not set again, which
        # would interrupt the frames; and Video4Linux takes a rate only while they rest, as they do after a size.
        if settings.format is not None and settings.format != self._format():
            self._capture.set(cv2.CAP_PROP_FOURCC, cv2.VideoWriter.fourcc(*settings.format.ljust(4)))
        width, height = size = self._size()
        wanted = (settings.width or width, settings.height or height)
        is_other_rate = settings.rate_hz is not None and not self._gives(settings.rate_hz)
        if wanted != size or is_other_rate:
            self._capture.set(cv2.CAP_PROP_FRAME_WIDTH, wanted[0])
            self._capture.set(cv2.CAP_PROP_FRAME_HEIGHT, wanted[1])
        if settings.rate_hz is not None and is_other_rate:
            self._capture.set(cv2.CAP_PROP_FPS, settings.rate_hz)
        if self._capture.getBackendName() == _WITH_RAW_DATA:
            is_raw = self._format() in (*_GREY_FORMATS, *_JPEG_FORMATS)
            self._capture.set(cv2.CAP_PROP_CONVERT_RGB, 0 if is_raw else 1)
        refused, taken = self._refused_of_format(settings), [self._words()]
        if settings.exposure is not None:
            self._capture.set(cv2.CAP_PROP_AUTO_EXPOSURE, _MANUAL_EXPOSURE)
        # To ask for what a camera does not have makes OpenCV write to standard error.
        for name, article, which in (("exposure", "an", cv2.CAP_PROP_EXPOSURE), ("gain", "a", cv2.CAP_PROP_GAIN)):
            if (asked := getattr(settings, name)) is not None:
                if self._capture.set(which, asked):
                    taken.append(f"{name} {asked:g} asked, {self._capture.get(which):g} set")
                else:
                    refused.append(f"does not take {article} {name} of {asked:g} and keeps its own")
        self.about = "; ".join(taken)
        return tuple(refused)

    def grab(self) -> bool:
        """Wait for the next frame; False if there is none."""
        is_there = self._capture.grab()
        stamp_ms = self._capture.get(cv2.CAP_PROP_POS_MSEC)  # by the driver's clock (Video4Linux: monotonic)
        self.time_s = stamp_ms / 1000 if stamp_ms > 0 else None
        return is_there

    def retrieve(self) -> np.ndarray | None:
        """Return the frame that was grabbed last, (H, W, 3) BGR uint8, or (H, W) uint8 or uint16 of a grey format."""
        self.packets, self._frame = (), None
        good, image = self._capture.retrieve()
        if not good or image is None or image.size == 0:
            return None
        if image.dtype == np.uint8 and image.ravel()[:2].tobytes() == _JPEG_BEGINS and min(image.shape[:2]) == 1:
            return self._of_jpeg(image.tobytes())
        return image[:, :, 0] if image.ndim == 3 and image.shape[2] == 1 else image

    def release(self) -> None:
        """Release the camera."""
        self._capture.release()

    def _of_jpeg(self, data: bytes) -> np.ndarray | None:
        """Decode as streams and recordings are decoded, so that a recording shows the very same."""
        self.packets = (av.Packet(data),)
        decoded = self._decoder.decode(self.packets[0])
        self._frame = decoded[0] if decoded else None
        return super().retrieve()

    def _refused_of_format(self, settings: CaptureSettings) -> list[str]:
        """What was refused of the format, the size and the rate; drivers take the nearest without a word."""
        refused = []
        width, height = self._size()
        if settings.format is not None and self._format() != settings.format:
            refused.append(f"does not give {settings.format} and goes on with {self._format() or 'its own format'}")
        if settings.width is not None and (width, height) != (settings.width, settings.height):
            refused.append(f"does not give {settings.width} x {settings.height} and goes on with {width} x {height}")
        if settings.rate_hz is not None and not self._gives(settings.rate_hz):
            rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
            given = f"goes on with {rate_hz:g}" if rate_hz > 0 else "does not say what it gives"
            refused.append(f"does not give {settings.rate_hz:g} frames/s and {given}")
        return refused

    def _gives(self, rate_hz: float) -> bool:
        return abs(self._capture.get(cv2.CAP_PROP_FPS) - rate_hz) <= _SAME_RATE * rate_hz

    def _words(self) -> str:
        """What the camera says of itself by now."""
        width, height = self._size()
        rate_hz = self._capture.get(cv2.CAP_PROP_FPS)
        rate = f"at {rate_hz:.4g} frames/s" if rate_hz > 0 else ""
        return " ".join(filter(None, (f"{width} x {height}", self._format(), rate)))

    def _size(self) -> tuple[int, int]:
        return int(self._capture.get(cv2.CAP_PROP_FRAME_WIDTH)), int(self._capture.get(cv2.CAP_PROP_FRAME_HEIGHT))

    def _format(self) -> str:
        """The four letters of the format, without blanks; empty where the backend does not tell."""
        code = int(self._capture.get(cv2.CAP_PROP_FOURCC))
        letters = bytes(code >> place & 0xFF for place in (0, 8, 16, 24)) if code > 0 else b""
        text = letters.decode("ascii", "replace").rstrip(" \0")
        return text if text.isprintable() else ""


# Frames are neither queued nor waited for, and the format is recognised from half a second of them rather than five.
_OPTIONS = {"fflags": "nobuffer", "flags": "low_delay", "analyzeduration": "500000"}
_NO_VIDEO = "nothing answers there, or what answers is not a video"
_REFUSED: dict[Any, str] = {  # by FFmpeg's error or its number
    errno.EPROTONOSUPPORT: "the server does not send RTP over TCP; over UDP frames would be lost without a word",
    HTTPNotFoundError: "the server has no such stream",
    HTTPUnauthorizedError: "the server asks for a name and a password, as in rtsp://NAME:PASSWORD@HOST",
}
_TELL_EVERY_S = 10.0
_MOST_PACKETS = 3000  # that are kept for a recording while no picture is given
_YEAR_2000_S = 946_684_800  # an earlier clock was never set
# Formats whose frames carry the sender's clock; for others, FFmpeg makes times up from a frame rate.
_WITH_CLOCK = {"rtsp", "rtp", "sdp", "mpegts", "flv", "live_flv", "hls"}


class StreamCapture(Capture):
    """A stream that is open; one thread decodes it, since more of them hold frames back."""

    def __init__(self, address: str, timeout_s: float, tell: Callback | None = None, *, grey: bool = False) -> None:
        super().__init__(grey=grey)
        start_s = time.monotonic()
        try:
            self._container = opened(address, options=_OPTIONS, timeout=(timeout_s, timeout_s))
            if not self._container.streams.video:
                self._container.close()
                raise OSError("has no video in it")
        except (FFmpegError, OSError, ValueError) as error:
            if time.monotonic() - start_s >= 0.9 * timeout_s:
                raise SourceError(f"{address}: does not answer within {timeout_s:g} s") from error
            what = _REFUSED.get(type(error), _REFUSED.get(getattr(error, "errno", None), _NO_VIDEO))
            raise SourceError(f"{address}: cannot be opened: {what}") from error
        self._stream = best_video(self._container)
        # An RTSP server sends what it has recorded as if it happened now.
        is_film = self._stream.frames > 0 or (self._container.duration or 0) > 0
        if is_film and not address.lower().startswith("rtsp"):
            self._container.close()
            raise SourceError(f"{address}: is a recording and not live; download it, and open the file")
        self._stream.codec_context.thread_count = 1
        self._guard = Guard(self._stream.codec_context, is_late=self._container.format.name == "mpegts")
        self._address, self._tell, self._told_s, self._untold = address, tell or (lambda text: None), -math.inf, 0
        self._has_clock = bool(_WITH_CLOCK & set(self._container.format.name.split(",")))
        self._is_intra = self._stream.codec_context.codec.intra_only
        self._packets = self._container.demux(self._stream)
        self._waiting: list[av.VideoFrame] = []
        self._sent: list[av.Packet] = []  # which no frame has brought along so far
        rate = self._stream.average_rate if self._has_clock else None
        codec = self._stream.codec_context
        shown = f" at {float(rate):.4g} frames/s" if rate else ""
        self.about = f"{codec.width} x {codec.height} {codec.name}{shown}"

    def grab(self) -> bool:
        """Wait for the next whole frame; False if there is none, or one is left out."""
        if not self.is_idle:
            self.left_out = 0
        self.is_idle, self._guard.left_out = False, 0
        while not self._waiting:
            try:
                packet = next(self._packets)
                self._waiting = self._guard.decode(packet)
            except (StopIteration, FFmpegError):
                return False
            if packet.size:
                # Without a clock the frame's time is all that there is, so that it must be the frame's packet alone.
                self._sent = [*(self._sent[-_MOST_PACKETS:] if self._has_clock else ()), packet]
            self.is_idle = self._guard.left_out > 0 and not self._is_intra
            self._say(self._guard.left_out if self.is_idle else 0)
            if not self._waiting and (packet.size == 0 or self._guard.left_out):
                return False
        self.is_idle = False
        self._frame = self._waiting.pop(0)
        own = max(0, len(self._sent) - len(self._waiting) - self._guard.held)  # the others come with the next frames
        self.packets, self._sent = tuple(self._sent[:own]), self._sent[own:]
        if not (self._has_clock or self._is_intra):
            self.packets = ()
        self.time_s = self._frame.time if self._has_clock else None
        began_us = self._container.start_time_realtime  # by the sender's reports (RTCP)
        self.unix_at_zero_s = None if began_us is None or began_us / 1e6 < _YEAR_2000_S else began_us / 1e6
        return True

    def _say(self, left_out: int) -> None:
        """Say how many pictures are left out, and not too often."""
        self.left_out, self._untold, now_s = self.left_out + left_out, self._untold + left_out, time.monotonic()
        if self._untold and now_s - self._told_s >= _TELL_EVERY_S:
            text = f"{self._untold} pictures are left out: damaged, or predicted from damaged ones"
            self._tell(f"{self._address}: {text}")
            self._told_s, self._untold = now_s, 0

    def release(self) -> None:
        """Close the connection."""
        self._container.close()
