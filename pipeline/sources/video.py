"""A video file as frames, in order and by index."""

from __future__ import annotations

import math
from array import array
from bisect import bisect_left
from collections.abc import Iterator
from pathlib import Path

import cv2
import numpy as np
from dockpose.sources.capture import open_file, stamp_of
from dockpose.sources.frames import Frame, Frames, SourceError, Tell

_NO_STAMP = -(2**63)  # FFmpeg's AV_NOPTS_VALUE
_NEAR = 32  # frames this far ahead are reached by reading on rather than by seeking
_STEPS_BACK = (0, 8, 64)  # frames before the wanted one to seek to, until it is not overshot
_TRIES = 8  # at the end of a video whose frames cannot be counted
# Containers whose header counts the frames; others give a duration, from which the count is only a guess.
_COUNTED = (".mp4", ".m4v", ".mov", ".avi")


class Video(Frames):
    """Frames of a video file, identified by their time stamps.

    A frame's index is the rank of its time stamp among those of all the file's packets, which are read on opening
    without decoding (some microseconds each). So a corrupt frame leaves its index out, and a frame has the same index
    whether it was reached from the beginning or by seeking, which alone is not exact in OpenCV.

    Parameters
    ----------
    source : str
        Path, or address of a file on a server.
    tell : callable, optional
        Called with a sentence for corrupt frames, and on opening a video that is cut short.
    scan : bool
        Read the packets' time stamps on opening. Otherwise frames are counted, and only reached from the beginning.

    Raises
    ------
    SourceError
        If it cannot be opened or is not a video.
    """

    def __init__(self, source: str, tell: Tell | None = None, *, scan: bool = True) -> None:
        super().__init__(source, tell)
        capture = open_file(source)
        if not capture.isOpened():
            raise SourceError(_why_not(source))
        rate_hz, told = capture.get(cv2.CAP_PROP_FPS), capture.get(cv2.CAP_PROP_FRAME_COUNT)
        self.rate_hz = rate_hz if math.isfinite(rate_hz) and rate_hz > 0 else None
        self._told = int(told) if 0 < told < 1e9 else None
        self._stamps = _time_stamps(capture) if scan else None
        capture.release()
        self.count = self._told if self._stamps is None else len(self._stamps)
        self._kept: _Reader | None = None
        self._tell_cut_short()

    @property
    def is_counted(self) -> bool:
        """Whether ``count`` was counted; otherwise it is what the file's header says, or None."""
        return self._stamps is not None

    def __iter__(self) -> Iterator[Frame]:
        yield from self.between(0, self.count if self.is_counted and self.count is not None else 2**62)

    def between(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames with ``start`` <= index < ``stop``."""
        reader = _Reader(self.source, self._stamps, self.rate_hz)
        try:
            yield from self._read(reader, max(0, start), stop)
        finally:
            reader.close()

    def at(self, index: int) -> Frame:
        """Return one frame; frames a little ahead of the last one are reached by reading on."""
        if self._kept is None:
            self._kept = _Reader(self.source, self._stamps, self.rate_hz)
        frame = self._kept.frame_at(index) if index >= 0 else None
        if frame is None:
            raise SourceError(f"{self.source}: frame {index} of {self.count} is not there or corrupt")
        return frame

    def close(self) -> None:
        """Release the file."""
        if self._kept is not None:
            self._kept.close()
            self._kept = None

    def _read(self, reader: _Reader, start: int, stop: int) -> Iterator[Frame]:
        expected = start
        if start >= stop:
            return
        index = reader.go_to(start)
        while index is not None and index < stop:
            frame = reader.frame()
            if frame is not None:
                self._tell_missing(expected, index)
                yield frame
                expected = index + 1
            if expected >= stop:
                return
            index = reader.advance()
        if self._stamps is not None and not (self.is_cut_short and expected == len(self._stamps) - 1):
            self._tell_missing(expected, min(stop, len(self._stamps)))

    def _tell_missing(self, start: int, stop: int) -> None:
        if stop > start:
            which = f"frame {start} is" if stop == start + 1 else f"frames {start} to {stop - 1} are"
            self._skip(f"{self.source}: {which} corrupt and left out", stop - start)

    def _tell_cut_short(self) -> None:
        if self._stamps is None or self._told is None or Path(self.source).suffix.lower() not in _COUNTED:
            return
        if len(self._stamps) < self._told:
            self.is_cut_short = True
            there = f"{len(self._stamps)} of the {self._told} frames are there, the last of them perhaps in part"
            self._tell(f"{self.source}: the video is cut short: {there}")


class _Reader:
    """Reads on in a video from any frame."""

    def __init__(self, source: str, stamps: array[int] | None, rate_hz: float | None) -> None:
        self._source, self._stamps, self._rate_hz = source, stamps, rate_hz
        self._capture = open_file(source)
        self._index = -1  # of the last frame that was grabbed

    def close(self) -> None:
        self._capture.release()

    def frame_at(self, index: int) -> Frame | None:
        return self.frame() if self.go_to(index) == index else None

    def go_to(self, index: int) -> int | None:
        """Grab the frame of that index; return its index, or that of the next good one, or None at the end."""
        reached = self._near(index)
        while reached is not None and reached < index:
            reached = self.advance()
        return reached

    def advance(self) -> int | None:
        """Grab the next good frame and return its index; None at the end."""
        tries = _TRIES if self._stamps is None else len(self._stamps) - self._index
        for _ in range(tries):
            if self._stamps is not None and self._index >= len(self._stamps) - 1:
                return None
            if self._capture.grab():
                self._index = self._index_of(stamp_of(self._capture))
                return self._index
        return None

    def frame(self) -> Frame | None:
        """Decode the last grabbed frame; None if that fails."""
        good, image = self._capture.retrieve()
        return Frame(image, self._index, self._time_s(), self._source) if good else None

    def _near(self, index: int) -> int | None:
        """Go to that frame or somewhat before it; return where."""
        if self._index == index:
            return index
        if self._index < index <= self._index + _NEAR:
            return self.advance()
        if self._stamps is not None:
            for step in _STEPS_BACK:
                if index - step <= 0:
                    break
                self._capture.set(cv2.CAP_PROP_POS_FRAMES, index - step)
                self._index = -1
                reached = self.advance()
                if reached is not None and reached <= index:
                    return reached
        self._capture.release()
        self._capture = open_file(self._source)
        self._index = -1
        return self.advance()

    def _index_of(self, stamp: int) -> int:
        if self._stamps is None:
            return self._index + 1
        return min(bisect_left(self._stamps, stamp), len(self._stamps) - 1)

    def _time_s(self) -> float | None:
        if self._stamps is not None:
            return round(self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000, 6)
        return None if self._rate_hz is None else round(self._index / self._rate_hz, 6)


def _time_stamps(capture: cv2.VideoCapture) -> array[int] | None:
    """Time stamps of a video's packets in display order; None where they do not identify the frames."""
    capture.set(cv2.CAP_PROP_FORMAT, -1)  # packets as they are
    stamps = array("q")
    while capture.grab():
        stamp = stamp_of(capture)
        if stamp == _NO_STAMP:
            return None
        stamps.append(stamp)
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
