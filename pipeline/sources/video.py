"""A video file as frames, in order and by index."""

from __future__ import annotations

import time
from array import array
from bisect import bisect_left
from collections.abc import Iterator
from datetime import datetime
from fractions import Fraction
from functools import partial
from pathlib import Path

import av
import numpy as np
from av.container import InputContainer
from av.error import FFmpegError
from dockpose.sources.container import WholeBoxes, breaks_off, opened
from dockpose.sources.frames import Frame, Frames, SourceError, Tell
from dockpose.sources.pixels import orientation_of, picture_of

_NEAR = 32  # frames this far ahead are reached by reading on rather than by seeking
_STEPS_BACK = (0, 8, 64)  # frames before the wanted one to seek to, until it is not overshot
_DECIMALS = 6  # of times in seconds
_BOXES = (".mp4", ".m4v", ".mov")
_FIRST_YEAR, _A_DAY_S = 2000, 86400  # an earlier clock was never set, and one far ahead is wrong
_FAILURES = 1000  # damaged packets in a row after which a file is given up


class Video(Frames):
    """Frames of a video file, identified by their time stamps.

    A frame's index is the rank of its time stamp among those of all the file's packets, which are read on opening
    without decoding (some microseconds each). So a corrupt frame leaves its index out, and a frame has the same index
    and the same time whether it was reached from the beginning or by seeking. Times are those of the file, constant
    rate or not, from its first frame on; the time of day is known as :func:`began_unix_s` says.

    Parameters
    ----------
    source : str
        Path, or address of a file on a server.
    tell : callable, optional
        Called with a sentence for corrupt frames, and on opening a video that is cut short.
    scan : bool
        Read the packets' time stamps on opening. Otherwise frames are counted, and only reached from the beginning.
    grey : bool
        Give the brightness alone as a frame's image, which saves computing colours until they are shown.

    Raises
    ------
    SourceError
        If it cannot be opened or is not a video.
    """

    def __init__(self, source: str, tell: Tell | None = None, *, scan: bool = True, grey: bool = False) -> None:
        super().__init__(source, tell)
        self._grey = grey
        container, is_broken_off = _opened(source)
        with container:
            stream = container.streams.video[0]
            self.rate_hz = float(stream.average_rate) if stream.average_rate else None
            self._time_base = Fraction(stream.time_base or 1)
            self._told = stream.frames or None
            self._stamps = _time_stamps(container, stream) if scan else None
            self._began_unix_s = began_unix_s(container.format.name, container.metadata.get("creation_time"))
        if self.rate_hz is None and self._stamps is not None and len(self._stamps) > 1:
            length = (self._stamps[-1] - self._stamps[0]) * self._time_base
            self.rate_hz = float((len(self._stamps) - 1) / length)
        self.count = self._told if self._stamps is None else len(self._stamps)
        self._kept: _Decoder | None = None
        self._tell_cut_short(is_broken_off)

    @property
    def is_counted(self) -> bool:
        """Whether ``count`` was counted; otherwise it is what the file's header says, or None."""
        return self._stamps is not None

    def __iter__(self) -> Iterator[Frame]:
        yield from self.between(0, self.count if self.is_counted and self.count is not None else 2**62)

    def between(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames with ``start`` <= index < ``stop``."""
        start = max(0, start)
        if start >= stop:
            return
        decoder = _Decoder(self.source, self._stamps)
        expected = start
        try:
            found = decoder.go_to(start)
            while found is not None and found[0] < stop:
                self._tell_missing(expected, found[0])
                yield self._frame(*found)
                expected = found[0] + 1
                if expected >= stop:
                    return
                found = decoder.advance()
        finally:
            decoder.close()
        if self._stamps is not None and not (self.is_cut_short and expected == len(self._stamps) - 1):
            self._tell_missing(expected, min(stop, len(self._stamps)))

    def at(self, index: int) -> Frame:
        """Return one frame; frames a little ahead of the last one are reached by reading on."""
        if self._kept is None:
            self._kept = _Decoder(self.source, self._stamps)
        found = self._kept.go_to(index) if index >= 0 else None
        if found is None or found[0] != index:
            raise SourceError(f"{self.source}: frame {index} of {self.count} is not there or corrupt")
        return self._frame(*found)

    def close(self) -> None:
        """Release the file."""
        if self._kept is not None:
            self._kept.close()
            self._kept = None

    def _frame(self, index: int, decoded: av.VideoFrame) -> Frame:
        image, time_s = picture_of(decoded, grey=self._grey), self._time_s(index, decoded)
        shown = partial(picture_of, decoded) if self._grey else None
        began_s = self._began_unix_s
        taken_s = None if began_s is None or time_s is None else round(began_s + time_s, _DECIMALS)
        self._tell_orientation(orientation_of(decoded), self.source)
        return self._turned(Frame(image, index, time_s, self.source, shown=shown, time_unix_s=taken_s))

    def _time_s(self, index: int, decoded: av.VideoFrame) -> float | None:
        if self._stamps is not None:
            return round(float((self._stamps[index] - self._stamps[0]) * self._time_base), _DECIMALS)
        if decoded.time is not None:
            return round(decoded.time, _DECIMALS)
        return None if self.rate_hz is None else round(index / self.rate_hz, _DECIMALS)

    def _tell_missing(self, start: int, stop: int) -> None:
        if stop > start:
            which = f"frame {start} is" if stop == start + 1 else f"frames {start} to {stop - 1} are"
            self._skip(f"{self.source}: {which} corrupt and left out", stop - start)

    def _tell_cut_short(self, is_broken_off: bool) -> None:
        if self._stamps is None:
            return
        count = str(len(self._stamps))
        if self._told is not None and len(self._stamps) < self._told:
            is_broken_off = True
            count = f"{count} of the {self._told}"
        if is_broken_off:
            self.is_cut_short = True
            there = f"{count} frames are there, the last of them perhaps in part"
            self._tell(f"{self.source}: the video is cut short: {there}")


def began_unix_s(container: str, creation_time: str | None) -> float | None:
    """Time of day of a video's first frame, in seconds since 1970-01-01 00:00 UTC; None where it is not sure.

    Files say when they were made, but seldom whether recording began or ended then: cameras and phones differ in their
    MP4 files, and programs that convert a file write the time of that, all of them in whole seconds. So only Matroska's
    date (DateUTC) is believed, and only where it has a fraction of a second, as recorders write it that are at work
    while it happens, when they begin.

    Parameters
    ----------
    container : str
        FFmpeg's name of the format.
    creation_time : str or None
        As FFmpeg gives it: "2026-11-22T04:26:03.123456Z".

    Examples
    --------
    >>> began_unix_s("matroska,webm", "1970-01-01T00:00:00.500000Z"), began_unix_s("mov,mp4", None)
    (None, None)
    >>> began_unix_s("matroska,webm", "2001-09-09T01:46:40.250000Z")
    1000000000.25
    """
    if creation_time is None or "matroska" not in container.split(","):
        return None
    try:
        began = datetime.fromisoformat(creation_time)
    except ValueError:
        return None
    is_sure = began.tzinfo is not None and began.microsecond != 0 and began.year >= _FIRST_YEAR
    return began.timestamp() if is_sure and began.timestamp() < time.time() + _A_DAY_S else None


class _Decoder:
    """Decodes on in a video from any frame; damaged frames are passed over."""

    def __init__(self, source: str, stamps: array[int] | None) -> None:
        self._source, self._stamps = source, stamps
        self._last: tuple[int, av.VideoFrame] | None = None
        self._open()

    def close(self) -> None:
        self._container.close()

    def go_to(self, index: int) -> tuple[int, av.VideoFrame] | None:
        """Index and frame of that index or of the next good one; None at the end."""
        found = self._near(index)
        while found is not None and found[0] < index:
            found = self.advance()
        return found

    def advance(self) -> tuple[int, av.VideoFrame] | None:
        """Index and frame of the next good frame; None at the end."""
        decoded = next(self._frames, None)
        if decoded is None:
            self._last = None
            return None
        self._last = (self._index_of(decoded), decoded)
        return self._last

    def _open(self) -> None:
        self._container, _ = _opened(self._source)
        self._stream = self._container.streams.video[0]
        self._stream.thread_type = "AUTO"
        self._frames = self._decoded()
        self._last = None
        self._count = 0

    def _near(self, index: int) -> tuple[int, av.VideoFrame] | None:
        """Go to that frame or somewhat before it."""
        if self._last is not None and self._last[0] == index:
            return self._last
        if self._last is not None and self._last[0] < index <= self._last[0] + _NEAR:
            return self.advance()
        if self._stamps is not None and index < len(self._stamps):
            for step in _STEPS_BACK:
                if index - step <= 0:
                    break
                self._container.seek(self._stamps[index - step], stream=self._stream)
                self._frames = self._decoded()
                found = self.advance()
                if found is not None and found[0] <= index:
                    return found
        self.close()
        self._open()
        return self.advance()

    def _decoded(self) -> Iterator[av.VideoFrame]:
        """Decoded frames from where the file is, without those that are damaged."""
        packets = self._container.demux(self._stream)
        failures = 0
        while failures < _FAILURES:
            try:
                packet = next(packets)
                frames = [] if packet.is_corrupt else packet.decode()
            except StopIteration:
                return
            except FFmpegError:
                failures += 1
                continue
            failures = 0
            for frame in frames:
                if isinstance(frame, av.VideoFrame) and not frame.is_corrupt:
                    yield frame

    def _index_of(self, decoded: av.VideoFrame) -> int:
        if self._stamps is None or decoded.pts is None:
            self._count += 1
            return self._count - 1
        return min(bisect_left(self._stamps, decoded.pts), len(self._stamps) - 1)


def _opened(source: str) -> tuple[InputContainer, bool]:
    """A file, and whether it breaks off; raises SourceError if it cannot be opened or has no video."""
    try:
        container = opened(source)
    except (FFmpegError, OSError, ValueError) as error:
        container = _opened_cut_short(source)
        if container is None:
            raise SourceError(_why_not(source)) from error
    if not container.streams.video:
        container.close()
        raise SourceError(f"{source}: has no video in it")
    return container, _is_of_boxes(source) and breaks_off(Path(source))


def _is_of_boxes(source: str) -> bool:
    return source.lower().endswith(_BOXES) and Path(source).is_file()


def _opened_cut_short(source: str) -> InputContainer | None:
    """Open an MP4 of which the end is missing; None where that does not help."""
    if not _is_of_boxes(source):
        return None
    try:
        return opened(WholeBoxes(Path(source)))
    except (FFmpegError, OSError, ValueError):
        return None


def _time_stamps(container: InputContainer, stream: av.VideoStream) -> array[int] | None:
    """Time stamps of a video's packets in display order; None where they do not identify the frames."""
    stamps = array("q")
    packets = container.demux(stream)
    while True:
        try:
            packet = next(packets)
        except (StopIteration, FFmpegError):
            break
        if packet.size == 0:  # the end
            continue
        if packet.pts is None:
            return None
        if not packet.is_discard:
            stamps.append(packet.pts)
    values = np.unique(np.frombuffer(stamps, np.int64))
    return array("q", values.tolist()) if 0 < len(values) == len(stamps) else None


def _why_not(source: str) -> str:
    path = Path(source)
    if "://" not in source:
        try:
            with path.open("rb") as file:
                if not file.read(1):
                    return f"{source}: the file is empty (0 bytes)"
        except OSError as error:
            return f"{source}: cannot be read ({error.strerror or error})"
    return (
        f"{source}: is no video that can be read: another kind of file, damaged, or an MP4 cut short before its index"
    )
