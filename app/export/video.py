"""Videos that we write: H.264 that browsers play, or FFV1 that keeps every grey level, at the times of the frames."""

import contextlib
import os
from collections.abc import Mapping
from datetime import UTC, datetime
from fractions import Fraction
from pathlib import Path
from typing import cast

import av
import numpy as np
from av import VideoStream
from av.container import OutputContainer
from av.error import FFmpegError
from dockpose.app.errors import UserError, check_folder, unwritable, writing
from dockpose.files import GrowingFile, remove

# Encoder, its options, and the formats of grey, deep grey and colour pictures.
_Codec = tuple[str, dict[str, str], tuple[str, str | None, str]]
# Each frame by itself, and in slices that several threads write and read.
_FFV1: _Codec = ("ffv1", {"level": "3", "g": "1", "slices": "4"}, ("gray", "gray16le", "bgr0"))
# Without frames that are held back, which a kill would lose.
_H264: _Codec = (
    "libx264",
    {"crf": "18", "preset": "veryfast", "bf": "0", "tune": "zerolatency"},
    ("yuv420p", None, "yuv420p"),
)
# By the ending of the file's name.
_CODECS: dict[str, _Codec] = {".mp4": _H264, ".mkv": _FFV1}
_TICK = Fraction(1, 1_000_000)
# Each frame is a fragment, written once the next one comes, so that the file can be read even where writing was cut
# short; it becomes a plain MP4 at the end.
_MP4 = {"movflags": "hybrid_fragmented+frag_every_frame", "flush_packets": "1"}
# Each frame is written at once. The header is changed behind the muxer's back, so that it must not have a checksum.
_MATROSKA = {"flush_packets": "1", "write_crc32": "0"}
MILLISECOND = Fraction(1, 1000)
_SCALE = b"\x2a\xd7\xb1\x83"  # the header's TimestampScale, three bytes long: nanoseconds of a tick
_MILLISECONDS, _MICROSECONDS = _SCALE + b"\x0f\x42\x40", _SCALE + b"\x00\x03\xe8"


def is_video_file(path: Path) -> bool:
    """Whether a name ends as a video that can be written."""
    return path.suffix.lower() in _CODECS


