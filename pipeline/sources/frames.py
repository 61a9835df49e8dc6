"""A frame, and what all sources of frames have in common."""

from __future__ import annotations

import abc
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from types import TracebackType
from typing import TypeVar

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock

Tell = Callable[[str], None]
Source = TypeVar("Source", bound="Frames")


class SourceError(ValueError):
    """A source that gives no frames; the text names it and says why."""


@dataclass(frozen=True, eq=False)
class Frame:
    """One picture of a source.

    Attributes
    ----------
    image : (H, W) grey or (H, W, 3) BGR array of uint8 or uint16.
    index : its number in the source, from 0. A frame that was skipped or dropped leaves its number out.
    time_s : since the source began, by its own clock; None where it has none, as a folder of pictures.
    name : what to call it: a picture's path, or the source as it was named.
    sha256 : of a picture's file; None for what is no file of its own.
    """

    image: np.ndarray
    index: int
    time_s: float | None
    name: str
    sha256: str | None = None


class Frames(abc.ABC):
    """A source of frames, to be iterated once from its beginning and closed.

    Attributes
    ----------
    source : as it was named.
    is_live : whether frames come when they come, without an end; else it is a recording, which ends.
    count : number of frames, the bad ones included; None where it is not known.
    rate_hz : frames in a second; None where it is not known.
    skipped : corrupt frames so far.
    is_cut_short : whether a recording ends before its own header says.
    dropped : frames of a live source so far that came faster than they were taken.
    camera, dock : what a simulated course is seen with and shows; None for all other sources.
    """

    is_live: bool = False
    count: int | None = None
    rate_hz: float | None = None
    dropped: int = 0
    camera: Camera | None = None
    dock: Dock | None = None

    def __init__(self, source: str, tell: Tell | None = None) -> None:
        self.source = source
        self.skipped = 0
        self.is_cut_short = False
        self._tell: Tell = tell or (lambda text: None)

    @abc.abstractmethod
    def __iter__(self) -> Iterator[Frame]:
        """Yield frame after frame; those that are corrupt are skipped, counted and told."""

    def between(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames of a recording whose index is at least ``start`` and below ``stop``.

        They are the same as those that iteration yields.
        """
        raise SourceError(f"{self.source}: is live; it has no frame {start} to go to")

    def at(self, index: int) -> Frame:
        """Return the frame of a recording by its index, in any order.

        Raises
        ------
        SourceError
            if there is no such frame, it is corrupt, or the source is live.
        """
        for frame in self.between(index, index + 1):
            return frame
        known = "" if self.count is None else f" of {self.count}"
        raise SourceError(f"{self.source}: frame {index}{known} is not there or corrupt")

    def close(self) -> None:  # noqa: B027  # most have nothing to let go of
        """Let go of files, cameras and threads."""

    def __enter__(self: Source) -> Source:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self.close()

    def _skip(self, text: str, frames: int = 1) -> None:
        self.skipped += frames
        self._tell(text)
