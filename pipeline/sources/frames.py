"""Frames, and what all sources of frames have in common."""

import abc
import contextlib
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import accumulate, pairwise
from typing import Any, Self, TypeVar

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.camera.image import orientation_sentence, turned
from dockpose.checks import check_turn
from dockpose.dock import Dock
from dockpose.text import InputError, public

__all__ = ["Frame", "Frames", "SourceError"]

Callback = Callable[[str], None]


class SourceError(InputError):
    """A source that yields no frames; the text names it and says why."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame of a source.

    Attributes
    ----------
    image : (H, W) grey or (H, W, 3) BGR array, uint8 or uint16
        The picture.
    index : int
        Its number in the source, from 0; the numbers of skipped or dropped frames are left out.
    time_s : float or None, seconds
        Time since the source began, by its own clock; None where it has none, such as a folder of pictures.
    name : str
        Display name: a picture's path, or the source as it was given.
    sha256 : str or None
        Checksum of the picture's file; None for a frame that is not a file of its own.
    shown : callable or None
        Returns what to show where ``image`` is the brightness alone; see :meth:`picture`.
    time_unix_s : float or None, seconds
        When it was taken, since 1970-01-01 00:00 UTC; None where the source does not know.
    monotonic_s : float or None, seconds
        Of a live source, when it was taken or else came, by ``time.monotonic()``; None of a recording.
    encoded : bytes or None
        The picture file that ``image`` was decoded from; None where there is none, or the frame is turned.
    """

    image: np.ndarray
    index: int
    time_s: float | None
    name: str
    sha256: str | None = None
    shown: Callable[[], np.ndarray] | None = None
    time_unix_s: float | None = None
    monotonic_s: float | None = None
    encoded: bytes | None = None

    def picture(self) -> np.ndarray:
        """The picture to show, in colour where the source has it; as ``image`` otherwise."""
        return self.image if self.shown is None else self.shown()


class Frames(abc.ABC):
    """A source of frames, to be iterated once from the beginning and then closed.

    Attributes
    ----------
    source : str
        The source as it was given, less a password in an address.
    is_live : bool
        Whether frames arrive in real time, without an end; otherwise it is a recording.
    count : int or None
        Number of frames, including corrupt ones; None of a live source.
    rate_hz : float or None, hertz
        Frames per second; None where it is unknown.
    skipped : int
        Corrupt frames so far.
    is_cut_short : bool
        Whether a recording has fewer frames than its own header says.
    dropped : int
        Frames of a live source so far that arrived faster than they were taken.
    camera : Camera or None
        The camera of a simulated course, or that a bag describes; None for other sources.
    camera_notes : list of str
        Where ``camera`` is from, and what was taken for granted; or why none of a bag's cameras is used.
    dock : Dock or None
        The dock of a simulated course; None for other sources.
    """

    is_live: bool = False
    count: int | None = None
    rate_hz: float | None = None
    dropped: int = 0
    camera: Camera | None = None
    dock: Dock | None = None

    def __init__(self, source: str, tell: Callback | None = None) -> None:
        self.source, self._address = public(source), source  # what people see, and what is opened
        self.camera_notes: list[str] = []
        self.skipped = 0
        self.is_cut_short = False
        self._tell: Callback = tell or (lambda text: None)
        self._turn_deg, self._told_tags = 0, set[int]()
        self._told_size = (0, 0)  # of frames of another size than the camera's
        self._open = contextlib.ExitStack()  # what :meth:`close` releases

    @abc.abstractmethod
    def __iter__(self) -> Iterator[Frame]:
        """Yield one frame after another; corrupt ones are skipped, counted and reported."""

    def between(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames with ``start`` <= index < ``stop`` in order; SourceError where the source is live."""
        raise SourceError(f"{self.source}: is live, so there is no frame {start} to go to")

    def at(self, index: int) -> Frame:
        """Return the frame with that index; SourceError where it is missing, corrupt, or of a live source."""
        for frame in self.between(index, index + 1):
            return frame
        known = "" if self.count is None else f" of {self.count}"
        raise SourceError(f"{self.source}: frame {index}{known} is not there or corrupt")

    def fitting(self, frames: Iterable[Frame], camera: Camera) -> Iterator[Frame]:
        """Pass on those of its frames for which a camera can be; others are skipped, and named where they begin."""
        for frame in frames:
            height, width = frame.image.shape[:2]
            try:
                camera.for_size(width, height)
            except ValueError:
                if self.is_live and frame.index == 0:  # the camera is that of another source
                    raise
                text = f"frame {frame.index} has {width} x {height} pixels, but the camera is for {camera.width} x"
                told = self._told_size == (width, height)
                self._skip("" if told else f"{self.source}: {text} {camera.height}; such frames are left out")
                self._told_size = (width, height)
            else:
                yield frame

    def turn(self, degrees: int) -> None:
        """Turn all frames, and the source's own camera with them, clockwise by 0, 90, 180 or 270 degrees, once."""
        self._turn_deg = check_turn("degrees", degrees)
        self.camera = None if self.camera is None else self.camera.rotated(degrees)

    def close(self) -> None:
        """Release files, cameras and threads."""
        self._open.close()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *error: object) -> None:
        self.close()

    def _turned(self, frame: Frame) -> Frame:
        """The frame as it is given out."""
        if not self._turn_deg:
            return frame
        shown, degrees = frame.shown, self._turn_deg
        turned_shown = None if shown is None else lambda: turned(shown(), degrees)
        return replace(frame, image=turned(frame.image, degrees), shown=turned_shown, encoded=None)

    def _tell_orientation(self, tag: int, name: str) -> None:
        """Name a tag of orientation where it is the first of its kind in this source."""
        if tag != 1 and tag not in self._told_tags and (sentence := orientation_sentence(tag, name)):
            self._tell(sentence)
        self._told_tags.add(tag)

    def _skip(self, text: str, frames: int = 1) -> None:
        self.skipped += frames
        if text:
            self._tell(text)


