"""What connections may take: places, frames a second, and bytes on their way, so that none takes all there is."""

import asyncio
import time
from collections import Counter
from typing import Any

from dockpose.app.web.server.journal import JOURNAL, client_of
from websockets.asyncio.server import ServerConnection
from websockets.frames import CloseCode, Frame, Opcode

MOST_WAITING, MOST_OPEN = 128, 32
# For websockets: a message may be a rendered picture of a 4K window, and what is sent here is as large as it looks.
SETTINGS = {"max_size": 16 * 2**20, "compression": None}
_MOST_BYTES = 48 * 2**20  # on their way, to and from all pages together
_MANY_BYTES = 2**20  # of one page that are worth counting what all have
_SLICE_BYTES = 8 * 2**10  # looked at in between: it may hold 1,300 empty frames
_FRAMES_HZ, _FRAMES_AT_ONCE = 400.0, 1000.0  # that one page may send
_OPENED_HZ, _OPENED_AT_ONCE = 5.0, 5.0  # pages that one machine may open; each is sent all that there is to see
_LONGEST_WAIT_S, _MOST_MACHINES = 2.0, 1000
# Why websockets closes a connection whose frames are no frames, no text, or too large.
_BAD_FRAMES = (CloseCode.PROTOCOL_ERROR, CloseCode.INVALID_DATA, CloseCode.MESSAGE_TOO_BIG)


class Connections:
    """Those of a server, of which the least useful are cut off where there are too many."""

    def __init__(self) -> None:
        self._waiting: dict[_Connection, None] = {}  # without a WebSocket, the oldest first
        self._open: dict[_Connection, bool] = {}  # whether anything came, that of which nothing did for longest first
        self._opened: dict[str, _Bucket] = {}  # by machine

    def make(self, *arguments: Any, **keywords: Any) -> "_Connection":
        """Make a connection that reports here."""
        return _Connection(self, *arguments, **keywords)

    async def admit(self, connection: Any) -> bool:
        """Give a connection a place among the pages, once it is its turn; False where too many want one."""
        client = client_of(connection)
        if len(self._opened) > _MOST_MACHINES:
            self._opened.clear()
        wait_s = self._opened.setdefault(client, _Bucket(_OPENED_HZ, _OPENED_AT_ONCE)).take(_LONGEST_WAIT_S)
        if wait_s > _LONGEST_WAIT_S:
            JOURNAL.note(client, "refused a page: it opens too many at once")
            return False
        await asyncio.sleep(wait_s)
        if connection not in self._waiting:  # cut off meanwhile
            return False
        if len(self._open) >= MOST_OPEN:
            pages = Counter(map(client_of, self._open))
            least = max(self._open, key=lambda one: (pages[client_of(one)], not self._open[one]))
            self.cut_off(least, f"of {MOST_OPEN} pages it is the one that says least, and another one comes")
        del self._waiting[connection]
        self._open[connection] = False
        self.bound_bytes()
        return True

    def begin(self, connection: "_Connection") -> None:
        """Count a new connection."""
        self._waiting[connection] = None
        if len(self._waiting) > MOST_WAITING:
            self.cut_off(next(iter(self._waiting)), f"the oldest of {MOST_WAITING} connections that ask nothing")

    def hear(self, connection: "_Connection") -> None:
        """Note that something came."""
        if self._open.pop(connection, None) is not None:
            self._open[connection] = True

    def end(self, connection: "_Connection") -> None:
        """Forget one that is closed."""
        self._waiting.pop(connection, None)
        self._open.pop(connection, None)

    def cut_off(self, connection: "_Connection", why: str) -> None:
        """Close a connection at once."""
        self.end(connection)
        JOURNAL.note(client_of(connection), f"cut off: {why}")
        connection.transport.abort()

    def bound_bytes(self) -> None:
        """Cut off those with most bytes on their way until all together have few enough."""
        sizes = {one: one.bytes_on_their_way for one in self._open}
        while sum(sizes.values()) > _MOST_BYTES:
            most = max(sizes, key=lambda one: sizes[one])
            self.cut_off(most, f"{sizes.pop(most) / 2**20:.0f} MB are on their way, and it does not go on")


class _Connection(ServerConnection):
    """One connection."""

    def __init__(self, counted_by: Connections, *arguments: Any, **keywords: Any) -> None:
        super().__init__(*arguments, **keywords)
        self._all, self._frames = counted_by, _Bucket(_FRAMES_HZ, _FRAMES_AT_ONCE)
        self._begun_bytes = 0  # that came of a message which has not ended

    @property
    def bytes_on_their_way(self) -> int:
        """Those that came of a message which has not ended, and those that were not read at the other end."""
        return self._begun_bytes + self.transport.get_write_buffer_size()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._all.begin(self)

    def data_received(self, data: bytes) -> None:
        for start in range(0, len(data), _SLICE_BYTES):
            if self.transport.is_closing():
                return
            piece = data[start : start + _SLICE_BYTES]
            self._begun_bytes += len(piece)
            super().data_received(piece)
            closed = self.protocol.close_sent
            if closed is not None and closed.code in _BAD_FRAMES:  # its browser may never heed that
                self._all.cut_off(self, closed.reason)
        self._all.hear(self)
        if self._begun_bytes > _MANY_BYTES:
            self._all.bound_bytes()

    def process_event(self, event: Any) -> None:
        if self.transport.is_closing():
            return
        super().process_event(event)
        if not isinstance(event, Frame):
            return
        if self._frames.take(0.0) > 0:
            self._all.cut_off(self, f"it sends more than {_FRAMES_HZ:g} frames a second")
        elif event.fin and event.opcode in (Opcode.TEXT, Opcode.BINARY, Opcode.CONT):
            self._begun_bytes = 0

    def connection_lost(self, exc: Exception | None) -> None:
        self._all.end(self)
        super().connection_lost(exc)


class _Bucket:
    """Lets so many things a second through, and some at once after a rest."""

    def __init__(self, rate_hz: float, at_once: float) -> None:
        self._rate_hz, self._at_once = rate_hz, at_once
        self._left, self._at_s = at_once, time.monotonic()

    def take(self, longest_s: float) -> float:
        """Seconds until it is the turn of one more; it is not counted where that takes too long."""
        now_s = time.monotonic()
        self._left = min(self._at_once, self._left + self._rate_hz * (now_s - self._at_s))
        self._at_s = now_s
        wait_s = max(0.0, (1 - self._left) / self._rate_hz)
        if wait_s <= longest_s:
            self._left -= 1
        return wait_s
