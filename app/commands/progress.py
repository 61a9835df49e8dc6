"""How far a run over frames is, and tables, as rich draws them."""

import logging
import sys
import time
from collections.abc import Iterable

from dockpose.app.commands.console import put_text, say
from dockpose.text import printable
from rich import box
from rich.console import Console, ConsoleRenderable
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

_EVERY_S = {True: 0.2, False: 10.0}  # between two reports, to a terminal and elsewhere
_LOG = logging.getLogger("dockpose")


def put_rich(*parts: ConsoleRenderable | str) -> None:
    """Write tables of rich and sentences to standard output, as wide as a terminal, elsewhere 120 characters."""
    console = Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else 120)
    with console.capture() as captured:
        for part in parts:
            console.print(part)
    put_text(captured.get())


def table_of_numbers(head: Iterable[str]) -> Table:
    """An empty table with these columns."""
    table = Table(box=box.SIMPLE)
    for name in head:
        table.add_column(name, justify="right")
    return table


class FrameProgress:
    """Shows how many of ``total`` frames (or scenes, or parts) are done: a bar, or a line every ten seconds."""

    def __init__(self, name: str, *, total: int | None = None, unit: str = "frames") -> None:
        self._name, self.total, self._unit = name, total, unit
        console = Console(stderr=True)
        self._is_terminal = console.is_terminal  # asking takes a while
        self._count = 0
        self._began_s = self._said_s = time.monotonic()
        columns = ("{task.description}", BarColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn())
        off = not self._is_terminal
        self._bar = Progress(*columns, console=console, transient=True, disable=off, redirect_stdout=False)
        self._task = self._bar.add_task(escape(printable(name)), total=total, rate="")

    def __enter__(self) -> "FrameProgress":
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        if self._is_terminal:  # before 14.3 rich leaves a line where the bar is disabled
            self._bar.stop()

    def step(self, dropped: int = 0, *, name: str = "") -> None:
        """Count one more; with the name of what is done it is shown at once. ``dropped`` is the total."""
        self._count += 1
        now_s = time.monotonic()
        if not name and now_s - self._said_s < _EVERY_S[self._is_terminal]:
            return
        self._said_s, elapsed_s = now_s, now_s - self._began_s
        rate = rate_text(self._count, self.total, self._count / max(elapsed_s, 1e-9), dropped, self._unit)
        if self._is_terminal:
            words = escape(printable(name or self._name))
            self._bar.update(self._task, description=words, total=self.total, completed=self._count, rate=rate)
        else:
            left_s = 0.0 if self.total is None else max(0.0, (self.total - self._count) * elapsed_s / self._count)
            say(f"{name or self._name}: {rate}" + ("" if self.total is None else f", {left_s:.0f} s left"))

    def tell(self, text: str) -> None:
        """Write a message without spoiling the bar."""
        if self._is_terminal:
            self._bar.console.print(f"dockpose: {printable(text)}", markup=False, highlight=False)
            _LOG.info("%s", text, extra={"is_said": True})
        else:
            say(text)


def rate_text(count: int, total: int | None, a_second: float, dropped: int = 0, unit: str = "frames") -> str:
    """How far it is, in words: "300 of 1000 frames, 25.0 a second, 4 dropped"."""
    of = "" if total is None else f" of {total}"
    text = f"{count}{of} {unit}, {a_second:.1f} a second"
    return f"{text}, {dropped} dropped" if dropped else text
