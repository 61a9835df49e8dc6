"""Estimates of frames by several processes, the same as by one."""
# Chunks start at frames that are searched, so they are independent. They are done before the automatic masks of earlier
# chunks are known; where these change the settings, the rest is done again.

import contextlib
import functools
import logging
import math
import multiprocessing
import os
import signal
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor, Future, ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from pathlib import Path

from dockpose import Camera, Dock, Estimate, Settings
from dockpose.app.inputs.pictures import PictureFile
from dockpose.app.inputs.sequences import FrameSource
from dockpose.app.processing.masks import AutoMasks
from dockpose.sources import Frame, Frames
from dockpose.tracking.search import BLOCK, Search

_LARGEST_CHUNK = 3 * BLOCK  # frames; a decoder starts at a key frame, often one in 250
_CHUNKS_EACH = 4  # for each worker at least, so that none waits long for the last
_AHEAD = 2  # submitted chunks for each worker
_MOST_ON_WINDOWS = 61  # processes, for which Python can wait there


@dataclass(frozen=True)
class Found:
    """The result of a frame; without an estimate ``message`` says why, ``skipped`` of how many frames."""

    label: str  # in messages
    index: int
    time_s: float | None
    name: str
    sha256: str | None
    estimate: Estimate | None
    message: str = ""
    skipped: int = 0
    time_unix_s: float | None = None
    tag: int = 1  # of a picture's orientation


@dataclass(frozen=True)
class SequenceWork:
    """The frames of one recording, which each worker opens by its path in ``folder``; ``camera`` is turned."""

    source: FrameSource
    camera: Camera
    dock: Dock
    count: int  # of frames
    folder: str = field(default_factory=os.getcwd)

    def chunk(self, start: int, stop: int) -> Callable[[Settings], list[Found]]:
        """Return what estimates frames ``start`` to ``stop`` (excluded) in order."""
        return functools.partial(_estimate_frames, self, start, stop)


@dataclass(frozen=True)
class PictureWork:
    """Unrelated pictures, each with its camera and dock."""

    files: tuple[PictureFile, ...]
    folder: str = field(default_factory=os.getcwd)

    @property
    def count(self) -> int:
        """Number of pictures."""
        return len(self.files)

    def chunk(self, start: int, stop: int) -> Callable[[Settings], list[Found]]:
        """Return what estimates pictures ``start`` to ``stop`` (excluded) in order."""
        return functools.partial(_estimate_pictures, self.files[start:stop], self.folder, start)


def found_in(frame: Frame, name: str, found: Estimate) -> Found:
    """What was found in a frame of a sequence of that name."""
    label, taken_s = f"{name} frame {frame.index}", frame.time_unix_s
    return Found(label, frame.index, frame.time_s, name, frame.sha256, found, time_unix_s=taken_s)


def _estimate_frames(work: SequenceWork, start: int, stop: int, settings: Settings) -> list[Found]:
    source, (frames, messages) = work.source, _opened(work)
    messages.clear()
    search = Search(work.camera, work.dock)
    done: list[Found] = []
    skipped = frames.skipped

    def pass_on(index: int) -> None:
        nonlocal skipped
        for text in messages:
            text = _as_typed(text, [source.source, *map(str, source.paths[start:stop])], work.folder)
            done.append(Found(source.source, index, None, source.source, None, None, text, frames.skipped - skipped))
            skipped = frames.skipped
        messages.clear()

    for frame in frames.fitting(frames.between(start, stop), work.camera):
        pass_on(frame.index)
        name = str(source.paths[frame.index]) if source.paths else source.source
        found = search.see(frame.image, frame.index, frame.time_s, settings)
        done.append(found_in(frame, name, found))
    pass_on(stop - 1)
    return done


def _estimate_pictures(files: tuple[PictureFile, ...], folder: str, start: int, settings: Settings) -> list[Found]:
    done = []
    for index, file in enumerate(files, start):
        name = str(file.path)
        try:
            picture = replace(file, path=Path(folder) / file.path).read()
            found = picture.estimate(settings)
        except ValueError as error:
            text = _as_typed(str(error), [name], folder)
            done.append(Found(name, index, None, name, None, None, text if name in text else f"{name}: {text}", 1))
        else:
            taken = {"time_unix_s": picture.time_unix_s, "tag": picture.tag}
            done.append(Found(name, index, None, name, picture.sha256, found, **taken))
    return done


def _as_typed(text: str, names: Sequence[str], folder: str) -> str:
    """The text with file names as they were typed."""
    for name in names:
        text = text.replace(str(Path(folder) / name), name)
    return text


@contextlib.contextmanager
def workers(jobs: int) -> Iterator[tuple[Executor, int]]:
    """Yield an executor of ``jobs`` processes, and how many these are."""
    jobs = min(jobs, _MOST_ON_WINDOWS) if sys.platform == "win32" else jobs
    context = multiprocessing.get_context("spawn")  # a fork would copy locks that other threads hold
    pool = ProcessPoolExecutor(jobs, mp_context=context, initializer=_leave_interrupts)
    try:
        yield pool, jobs
    except BaseException:  # nobody waits for what they are at, which may take minutes
        # Or the pool would wait for the rest of a result that is cut off.
        pool._result_queue._writer.close()  # pyright: ignore[reportAttributeAccessIssue]
        for process in list(pool._processes.values()):
            process.terminate()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)


def split(
    work: SequenceWork | PictureWork, executor: Executor, count: int, auto_masks: AutoMasks, settings: Settings
) -> Iterator[Found]:
    """Yield the results in order, of ``count`` chunks at once; ``auto_masks`` learns and changes the settings."""
    size = min(_LARGEST_CHUNK, BLOCK * math.ceil(work.count / (_CHUNKS_EACH * count * BLOCK)))
    waiting: deque[Future[list[Found]]] = deque()
    start = 0
    try:
        while start < work.count or waiting:
            while start < work.count and len(waiting) < _AHEAD * count:
                stop = min(work.count, start - start % BLOCK + size)
                waiting.append(executor.submit(work.chunk(start, stop), settings))
                start = stop
            for one in waiting.popleft().result():
                if (found := one.estimate) is not None:
                    wanted = auto_masks.settings_for((found.height, found.width), found.camera, found.dock)
                    if found.settings != wanted:
                        _cancel(waiting)
                        settings, start = wanted, one.index
                        break
                    auto_masks.see(found, one.label)
                yield one
    finally:
        _cancel(waiting)


def _cancel(waiting: deque[Future[list[Found]]]) -> None:
    for future in waiting:
        future.cancel()
    waiting.clear()


@functools.lru_cache(maxsize=1)
def _opened(work: SequenceWork) -> tuple[Frames, list[str]]:
    """A source that stays open in a worker from chunk to chunk, and the list of its messages."""
    messages: list[str] = []
    folder, source = Path(work.folder), work.source
    if source.paths:
        source = replace(source, paths=tuple(folder / path for path in source.paths))
    else:
        source = replace(source, source=str(folder / source.source))
    return source.open(messages.append, grey=True), messages


def _leave_interrupts() -> None:
    """Leave Ctrl-C, and what packages cannot be loaded, to the program that hands out the work, and end with it."""
    logging.getLogger("dockpose").addHandler(logging.NullHandler())
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    if (parent := multiprocessing.parent_process()) is not None:
        threading.Thread(target=lambda: (parent.join(), os._exit(1)), daemon=True).start()
