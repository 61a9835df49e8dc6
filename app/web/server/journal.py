"""What happens at the server, one line an event, through the standard ``logging``."""

import logging
import time
from collections.abc import Mapping
from concurrent.futures import Future
from typing import Any

from dockpose.text import one_line

LOG = logging.getLogger("dockpose.server")
SOCKETS_LOG = logging.getLogger("dockpose.server.sockets")  # what websockets itself has to say
SOCKETS_LOG.setLevel(logging.WARNING)  # below that are headers, with their cookies
_EVERY_S = 1.0
_MOST_CLIENTS = 1000
_LONGEST = 300  # characters


class Journal:
    """Writes what each client did, at most one line a second for each, so that nobody can flood the terminal."""

    def __init__(self) -> None:
        self.is_silent = False  # as while we try ourselves whether requests are refused
        self._told: dict[str, tuple[float, int]] = {}  # when a line was written, and how many were left out since

    def note(self, client: str, text: str, level: int = logging.WARNING) -> None:
        """Write one line about a client, or count it for its next line."""
        if self.is_silent:
            return
        now_s = time.monotonic()
        told_s, left_out = self._told.get(client, (-_EVERY_S, 0))
        if now_s - told_s < _EVERY_S:
            self._told[client] = (told_s, left_out + 1)
            return
        if len(self._told) >= _MOST_CLIENTS:
            self._told.clear()
        self._told[client] = (now_s, 0)
        more = f" (and {left_out} more before)" if left_out else ""
        LOG.log(level, "%s: %s%s", client, one_line(text, _LONGEST), more)


JOURNAL = Journal()


class _OneLine(logging.Filter):
    """Gives an exception in a record as one line, by way of the journal, in place of its traceback."""

    def filter(self, record: logging.LogRecord) -> bool:
        """Pass what has no exception on; write the others here."""
        error = record.exc_info[1] if record.exc_info else None
        if error is None:
            return True
        cause = error.__cause__ or error
        JOURNAL.note(
            client_of(getattr(record, "websocket", None)), f"{record.getMessage()}: {type(cause).__name__}: {cause}"
        )
        return False


SOCKETS_LOG.addFilter(_OneLine())


def client_of(connection: Any) -> str:
    """The address of the machine at the other end of a connection."""
    return str((getattr(connection, "remote_address", None) or ("somebody",))[0])


def log_failure(future: Future[Any]) -> None:
    """Write one line where a job in a pool of threads failed."""
    if not future.cancelled() and (error := future.exception()) is not None:
        _log(error, "")


def log_unhandled(loop: Any, context: Mapping[str, Any]) -> None:
    """Write one line about what nobody caught on the event loop; takes the place of asyncio's tracebacks."""
    _log(context.get("exception"), str(context.get("message")))


def _log(error: BaseException | None, message: str) -> None:
    what = message if error is None else f"{type(error).__name__}: {error}"
    if LOG.isEnabledFor(logging.DEBUG):
        LOG.error("%s", one_line(what, _LONGEST), exc_info=error)
    else:
        JOURNAL.note("the page", what, logging.ERROR)
