"""The gate before viser: a cap on connections, and of messages only what the page itself would send, no faster."""

import asyncio
import secrets
import threading
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import viser
from dockpose.app.web.server import viser_private
from dockpose.app.web.server.journal import Journal, client_of
from dockpose.app.web.server.messages import LARGEST_BYTES, GuiUpdateMessage, RefusedError, check_message
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


_RATE_HZ, _BURST = 400.0, 800.0  # messages that one browser may send
_BYTES_PER_TOKEN = 256 * 2**10  # a large message counts for several
_OPENED_HZ, _OPENED_AT_ONCE = 10.0, 5.0  # pages that all browsers together may open
_SEND_BACK_S = 1.5  # a pause in typing: what is typed on the way to a number, as the 8 of 812, stays meanwhile


class Gate:
    """Checks all messages of all browsers before viser reads them."""

    def __init__(self, journal: Journal) -> None:
        self.journal = journal
        self.probe, self.is_reached = secrets.token_bytes(32), threading.Event()
        self._server: viser.ViserServer | None = None
        self._control = partial(self._find, viser_private.control)
        self.openings = _Bucket(_OPENED_HZ, _OPENED_AT_ONCE)  # each page is sent all that there is to see

    def serve(self, server: viser.ViserServer) -> None:
        """Let messages through to this server; before that, none pass."""
        self._server = server
        viser_private.protect_broadcasts(server)

    def stand_before(self, connection: Any, *, only_views: bool) -> None:
        """Take the place of a WebSocket's ``recv``, before anything was read from it."""
        inbox = _Inbox(self, connection, only_views=only_views)
        connection.recv = inbox.receive

    def check(self, raw: bytes | str, *, only_views: bool = False) -> Any:
        """Return the message; raises RefusedError where viser must not see it."""
        if self._server is None:
            raise RefusedError("the page is not ready yet")
        return check_message(raw, self._control, partial(self._find, viser_private.container), only_views=only_views)

    def send_back(self, connection: Any, refusal: RefusedError) -> None:
        """Show a browser the value in force in place of one that was not taken, and say why."""
        if self._server is None or refusal.control is None:
            return
        handle = self._control(refusal.control)
        live = viser_private.connections(self._server)
        client_id = next((one for one, it in live.items() if it is connection), None)
        client = None if client_id is None else self._server.get_clients().get(client_id)
        if handle is None or client is None or not viser_private.send_value(self._server, client.client_id, handle):
            return
        client.add_notification("Not taken", f"{handle.label}: {refusal.reason}.", color="yellow")

    def _find(self, find: Callable[[viser.GuiApi, str], Any], uuid: str) -> Any:
        """Find a control among those of all browsers, and then among those of cards that one browser alone is shown."""
        if self._server is None:
            return None
        guis = (self._server.gui, *(client.gui for client in self._server.get_clients().values()))
        return next((found for gui in guis if (found := find(gui, uuid)) is not None), None)


class _Bucket:
    """Lets so many things a second through, and some at once after a rest."""

    def __init__(self, rate_hz: float, at_once: float) -> None:
        self._rate_hz, self._at_once = rate_hz, at_once
        self._left, self._at_s = at_once, time.monotonic()

    async def pay(self, count: int) -> None:
        """Wait until it is the turn of these."""
        now_s = time.monotonic()
        self._left = min(self._at_once, self._left + self._rate_hz * (now_s - self._at_s)) - count
        self._at_s = now_s
        if self._left < 0:
            await asyncio.sleep(-self._left / self._rate_hz)


class _Inbox:
    def __init__(self, gate: Gate, connection: Any, *, only_views: bool) -> None:
        self._gate, self._connection, self._only_views = gate, connection, only_views
        self._receive = connection.recv
        self._client = client_of(connection)
        self._messages = _Bucket(_RATE_HZ, _BURST)
        self._to_send_back: dict[str, asyncio.TimerHandle] = {}

    async def receive(self, *arguments: Any, **keywords: Any) -> bytes:
        """The next message that may pass; the others are left out, and written to the journal."""
        while True:
            raw = await self._receive(*arguments, **keywords)
            await self._messages.pay(1 + len(raw) // _BYTES_PER_TOKEN)  # then no more are read: the sender waits
            if self._passes(raw):
                return raw
            raw = b""  # not kept while the next one is waited for

    def _passes(self, raw: bytes | str) -> bool:
        if raw == self._gate.probe:
            self._gate.is_reached.set()
            return False
        try:
            message = self._gate.check(raw, only_views=self._only_views)
        except RefusedError as refusal:
            if not self._only_views or len(raw) > LARGEST_BYTES:  # the page of a viewer sends what it always does
                self._gate.journal.note(self._client, f"refused {refusal}")
            if refusal.control is not None:
                self._plan(refusal.control, refusal)
            return False
        if isinstance(message, GuiUpdateMessage):
            self._cancel(message.uuid)
        return True

    def _plan(self, control: str, refusal: RefusedError) -> None:
        def send() -> None:
            self._cancel(control)
            self._gate.send_back(self._connection, refusal)

        self._cancel(control)
        self._to_send_back[control] = asyncio.get_running_loop().call_later(_SEND_BACK_S, send)

    def _cancel(self, control: str) -> None:
        if planned := self._to_send_back.pop(control, None):
            planned.cancel()
