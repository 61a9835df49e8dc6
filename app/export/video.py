"""Videos that we write: H.264 that browsers play, or FFV1 that keeps every grey level, at the times of the frames."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import cast

import av
import numpy as np
from av import VideoStream
from av.container import OutputContainer
from av.error import FFmpegError
from dockpose.app.errors import UserError, writing

# Encoder, its options, and the formats of grey, deep grey and colour pictures.
_Codec = tuple[str, dict[str, str], tuple[str, str | None, str]]
_FFV1: _Codec = ("ffv1", {"level": "3", "g": "1"}, ("gray", "gray16le", "bgr0"))
_MOTION_JPEG: _Codec = ("mjpeg", {"qmin": "1", "qmax": "2"}, ("yuvj420p", None, "yuvj444p"))
# By the ending of the file's name.
_CODECS: dict[str, _Codec] = {
    ".mp4": ("libx264", {"crf": "18", "preset": "veryfast", "bf": "0"}, ("yuv420p", None, "yuv420p")),
    ".mkv": _FFV1,
    ".avi": _FFV1,
}
_TICK = Fraction(1, 1_000_000)  # of MP4 and Matroska; AVI counts frames
# The file can be read even where writing was cut short, and becomes a plain MP4 at the end.
_CONTAINER = {".mp4": {"movflags": "hybrid_fragmented"}}


def is_video_file(path: Path) -> bool:
    """Whether a name ends as a video that can be written."""
    return path.suffix.lower() in _CODECS


class VideoFile:
    """A video made from pictures of one size, begun with the first; as a context manager it finishes itself.

    Parameters
    ----------
    path : Path
        NAME.mp4 for H.264, which browsers play; NAME.mkv or NAME.avi for FFV1, which loses nothing.
    rate_hz : float
        Pictures in a second, where they have no times of their own. An AVI has no other times.
    is_lossless : bool
        Whether an AVI keeps every grey level; otherwise it is Motion JPEG, which more programs play.

    Raises
    ------
    UserError
        If there is no such folder.
    """

    def __init__(self, path: Path, rate_hz: float, *, is_lossless: bool = False) -> None:
        if not path.parent.is_dir():
            raise UserError(f"{path}: cannot be written ({path.parent}: there is no such folder)")
        self._path, self._suffix = path, path.suffix.lower()
        self._codec = _CODECS[self._suffix] if is_lossless or self._suffix != ".avi" else _MOTION_JPEG
        self._rate_hz = Fraction(rate_hz).limit_denominator(1001)
        self._container: OutputContainer | None = None
        self._count = 0
        self._last = -1

    def __enter__(self) -> VideoFile:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def write(self, picture: np.ndarray, time_s: float | None = None) -> None:
        """Add a picture.

        Parameters
        ----------
        picture : (H, W) grey or (H, W, 3) BGR array, uint8 or uint16
            H.264 leaves out an odd row or column at the end, and needs uint8.
        time_s : float or None, seconds
            When it is shown, after the one before; None for the next in a steady row.

        Raises
        ------
        UserError
            If it cannot be written.
        """
        with writing(self._path):
            try:
                self._write(picture, time_s)
            except FFmpegError as error:
                raise UserError(f"{self._path}: cannot be written as a video ({error.strerror})") from error

    def close(self) -> None:
        """Finish the file."""
        container, self._container = self._container, None
        if container is not None:
            with writing(self._path):
                try:
                    container.mux(self._stream.encode(None))
                finally:
                    container.close()

    def _write(self, picture: np.ndarray, time_s: float | None) -> None:
        source, wanted = self._formats(picture)
        if wanted == "yuv420p":
            height, width = (size - size % 2 for size in picture.shape[:2])
            picture = picture[:height, :width]
        if self._container is None:
            self._begin(picture.shape[1], picture.shape[0], wanted)
        frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(picture), format=source)
        frame.pts, frame.time_base = self._stamp(time_s), self._tick
        assert self._container is not None
        self._container.mux(self._stream.encode(frame))

    def _formats(self, picture: np.ndarray) -> tuple[str, str]:
        """FFmpeg's names of the picture's format and of the one that is stored."""
        is_colour, is_deep = picture.ndim == 3, picture.dtype == np.uint16
        grey, deep, colour = self._codec[2]
        if is_deep and (is_colour or deep is None):
            raise UserError(f"{self._path}: stores 8 bits; pictures of more, and grey, fit into .mkv")
        if is_deep:
            return "gray16le", str(deep)
        return ("bgr24", colour) if is_colour else ("gray", grey)

    def _begin(self, width: int, height: int, pixels: str) -> None:
        encoder, options, _ = self._codec
        container = av.open(str(self._path), "w", container_options=_CONTAINER.get(self._suffix, {}))
        self._container = container
        self._tick = 1 / self._rate_hz if self._suffix == ".avi" else _TICK
        self._stream = cast("VideoStream", container.add_stream(encoder, rate=self._rate_hz, options=options))
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, pixels
        self._stream.time_base = self._stream.codec_context.time_base = self._tick

    def _stamp(self, time_s: float | None) -> int:
        """Time stamp, later than the last one."""
        if time_s is None or self._suffix == ".avi":
            stamp = round(self._count / self._rate_hz / self._tick)
        else:
            stamp = round(time_s / self._tick)
        self._count += 1
        self._last = max(stamp, self._last + 1)
        return self._last
