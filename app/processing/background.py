"""Work in threads of its own: the newest job alone, longer work with progress and cancelling, playing a sequence."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Generic, TypeVar

from dockpose.sources import Frame, Frames
from dockpose.sources.frames import read_ahead

Item = TypeVar("Item")
Job = TypeVar("Job")
_RATE_HZ = 10.0  # of frames that have no times
_LATE_S = 0.25  # the most that is made up for after a slow frame


class CancelledError(Exception):
    """Somebody asked for the work to stop."""


class Progress:
    """Reports how far a piece of work is, and tells it when to stop."""

    def __init__(self, tell: Callable[[float], None]) -> None:
        self._tell = tell
        self._stop = threading.Event()

    def stop(self) -> None:
        """Make the next step of the work its last."""
        self._stop.set()

    def over(self, items: Sequence[Item]) -> Iterator[Item]:
        """Yield the items, reporting the share done, 0 to 1. Raises CancelledError once asked to stop."""
        for number, item in enumerate(items):
            if self._stop.is_set():
                raise CancelledError
            self._tell(number / len(items))
            yield item
        self._tell(1.0)


class LatestWorker(Generic[Job]):
    """Does the newest job in its own thread, dropping those that waited before it, as of a slider that is dragged."""

    def __init__(
        self,
        work: Callable[[Job], None],
        on_error: Callable[[Exception], None],
        pauses_s: Callable[[], tuple[float, float]] = lambda: (0.0, 0.0),  # after each job, and since the newest came
    ) -> None:
        self._work, self._on_error, self._pauses_s = work, on_error, pauses_s
        self._rested_at_s = time.monotonic()
        self._changed = threading.Condition()
        self._waiting: list[Job] = []
        self._is_busy = False
        self._is_closed = False
        self._thread = threading.Thread(target=self._run, name="dockpose worker", daemon=True)
        self._thread.start()

    def submit(self, job: Job) -> None:
        """Work on this job next, replacing any that waits."""
        with self._changed:
            self._waiting = [job]
            self._rested_at_s = max(self._rested_at_s, time.monotonic() + self._pauses_s()[1])
            self._changed.notify_all()

    def wait_until_idle(self, timeout_s: float) -> bool:
        """Wait until no job runs or waits; False if that takes longer."""
        with self._changed:
            return self._changed.wait_for(lambda: not self._waiting and not self._is_busy, timeout_s)

    def close(self, timeout_s: float = 5.0) -> None:
        """Finish the running job, drop the waiting one and end the thread."""
        with self._changed:
            self._is_closed = True
            self._waiting = []
            self._changed.notify_all()
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout_s)

    def _run(self) -> None:
        while True:
            with self._changed:
                while not (self._waiting or self._is_closed):
                    self._changed.wait()
                while not self._is_closed and (rest_s := self._rested_at_s - time.monotonic()) > 0:
                    self._changed.wait(rest_s)
                if self._is_closed:
                    return
                job = self._waiting.pop()
                self._is_busy = True
            try:
                self._work(job)
            except Exception as error:  # whatever one picture brings, the next must still be worked on
                self._on_error(error)
            finally:
                with self._changed:
                    self._is_busy = False
                    self._rested_at_s = time.monotonic() + self._pauses_s()[0]
                    self._changed.notify_all()


class FramePlayer:
    """Plays frames: each of a recording, at its rate times the speed, or any of them; of a live source the newest."""

    # In its thread ``show`` is called with each frame, and the next one waits until it returns; ``on_end`` at the end
    # of a recording; ``on_error`` with what ended playing early. The frames are closed with the player.

    def __init__(
        self,
        frames: Frames,
        show: Callable[[Frame], None],
        on_end: Callable[[], None],
        on_error: Callable[[Exception], None],
    ) -> None:
        self.frames = frames
        self._show, self._on_end, self._on_error = show, on_end, on_error
        self._changed = threading.Condition()
        self.is_playing = frames.is_live  # whether frames follow each other by themselves
        self.index = -1  # of the frame that was shown last
        self._speed, self._is_closed = 1.0, False
        self._wanted: int | None = 0
        work = self._run_live if frames.is_live else self._run_recording
        self._thread = threading.Thread(target=self._run, args=(work,), name="dockpose player", daemon=True)
        self._thread.start()

    def play(self, is_playing: bool = True) -> None:
        """Go on, or pause; from the end it goes on from the beginning."""
        with self._changed:
            if is_playing and self.frames.count is not None and self.index >= self.frames.count - 1:
                self._wanted = 0
            self.is_playing = is_playing
            self._changed.notify_all()

    def go_to(self, index: int) -> None:
        """Show a frame of a recording; what was asked for last is shown."""
        with self._changed:
            last = index if self.frames.count is None else self.frames.count - 1
            self._wanted = max(0, min(index, last))
            self._changed.notify_all()

    def set_speed(self, speed: float) -> None:
        """Play so many times as fast as the frames were taken."""
        with self._changed:
            self._speed = speed
            self._changed.notify_all()

    def close(self, timeout_s: float = 5.0) -> None:
        """End the thread and let go of the source."""
        with self._changed:
            self._is_closed = True
            self._changed.notify_all()
        if self.frames.is_live:
            self.frames.close()  # its thread may be waiting for the next frame
        if threading.current_thread() is not self._thread:
            self._thread.join(timeout_s)
        self.frames.close()

    def _run(self, work: Callable[[], None]) -> None:
        try:
            work()
        except Exception as error:  # whatever a source brings, people should read of it on the page
            self.is_playing = False
            if not self._is_closed:
                self._on_error(error)

    def _run_live(self) -> None:
        for frame in self.frames:
            if self._is_closed:
                return
            if self.is_playing:
                self._shown(frame)

    def _run_recording(self) -> None:
        ahead, following, is_read_ahead = None, 0, False
        due_s = time.monotonic()
        while True:
            wanted = self._next_wish()
            if self._is_closed:
                return
            if ahead is None or (wanted is not None and wanted != following):
                following = following if wanted is None else wanted
                ahead = self.frames.between(following, 2**31 if self.frames.count is None else self.frames.count)
                is_read_ahead = False
            if wanted is None and not is_read_ahead:  # not for a frame that is only looked at
                ahead, is_read_ahead = read_ahead(ahead), True
            frame = next(ahead, None)
            if frame is None:
                ahead, self.is_playing = None, False
                self._on_end()
                continue
            following = frame.index + 1
            if wanted is None:
                due_s = max(due_s + self._period_s(), time.monotonic() - _LATE_S)
                if not self._waited_until(due_s):
                    ahead, following = None, frame.index  # it is shown when its turn comes
                    continue
            else:
                due_s = time.monotonic()
            self._shown(frame)

    def _next_wish(self) -> int | None:
        """Wait until there is something to show; the frame that was asked for, None for the next one."""
        with self._changed:
            self._changed.wait_for(lambda: self._is_closed or self.is_playing or self._wanted is not None)
            wanted, self._wanted = self._wanted, None
            return wanted

    def _period_s(self) -> float:
        return 1 / ((self.frames.rate_hz or _RATE_HZ) * self._speed)

    def _waited_until(self, due_s: float) -> bool:
        """Wait for a frame's time; False where somebody paused meanwhile, or wants another frame."""
        with self._changed:
            return not self._changed.wait_for(
                lambda: self._is_closed or not self.is_playing or self._wanted is not None,
                max(0.0, due_s - time.monotonic()),
            )

    def _shown(self, frame: Frame) -> None:
        self.index = frame.index
        self._show(frame)
