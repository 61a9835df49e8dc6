"""Ctrl+C that is not lost: Python lets go of it where it falls into a callback from compiled code."""

from __future__ import annotations

import signal
import threading
from types import FrameType, TracebackType


class Interrupts:
    """While this context lasts, Ctrl+C raises KeyboardInterrupt at once, and again at the next :meth:`check`.

    Elsewhere than in the main thread, and where Ctrl+C has another meaning already, nothing changes.
    """

    def __init__(self) -> None:
        self._was_asked = self._is_ours = False

    def check(self) -> None:
        """Raise KeyboardInterrupt where Ctrl+C was pressed, whatever became of it then."""
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
