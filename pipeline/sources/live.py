"""Cameras and streams: a thread keeps the newest frame, and reconnects when the source goes away."""

import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import av
import numpy as np
from dockpose.sources.capture import Capture
from dockpose.sources.frames import Callback, Frame, Frames, SourceError
from dockpose.sources.kinds import DEFAULT_CAPTURE, CaptureSettings

FIRST_PAUSE_S, LONGEST_PAUSE_S = 0.5, 8.0
LONGEST_WAIT_S = 2.0  # for one that is not there yet when the program starts
_MOST_DELAY_S = 1.0  # of a frame after the time stamp of its driver
_FAILURES = 5  # consecutive failures, such as corrupt frames, after which a source counts as lost


@dataclass(frozen=True, eq=False)
class Arrival:
    """A frame of a live source as it came, whether or not somebody has the time for it."""

    frame: Frame
    packets: tuple[av.Packet, ...] = ()  # the same as it was sent, and what was sent with it; of a camera none
    shift_s: float | None = None  # makes the packets' own times those of frames; None where they have none


class Live(Frames):
    """Frames as they arrive; a slow consumer gets the newest, until the source is closed.

    The index counts the frames that arrived, so the numbers of dropped ones are left out. Times are in seconds since
    the first frame, by the source's own clock where it has one, and by the time of arrival elsewhere. The time of day
    is that of the first frame, by the sender where it tells one and else of its arrival, and goes on by the same clock
    as the times, so that a clock that is set meanwhile tears no gap. ``connect`` opens the source or raises
    SourceError; each pause before it is tried again is twice the one before. One that ``waits`` may come later than the
    start. The reading thread calls ``tell``.
    """

    is_live = True

    def __init__(
        self,
        source: str,
        connect: Callable[[], Capture],
        tell: Callback | None = None,
        *,
        settings: CaptureSettings = DEFAULT_CAPTURE,
        waits: bool = False,
    ) -> None:
        super().__init__(source, tell)
        self._connect = connect
        self._stop = threading.Event()
        self._changed = threading.Condition()
        self._newest: Frame | None = None
        self._first: Capture | None
        self._error: Exception | None = None
        self._came = 0
        self._began_s = 0.0
        self._began_unix_s, self._is_dated = 0.0, False  # by the sender
        self._ahead_s: float | None = None  # of our clock over the source's, since it was connected
        self.about = ""  # what the source says that it gives, in words
        # Called in the reading thread with each frame that comes, dropped or not; must not take time.
        self.on_arrival: Callable[[Arrival], None] | None = None
        self.settings = settings  # what it was asked for last
        self._asked: CaptureSettings | None = None  # anew, while the source is open
        self._refused: tuple[str, ...] = ()
        self._waits, self._first = waits, None
        try:
            self._first = connect()
            self._ask(self._first, self.settings)
        except SourceError as error:
            if not waits:
                raise
            self.about = f"{error}; it is waited for"
            self._tell(self.about)
        self._thread = threading.Thread(target=self._run, name="dockpose live source", daemon=True)

    def __iter__(self) -> Iterator[Frame]:
        if self._thread.ident is None and not self._stop.is_set():
            self._thread.start()  # not before, so that ``on_arrival`` hears of the first frame too
        while True:
            with self._changed:
                self._changed.wait_for(
                    lambda: self._newest is not None or self._stop.is_set() or self._error is not None
                )
                frame, self._newest = self._newest, None
            if self._error is not None:
                raise SourceError(f"{self.source}: cannot be read any more ({self._error})") from self._error
            if frame is None or self._stop.is_set():
                return
            yield self._turned(frame)

    def ask(self, settings: CaptureSettings) -> None:
        """Ask the source for something else; the reading thread does so before the next frame."""
        self.settings = self._asked = settings

    def close(self) -> None:
        """End the iteration and release the source; its thread may need a read's time limit to notice."""
        self._stop.set()
        with self._changed:
            self._changed.notify_all()
        if not self._thread.is_alive():
            if self._first is not None:
                self._first.release()
        elif self._thread is not threading.current_thread():
            self._thread.join(timeout=2.0)

    def _run(self) -> None:
        capture, self._first = self._first, None
        try:
            if capture is None:
                capture = self._bring_back()
            while capture is not None:
                self._read(capture)
                capture.release()
                capture = None if self._stop.is_set() else self._bring_back()
        except Exception as error:  # raised again where the frames are consumed
            with self._changed:
                self._error = error
                self._changed.notify_all()

    def _ask(self, capture: Capture, settings: CaptureSettings) -> None:
        """Pass settings on, and tell what is refused, once."""
        refused = capture.ask(settings)
        for text in refused:
            if text not in self._refused:
                self._tell(f"{self.source}: {text}")
        self._refused, self.about = refused, capture.about

    def _read(self, capture: Capture) -> None:
        """Read until the source is lost or closed."""
        failures = 0
        self._ahead_s = None
        while not self._stop.is_set() and failures < _FAILURES:
            asked, self._asked = self._asked, None
            if asked is not None:
                self._ask(capture, asked)
            is_there, arrived_s = capture.grab(), time.monotonic()
            image = capture.retrieve() if is_there else None
            if image is None:
                failures += not capture.is_idle
                continue
            self._came, self.skipped = self._came + capture.left_out, self.skipped + capture.left_out
            if failures:
                self._came += failures
                frames = "1 frame was corrupt and is" if failures == 1 else f"{failures} frames were corrupt and are"
                self._skip(f"{self.source}: {frames} left out", failures)
                failures = 0
            self._keep(image, arrived_s, capture)

    def _keep(self, image: np.ndarray, arrived_s: float, capture: Capture) -> None:
        stamp_s = capture.time_s
        if stamp_s is not None and 0 <= arrived_s - stamp_s < _MOST_DELAY_S:
            arrived_s = stamp_s  # by our own clock, as Video4Linux gives it: when the frame was there, not when we were
        if self._came == 0 or self._began_s == 0.0:
            self._began_s = arrived_s
            self._began_unix_s = time.time() - (time.monotonic() - arrived_s)
        time_s = arrived_s - self._began_s
        if stamp_s is not None:
            if self._ahead_s is None:
                self._ahead_s = time_s - stamp_s
            time_s = stamp_s + self._ahead_s
            if not self._is_dated and capture.unix_at_zero_s is not None:  # once, for times of day to go on evenly
                self._is_dated, self._began_unix_s = True, capture.unix_at_zero_s + stamp_s - time_s
        time_s = round(time_s, 6)
        taken_s = round(self._began_unix_s + time_s, 6)
        more = {"shown": capture.shown, "time_unix_s": taken_s, "monotonic_s": arrived_s}
        frame = Frame(image, self._came, time_s, self.source, **more)
        self.about = capture.about
        self._came += 1
        if self.on_arrival is not None:
            self.on_arrival(Arrival(frame, capture.packets, None if stamp_s is None else self._ahead_s))
        with self._changed:
            self.dropped += self._newest is not None
            self._newest = frame
            self._changed.notify_all()

    def _bring_back(self) -> Capture | None:
        """Reconnect until the source answers; None if it was closed meanwhile."""
        pause_s, lost_s = FIRST_PAUSE_S, time.monotonic()
        if self._began_s:
            self._tell(f"{self.source}: no more frames come; it is tried again after {pause_s:g} s")
        while not self._stop.wait(pause_s):
            try:
                capture = self._connect()
            except SourceError as error:
                pause_s = min(2 * pause_s, LONGEST_WAIT_S if self._waits else LONGEST_PAUSE_S)
                self._tell(f"{error}; it is tried again after {pause_s:g} s")
                continue
            self._ask(capture, self.settings)
            self._tell(f"{self.source}: is back after {time.monotonic() - lost_s:.1f} s")
            return capture
        return None
