"""Longer work, one piece at a time in its own thread, with progress and cancelling."""

import threading
from collections.abc import Callable, Iterator, Sequence
from typing import TypeVar

Item = TypeVar("Item")


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


class Task:
    """Runs one piece of work at a time and refuses others meanwhile.

    In the work's thread, ``tell`` is called with the share done, 0 to 1, ``on_error`` with what the work raised, unless
    it was cancelled, and ``on_end`` when the work is over, however it ended.
    """

    def __init__(
        self, tell: Callable[[float], None], on_end: Callable[[], None], on_error: Callable[[Exception], None]
    ) -> None:
        self._tell, self._on_end, self._on_error = tell, on_end, on_error
        self._lock = threading.Lock()
        self._running: tuple[threading.Thread, Progress] | None = None

    def start(self, work: Callable[[Progress], None]) -> bool:
        """Begin; False where other work is still running."""
        with self._lock:
            if self._running is not None:
                return False
            progress = Progress(self._tell)
            thread = threading.Thread(target=self._run, args=(work, progress), name="dockpose task", daemon=True)
            self._running = thread, progress
        thread.start()
        return True

    def cancel(self) -> None:
        """Ask whatever runs to stop at its next step."""
        with self._lock:
            if self._running is not None:
                self._running[1].stop()

    def close(self, timeout_s: float = 5.0) -> None:
        """Stop whatever runs and wait for its end."""
        self.cancel()
        running = self._running
        if running is not None and running[0] is not threading.current_thread():
            running[0].join(timeout_s)

    def _run(self, work: Callable[[Progress], None], progress: Progress) -> None:
        try:
            work(progress)
        except CancelledError:
            pass
        except Exception as error:  # whatever it was, people should read of it on the page
            self._on_error(error)
        finally:
            with self._lock:
                self._running = None
            self._on_end()
