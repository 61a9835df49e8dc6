"""Standard error and Ctrl+C: messages, exit codes, how far a run over frames is, and its interruption."""

from __future__ import annotations

import signal
import sys
import threading
import time
from types import FrameType, TracebackType

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

EXIT_ALL_READ, EXIT_SOME_UNREADABLE, EXIT_BAD_ARGUMENTS, EXIT_STOPPED = 0, 1, 2, 130
_EVERY_S = {True: 0.2, False: 10.0}  # between two reports, to a terminal and elsewhere


def say(text: str) -> None:
    """Write a message to standard error."""
    print(f"dockpose: {text}", file=sys.stderr, flush=True)


class TerminalBar(Progress):
    """A bar that leaves no line where it is disabled, as rich before 14.3 does."""

    def stop(self) -> None:
        """Take the bar away."""
        if not self.disable:
            super().stop()


class FrameProgress:
    """Shows the number of frames, their rate and the time left.

    A terminal shows a bar that is gone at the end; elsewhere, as in a log, a plain line comes every ten seconds.

    Parameters
    ----------
    name : str
        Of the source.
    console : Console, optional
        Where to; the default is standard error.

    Attributes
    ----------
    total : int or None
        Number of frames, to be set once it is known; None where the source has no known end.
    """

    def __init__(self, name: str, console: Console | None = None) -> None:
        self._name = name
        self.total: int | None = None
        self._console = console or Console(stderr=True)
        self._is_terminal = self._console.is_terminal  # asking takes a while
        self._frames = 0
        self._began_s = self._told_s = time.monotonic()
        self._bar = TerminalBar(
            "{task.description}",
            BarColumn(),
            TextColumn("{task.fields[told]}"),
            TimeRemainingColumn(),
            console=self._console,
            transient=True,
            disable=not self._is_terminal,
            redirect_stdout=False,
        )
        self._task = self._bar.add_task(name, total=None, told="")

    def __enter__(self) -> FrameProgress:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def step(self, dropped: int = 0) -> None:
        """Count one more frame; ``dropped`` is how many of a live source were left out so far."""
        self._frames += 1
        now_s = time.monotonic()
        if now_s - self._told_s < _EVERY_S[self._is_terminal]:
            return
        self._told_s, elapsed_s = now_s, now_s - self._began_s
        told = told_text(self._frames, self.total, elapsed_s, dropped)
        if self._is_terminal:
            self._bar.update(self._task, total=self.total, completed=self._frames, told=told)
        else:
            left_s = 0.0 if self.total is None else max(0.0, (self.total - self._frames) * elapsed_s / self._frames)
            say(f"{self._name}: {told}" + ("" if self.total is None else f", {left_s:.0f} s left"))

    def tell(self, text: str) -> None:
        """Write a message without spoiling the bar."""
        if self._is_terminal:
            self._bar.console.print(f"dockpose: {text}", markup=False, highlight=False)
        else:
            say(text)


def told_text(frames: int, total: int | None, elapsed_s: float, dropped: int = 0) -> str:
    """How far it is, in words: "300 of 1000 frames, 25.0 a second, 4 dropped"."""
    of = "" if total is None else f" of {total}"
    text = f"{frames}{of} frames, {frames / max(elapsed_s, 1e-9):.1f} a second"
    return f"{text}, {dropped} dropped" if dropped else text


class Interrupts:
    """A context in which Ctrl+C raises KeyboardInterrupt at once, and again at the next :meth:`check`.

    Python loses a KeyboardInterrupt that is raised in a callback from compiled code. Outside the main thread, and where
    Ctrl+C already has another meaning, nothing changes.
    """

    def __init__(self) -> None:
        self._was_asked = self._is_ours = False

    def check(self) -> None:
        """Raise KeyboardInterrupt if Ctrl+C was pressed, whatever became of it then."""
        if self._was_asked:
            raise KeyboardInterrupt

    def __enter__(self) -> Interrupts:
        is_main = threading.current_thread() is threading.main_thread()
        self._is_ours = is_main and signal.getsignal(signal.SIGINT) is signal.default_int_handler
        if self._is_ours:
            signal.signal(signal.SIGINT, self._interrupt)
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self._is_ours:
            signal.signal(signal.SIGINT, signal.default_int_handler)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        self._was_asked = True
        raise KeyboardInterrupt
