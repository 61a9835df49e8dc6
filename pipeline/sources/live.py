"""Cameras and streams: a thread keeps the newest frame, and reconnects when the source goes away."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import numpy as np
from dockpose.sources.capture import Capture
from dockpose.sources.frames import Frame, Frames, SourceError, Tell

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 8.0
_FAILURES = 5  # consecutive failures, such as corrupt frames, after which a source counts as lost


class Live(Frames):
    """Frames as they arrive; a slow consumer gets the newest.

    The index counts the frames that arrived, so the numbers of dropped ones are left out. Times are in seconds since
    the first frame, by the source's own clock where it has one, and by the time of arrival elsewhere. Iteration ends
    when the source is closed.

    Parameters
    ----------
    source : str
        Display name.
    connect : callable
        Opens the source; raises SourceError if it does not answer.
    tell : callable, optional
        Called with a sentence, in the reading thread, when the source is lost or back and for corrupt frames.
    first_pause_s, longest_pause_s : float, seconds
        Pause before the first attempt to reconnect, and the longest; each is twice the one before.

    Raises
    ------
    SourceError
        If it cannot be opened at first.
    """

    is_live = True

    def __init__(
        self,
        source: str,
        connect: Callable[[], Capture],
        tell: Tell | None = None,
        *,
        first_pause_s: float = FIRST_PAUSE_S,
        longest_pause_s: float = LONGEST_PAUSE_S,
    ) -> None:
        super().__init__(source, tell)
        self._connect = connect
        self._pauses_s = (first_pause_s, longest_pause_s)
        self._stop = threading.Event()
        self._changed = threading.Condition()
        self._newest: Frame | None = None
        self._came = 0
        self._began_s = 0.0
        self._ahead_s: float | None = None  # of our clock over the source's, since it was connected
        capture = connect()
        self._thread = threading.Thread(target=self._run, args=(capture,), name="dockpose live source", daemon=True)
        self._thread.start()

    def __iter__(self) -> Iterator[Frame]:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._newest is not None or self._stop.is_set())
                frame, self._newest = self._newest, None
            if frame is None or self._stop.is_set():
                return
            yield frame

    def close(self) -> None:
        """End the iteration and release the source; its thread may need a read's time limit to notice."""
        self._stop.set()
        with self._changed:
            self._changed.notify_all()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout=2.0)

    def _run(self, capture: Capture | None) -> None:
        while capture is not None:
            self._read(capture)
            capture.release()
            capture = None if self._stop.is_set() else self._bring_back()

    def _read(self, capture: Capture) -> None:
        """Read until the source is lost or closed."""
        failures = 0
        self._ahead_s = None
        while not self._stop.is_set() and failures < _FAILURES:
            good = capture.grab()
            arrived_s = time.monotonic()
            image = None
            if good:
                good, image = capture.retrieve()
            if not good or image is None:
                failures += 1
                continue
            if failures:
                self._came += failures
                frames = "1 frame was corrupt and is" if failures == 1 else f"{failures} frames were corrupt and are"
                self._skip(f"{self.source}: {frames} left out", failures)
                failures = 0
            self._keep(image, arrived_s, capture.time_s)

    def _keep(self, image: np.ndarray, arrived_s: float, stamp_s: float | None) -> None:
        if self._came == 0 or self._began_s == 0.0:
            self._began_s = arrived_s
        time_s = arrived_s - self._began_s
        if stamp_s is not None:
            if self._ahead_s is None:
                self._ahead_s = time_s - stamp_s
            time_s = stamp_s + self._ahead_s
        frame = Frame(image, self._came, round(time_s, 6), self.source)
        self._came += 1
        with self._changed:
            self.dropped += self._newest is not None
            self._newest = frame
            self._changed.notify_all()

    def _bring_back(self) -> Capture | None:
        """Reconnect until the source answers; None if it was closed meanwhile."""
        pause_s, longest_s = self._pauses_s
        lost_s = time.monotonic()
        self._tell(f"{self.source}: no more frames come; it is tried again after {pause_s:g} s")
        while not self._stop.wait(pause_s):
            try:
                capture = self._connect()
            except SourceError as error:
                pause_s = min(2 * pause_s, longest_s)
                self._tell(f"{error}; it is tried again after {pause_s:g} s")
                continue
            self._tell(f"{self.source}: is back after {time.monotonic() - lost_s:.1f} s")
            return capture
        return None
