"""All that commands print, exit codes, and interruption by Ctrl+C or SIGTERM."""

import contextlib
import io
import logging
import os
import signal
import sys
import threading
from collections.abc import Iterator
from types import FrameType

from dockpose.app.errors import writing
from dockpose.text import printable

EXIT_ALL_READ, EXIT_SOME_UNREADABLE, EXIT_BAD_ARGUMENTS, EXIT_STOPPED = 0, 1, 2, 130
EXIT_UNWRITABLE, EXIT_TERMINATED = 1, 143


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
        sys.stderr.write(f"dockpose: {printable(text)}\n")  # whole, whenever a signal comes
        sys.stderr.flush()


def put(*lines: str) -> None:
    """Write the lines of a result to standard output at once; line breaks in them and the like are spelt out."""
    put_text("".join(f"{printable(line)}\n" for line in lines))


def put_text(text: str) -> None:
    """Write text to standard output at once, as :func:`put`, but as it is."""
    with writing("standard output"):
        sys.stdout.write(text)
        sys.stdout.flush()


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