class Indexed(Frames):
    """A recording of which each frame is read by its number; ``count`` is known."""

    def __iter__(self) -> Iterator[Frame]:
        return self.between(0, self.count or 0)

    def between(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames with ``start`` <= index < ``stop``; those that cannot be read are skipped."""
        for index in range(max(0, start), min(stop, self.count or 0)):
            try:
                yield self._turned(self._frame(index))
            except ValueError as error:
                self._skip(str(error))

    @abc.abstractmethod
    def _frame(self, index: int) -> Frame:
        """Read a frame. Raises ValueError, whose text names the source, where that cannot be done."""


def growing(stamps: Sequence[int]) -> tuple[list[int], list[int]]:
    """Times since the first of N time stamps, each larger than the last, in their unit; and where the stamps run back.

    There the clock was set back, or another recording was joined: time goes on by the usual interval. Frames with one
    and the same stamp are spread evenly until the next.

    Examples
    --------
    >>> growing([70, 80, 90, 20, 30, 30, 40])
    ([0, 10, 20, 30, 40, 45, 50], [3])
    """
    steps = [after - before for before, after in pairwise(stamps)]
    usual = int(np.median([abs(step) for step in steps if step] or [len(stamps)]))
    times = list(accumulate((usual if step < 0 else step for step in steps), initial=0))
    new = [0, *(index for index, step in enumerate(steps, 1) if step)]
    known = [times[index] for index in new]
    spread = np.interp(np.arange(len(times)), [*new, len(times)], [*known, known[-1] + usual])
    spread = np.clip(spread, 0, 2.0**62)  # damaged stamps lead beyond 64 bits
    return np.rint(spread).astype(np.int64).tolist(), [index for index, step in enumerate(steps, 1) if step < 0]


Item = TypeVar("Item")
_AHEAD = 4  # items
_END: Any = object()  # stands for their end


def read_ahead(items: Iterable[Item]) -> Iterator[Item]:
    """Yield the items in order, fetched by a thread that is a few ahead; its errors come in turn."""
    source: Iterator[Any] = iter(items)
    pool = ThreadPoolExecutor(1, "dockpose reading ahead")
    try:
        waiting = deque(pool.submit(next, source, _END) for _ in range(_AHEAD))
        while (item := waiting.popleft().result()) is not _END:
            waiting.append(pool.submit(next, source, _END))
            yield item
    finally:
        pool.shutdown(cancel_futures=True)
