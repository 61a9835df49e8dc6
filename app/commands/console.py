"""How far a run over frames is, on standard error."""

from __future__ import annotations

import sys
import time

from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

_EVERY_S = {True: 0.2, False: 10.0}  # how often it is told, to a terminal and elsewhere


class TerminalBar(Progress):
    """A bar that leaves no line where it is disabled, as rich before 14.3 does."""

    def stop(self) -> None:
        """Take the bar away."""
        if not self.disable:
            super().stop()


class FrameProgress:
    """Tells the number of frames, their rate and the time left.

    A terminal shows a bar that is gone at the end; elsewhere, as in a log, a plain line comes every ten seconds.

    Parameters
    ----------
    name : of the source.
    console : where to; the default is standard error.

    Attributes
    ----------
    total : number of frames, to be set once it is known; None where the source has no end that is known.
    """

    def __init__(self, name: str, console: Console | None = None) -> None:
        self._name = name
        self.total: int | None = None
        self._console = console or Console(stderr=True)
        self._is_terminal = self._console.is_terminal  # asking takes a while
        self._frames = 0
        self._began_s = self._told_s = time.monotonic()
        columns = ("{task.description}", BarColumn(), TextColumn("{task.fields[told]}"), TimeRemainingColumn())
        self._bar = TerminalBar(
            *columns,
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
        self._told_s = now_s
        told = told_text(self._frames, self.total, now_s - self._began_s, dropped)
        if self._is_terminal:
            self._bar.update(self._task, total=self.total, completed=self._frames, told=told)
        else:
            self.tell(f"{self._name}: {told}{_left(self._frames, self.total, now_s - self._began_s)}")

    def tell(self, text: str) -> None:
        """Tell something else without spoiling the bar."""
        if self._is_terminal:
            self._bar.console.print(f"dockpose: {text}", markup=False, highlight=False)
        else:
            print(f"dockpose: {text}", file=sys.stderr, flush=True)


def told_text(frames: int, total: int | None, elapsed_s: float, dropped: int = 0) -> str:
    """How far it is, in words: "300 of 1000 frames, 25.0 a second, 4 dropped"."""
    of = "" if total is None else f" of {total}"
    text = f"{frames}{of} frames, {frames / max(elapsed_s, 1e-9):.1f} a second"
    return f"{text}, {dropped} dropped" if dropped else text


def _left(frames: int, total: int | None, elapsed_s: float) -> str:
    return "" if total is None else f", {max(0.0, (total - frames) * elapsed_s / frames):.0f} s left"
