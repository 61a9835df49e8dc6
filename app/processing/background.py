"""Work in threads of its own: the newest job alone, and longer work with progress and cancelling."""

import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import Generic, TypeVar

Item = TypeVar("Item")
Job = TypeVar("Job")


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

    def silent(self) -> "Progress":
        """For a part of the work: stops with it, but reports nothing."""
        part = Progress(lambda share: None)
        part._stop = self._stop
        return part

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

    # After each job the next one waits for ``rest_s()`` seconds, and until for ``quiet_s()`` seconds no newer one came.

    def __init__(
        self,
        work: Callable[[Job], None],
        on_error: Callable[[Exception], None],
        rest_s: Callable[[], float] = lambda: 0.0,
        quiet_s: Callable[[], float] = lambda: 0.0,
    ) -> None:
        self._work = work
        self._on_error = on_error
        self._rest_s, self._quiet_s = rest_s, quiet_s
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
            self._rested_at_s = max(self._rested_at_s, time.monotonic() + self._quiet_s())
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
                self._changed.wait_for(lambda: self._waiting or self._is_closed)
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
                    self._rested_at_s = time.monotonic() + self._rest_s()
                    self._changed.notify_all()