class MuxedFile(GrowingFile):
    """A file that FFmpeg writes into, and that keeps the error where it cannot: FFmpeg itself may not tell of it."""

    error: OSError | None = None

    def write(self, data: bytes) -> int:
        """Write at once, for a crash to leave what there was."""
        try:
            if self.error is None:
                super().write(data)
        except OSError as error:
            self.error = error
        return len(data)

    def check(self) -> None:
        """Note that all is whole so far. Raises OSError if something could not be written."""
        if self.error is not None:
            raise self.error
        self.mark()

    def cut(self) -> str:
        """Close a file that could not be written, leave what is whole of it, and say what that is."""
        super().cut()
        pictures = _count(self.path) if self.path.is_file() else 0
        if pictures:
            return f"; what was written before is kept (pictures: {pictures})"
        if self.path.is_file():
            remove(self.path)
        return "; nothing of it is kept"

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Go to a place."""
        return self._file.seek(offset, whence)

    def close(self) -> None:
        """Close the file. Raises OSError if something could not be written."""
        super().close()
        if self.error is not None:
            raise self.error


class MicrosecondMatroska(MuxedFile):
    """A Matroska file with a clock of microseconds."""

    # The header says how long a tick is (TimestampScale, RFC 9559, 5.1.2.9), but FFmpeg's muxer knows milliseconds
    # only. So it is given microseconds as if they were milliseconds, and what it writes of it is put right.

    def __init__(self, path: Path) -> None:
        super().__init__(path)
        self._scale_at: int | None = None

    def write(self, data: bytes) -> int:
        """Write at once, with the header put right."""
        data = bytes(data)
        if self._scale_at is None and (found := data.find(_MILLISECONDS)) >= 0:
            self._scale_at = self.tell() + found
            data = data.replace(_MILLISECONDS, _MICROSECONDS, 1)
        return super().write(data)

    def close(self) -> None:
        """Finish the file; the muxer has written its header once more by now."""
        if self._scale_at is not None:
            self.seek(self._scale_at)
            super().write(_MICROSECONDS)
        super().close()


def _count(path: Path) -> int:
    """How many pictures can be read of a video that was cut short."""
    try:
        with av.open(str(path)) as container:
            return sum(packet.size > 0 for packet in container.demux(video=0))
    except FFmpegError:
        return 0


def create_matroska(path: Path) -> tuple[OutputContainer, MicrosecondMatroska]:
    """Begin a Matroska file, whose ticks are microseconds called milliseconds; both must be closed, in that order."""
    file = MicrosecondMatroska(path)
    container = av.open(file, "w", format="matroska", container_options=_MATROSKA)
    return container, file


def creation_time(unix_s: float) -> str:
    """A time of day, in seconds since 1970-01-01 00:00 UTC, as FFmpeg takes it: "2026-11-22T04:26:03.123456Z"."""
    return datetime.fromtimestamp(unix_s, UTC).isoformat(timespec="microseconds").replace("+00:00", "Z")


class VideoFile(contextlib.AbstractContextManager["VideoFile"]):
    """A video made from pictures of one size, begun with the first; as a context manager it finishes itself."""

    def __init__(self, path: Path, rate_hz: float, *, metadata: Mapping[str, str] | None = None) -> None:
        if not path.parent.is_dir():
            raise UserError(f"{path}: cannot be written ({path.parent}: there is no such folder)")
        check_folder(path.parent, str(path))
        self._path, self._suffix = path, path.suffix.lower()
        self._codec = _CODECS[self._suffix]
        self._rate_hz = Fraction(rate_hz).limit_denominator(1001)
        self._metadata = metadata or {}
        self._container: OutputContainer | None = None
        self._file: MuxedFile | None = None
        self._count = 0
        self._last = -1

    def __exit__(self, *_: object) -> None:
        self.close()

    def write(self, picture: np.ndarray, time_s: float | None = None) -> None:
        """Add a picture. ``picture`` (H, W)."""
        with writing(self._path):
            try:
                self._write(picture, time_s)
            except FFmpegError as error:
                self._give_up()
                raise UserError(f"{self._path}: cannot be written as a video ({error.strerror})") from error
            self._give_up()
            if self._file is not None:
                self._file.check()

    def close(self) -> None:
        """Finish the file."""
        container, self._container = self._container, None
        if container is None:
            return
        try:
            assert self._file is not None
            with writing(self._path), contextlib.ExitStack() as files:  # closed the other way round, whatever fails
                files.callback(self._file.close)
                files.callback(container.close)
                container.mux(self._stream.encode(None))
        except UserError:
            self._give_up()
            raise

    def _give_up(self) -> None:
        """Raise UserError where the file could not be written; what is whole of it stays."""
        file, container = self._file, self._container
        if file is None or file.error is None:
            return
        self._container = None
        if container is not None:
            with contextlib.suppress(OSError):
                container.close()
        raise unwritable(self._path, file.error, kept=file.cut()) from file.error

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
        if self._suffix == ".mkv":
            container, self._file = create_matroska(self._path)
        else:
            self._file = MuxedFile(self._path)
            container = av.open(self._file, "w", format="mp4", container_options=_MP4)
        container.metadata.update(self._metadata)
        self._container = container
        self._tick = MILLISECOND if self._suffix == ".mkv" else _TICK
        self._stream = cast("VideoStream", container.add_stream(encoder, rate=self._rate_hz, options=options))
        self._stream.width, self._stream.height, self._stream.pix_fmt = width, height, pixels
        if self._codec is _FFV1:  # one core is left for looking at the frames meanwhile
            self._stream.codec_context.thread_count = max(1, (os.cpu_count() or 2) - 1)
        self._stream.time_base = self._stream.codec_context.time_base = self._tick

    def _stamp(self, time_s: float | None) -> int:
        """Time stamp, later than the last one."""
        stamp = round((self._count / self._rate_hz if time_s is None else time_s) / _TICK)
        self._count += 1
        self._last = max(stamp, self._last + 1)
        return self._last
