"""A cap on connections, so that a client that opens thousands of idle ones leaves room for the others."""

import asyncio

from dockpose.app.web.server.journal import Journal, client_of
from websockets.asyncio.server import ServerConnection
from websockets.frames import CloseCode

MOST_WAITING, MOST_OPEN = 128, 256
_TO_READ_WHY_S = 1.0
# Why websockets closes a connection whose frames are no frames, no text, or too large.
_BAD_FRAMES = (CloseCode.PROTOCOL_ERROR, CloseCode.INVALID_DATA, CloseCode.MESSAGE_TOO_BIG)


class Sockets:
    """The connections of a server: of too many without a WebSocket the oldest is cut off; the others are limited."""

    def __init__(self, journal: Journal) -> None:
        self._journal = journal
        self._waiting: dict[ServerConnection, None] = {}  # the oldest first
        self._open: set[ServerConnection] = set()
        self._bad: set[ServerConnection] = set()  # closed for their frames, and not gone yet

    def factory(self) -> type[ServerConnection]:
        """The class of connections to make, which report here."""
        sockets = self

        class Counted(ServerConnection):
            """One connection."""

            def connection_made(self, transport: asyncio.BaseTransport) -> None:
                super().connection_made(transport)
                sockets._begin(self)

            def data_received(self, data: bytes) -> None:
                super().data_received(data)
                sockets._end_if_bad(self)

            def connection_lost(self, exc: Exception | None) -> None:
                super().connection_lost(exc)
                sockets._end(self)

        return Counted

    @property
    def is_full(self) -> bool:
        """Whether no more WebSockets may be opened."""
        return len(self._open) >= MOST_OPEN

    def admit(self, connection: ServerConnection) -> None:
        """Count a connection among those that may have a WebSocket, and are not cut off."""
        if connection in self._waiting:
            del self._waiting[connection]
            self._open.add(connection)

    def _begin(self, connection: ServerConnection) -> None:
        self._waiting[connection] = None
        if len(self._waiting) > MOST_WAITING:
            oldest = next(iter(self._waiting))
            del self._waiting[oldest]
            self._journal.note(client_of(oldest), f"cut off the oldest of {MOST_WAITING} connections that ask nothing")
            oldest.transport.abort()

    def _end(self, connection: ServerConnection) -> None:
        self._waiting.pop(connection, None)
        self._open.discard(connection)
        self._bad.discard(connection)

    def _end_if_bad(self, connection: ServerConnection) -> None:
        """Write down that bad frames came, and let go of the connection soon, also where its browser never reads."""
        sent = connection.protocol.close_sent
        if connection in self._bad or sent is None or sent.code not in _BAD_FRAMES:
            return
        if not connection.protocol.close_rcvd_then_sent:
            self._bad.add(connection)
            self._journal.note(client_of(connection), f"closed its connection: {sent.reason}")
            connection.loop.call_later(_TO_READ_WHY_S, connection.transport.abort)
