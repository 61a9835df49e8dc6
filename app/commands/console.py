"""All that commands print, exit codes, how far a run over frames is, and its interruption by Ctrl+C or SIGTERM."""

import contextlib
import io
import logging
import os
import signal
import sys
import threading
import time
from collections.abc import Iterator
from types import FrameType

from dockpose.app.errors import writing
from dockpose.checks import printable
from rich.console import Console, ConsoleRenderable
from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeRemainingColumn

EXIT_ALL_READ, EXIT_SOME_UNREADABLE, EXIT_BAD_ARGUMENTS, EXIT_STOPPED = 0, 1, 2, 130
EXIT_UNWRITABLE, EXIT_TERMINATED = 1, 143
_EVERY_S = {True: 0.2, False: 10.0}  # between two reports, to a terminal and elsewhere


_LOG = logging.getLogger("dockpose")
_LOG.addHandler(logging.NullHandler())  # without any, logging would print what is said a second time

_asked: list[type[KeyboardInterrupt]] = []  # what Ctrl+C and SIGTERM raised


class Terminated(KeyboardInterrupt):
    """The system asks the program to end (SIGTERM): as Ctrl+C, but nothing more is begun."""


def stop_in(error: BaseException) -> KeyboardInterrupt:
    """The Ctrl+C or SIGTERM that an error is or stands for; compiled code makes SystemErrors of it. Else raises it."""
    stop: BaseException | None = error
    while isinstance(stop, SystemError):  # from Python 3.12 on, one of another
        stop = stop.__cause__
    if isinstance(stop, KeyboardInterrupt):
        return stop
    raise error


def status_of(stop: KeyboardInterrupt) -> int:
    """The exit status of a command that was stopped."""
    return EXIT_TERMINATED if isinstance(stop, Terminated) else EXIT_STOPPED


def check_stopped() -> None:
    """Raise again what Ctrl+C or SIGTERM raised: Python loses it where it is raised in a callback of compiled code."""
    if _asked:
        raise Terminated if Terminated in _asked else KeyboardInterrupt


@contextlib.contextmanager
def kept_at_stop() -> Iterator[None]:
    """Go on after the context where Ctrl+C ends it, with what there is by then; SIGTERM ends the program."""
    try:
        yield
    except Terminated:
        raise
    except KeyboardInterrupt:
        say("stopped; what was seen so far counts")


def say(text: str, level: int = logging.INFO) -> None:
    """Write a message of one line to standard error, if it takes anything, and note it as an event of that level."""
    _LOG.log(level, "%s", text, extra={"is_said": True})
    with contextlib.suppress(OSError, ValueError):
        print(f"dockpose: {printable(text)}", file=sys.stderr, flush=True)


def put(*lines: str) -> None:
    """Write the lines of a result to standard output at once; line breaks in them and the like are spelt out."""
    put_text("".join(f"{printable(line)}\n" for line in lines))


def put_text(text: str) -> None:
    """Write text to standard output at once, as :func:`put`, but as it is."""
    with writing("standard output"):
        sys.stdout.write(text)
        sys.stdout.flush()


def put_rich(*parts: ConsoleRenderable | str) -> None:
    """Write tables of rich and sentences to standard output, as wide as a terminal, elsewhere 120 characters."""
    console = Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else 120)
    with console.capture() as captured:
        for part in parts:
            console.print(part)
    put_text(captured.get())


@contextlib.contextmanager
def forgiving_output() -> Iterator[None]:
    """Let no character be an error on standard output, nor what is left in its buffer a traceback at the end."""
    _hold_standard_streams()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        yield
    finally:
        try:
            sys.stdout.flush()
        except (OSError, ValueError):
            with contextlib.suppress(OSError, ValueError):  # Python would try again, and say so at length
                os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _hold_standard_streams() -> None:
    """Take the numbers of standard streams that are closed, lest another file gets them; writing to output fails."""
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            null = os.open(os.devnull, os.O_RDONLY if number == 1 else os.O_RDWR)
            if null != number:
                os.dup2(null, number)
                os.close(null)
    if sys.stdout is None:
        sys.stdout = open(1, "w", closefd=False)  # noqa: SIM115  # for as long as the program runs
    if sys.stderr is None:
        sys.stderr = open(2, "w", closefd=False)  # noqa: SIM115


@contextlib.contextmanager
def stopped_by_signals() -> Iterator[None]:
    """Let SIGTERM raise :class:`Terminated` meanwhile, and Ctrl+C KeyboardInterrupt; not outside the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(number: int, frame: FrameType | None) -> None:
        _asked.append(Terminated if number == signal.SIGTERM else KeyboardInterrupt)
        raise _asked[-1]

    numbers = [signal.SIGTERM]
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it has another meaning already
        numbers.append(signal.SIGINT)

    def hush(lost: "sys.UnraisableHookArgs") -> None:
        if not isinstance(lost.exc_value, KeyboardInterrupt):
            tell(lost)

    before = {number: signal.signal(number, stop) for number in numbers}
    tell, sys.unraisablehook = sys.unraisablehook, hush
    try:
        yield
    finally:
        sys.unraisablehook = tell
        for number, handler in before.items():
            signal.signal(number, handler)
        _asked.clear()


class TerminalBar(Progress):
    """A bar that leaves no line where it is disabled, as rich before 14.3 does."""

    def stop(self) -> None:
        """Take the bar away."""
        if not self.disable:
            super().stop()


class FrameProgress:
    """Shows how many of ``total`` frames (or scenes, or parts) are done: a bar, or a line every ten seconds."""

    def __init__(self, name: str, *, total: int | None = None, unit: str = "frames") -> None:
        self._name, self.total, self._unit = name, total, unit
        console = Console(stderr=True)
        self._is_terminal = console.is_terminal  # asking takes a while
        self._count = self._first = 0  # done, and of these before this run
        self._is_begun = False
        self._began_s = self._said_s = time.monotonic()
        columns = ("{task.description}", BarColumn(), TextColumn("{task.fields[rate]}"), TimeRemainingColumn())
        off = not self._is_terminal
        self._bar = TerminalBar(*columns, console=console, transient=True, disable=off, redirect_stdout=False)
        self._task = self._bar.add_task(escape(printable(name)), total=total, rate="")

    def __enter__(self) -> "FrameProgress":
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def reach(self, count: int) -> None:
        """Count up to so many; at first, those that an earlier run has done."""
        if self._is_begun:
            return self.step(count=count - self._count)
        self._count = self._first = count
        self._began_s, self._is_begun = time.monotonic(), True
        if count > 0:
            say(f"{count} of {self.total} {self._unit} are done already")
        return None

    def step(self, dropped: int = 0, *, count: int = 1, name: str = "") -> None:
        """Count one more, or several; with the name of what is done it is shown at once. ``dropped`` is the total."""
        self._count += count
        now_s = time.monotonic()
        if not name and now_s - self._said_s < _EVERY_S[self._is_terminal]:
            return
        self._said_s, elapsed_s, new = now_s, now_s - self._began_s, self._count - self._first
        rate = rate_text(self._count, self.total, new / max(elapsed_s, 1e-9), dropped, self._unit)
        if self._is_terminal:
            words = escape(printable(name or self._name))
            self._bar.update(self._task, description=words, total=self.total, completed=self._count, rate=rate)
        else:
            left_s = 0.0 if self.total is None else max(0.0, (self.total - self._count) * elapsed_s / max(new, 1))
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
