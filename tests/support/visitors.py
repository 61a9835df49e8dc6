"""Whoever talks to the page over HTTP and WebSocket, as its own page does or as no page would."""

import contextlib
import socket
import threading
import time
from collections.abc import Callable
from importlib.metadata import version
from urllib.parse import parse_qs, urlsplit

import msgspec
import zstandard
from viser import _messages as messages
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

SUBPROTOCOL = Subprotocol(f"viser-v{version('viser')}")
VIEWPOINT = messages.ViewerCameraMessage(
    (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, -3.0), 1.0, 0.1, 100.0, 600, 800, (0.0, 0.0, 0.0), (0.0, -1.0, 0.0)
)


def packed(message):
    return msgspec.msgpack.encode(message.as_serializable_dict())


def cookie_of(address):
    """The cookie that a browser has after it opened the printed address."""
    parts = urlsplit(address)
    return f"dockpose_{parts.port}={parse_qs(parts.query)['token'][0]}"


def asked(port, request, timeout_s=60.0, source="127.0.0.1"):
    """The first line of the answer to bytes that need not be a request; empty where it is closed without one."""
    with contextlib.closing(socket.create_connection(("127.0.0.1", port), timeout_s, (source, 0))) as raw:
        raw.sendall(request)
        answer = b""
        with contextlib.suppress(ConnectionResetError):
            while b"\r\n" not in answer and (more := raw.recv(4096)):
                answer += more
    return answer.split(b"\r\n")[0].decode()


class Visitor:
    """A browser with the token that keeps the values of controls it is told; ``reads=False`` never reads.

    ``look`` is what it says of itself, as "dark.software".
    """

    def __init__(self, address, *, reads=True, source="127.0.0.1", look="", hears=lambda message: None):
        host = urlsplit(address).netloc
        to_server = socket.create_connection(("127.0.0.1", urlsplit(address).port), 10, (source, 0))
        to_server.settimeout(None)
        self.socket = connect(
            f"ws://{host}",
            sock=to_server,
            origin=Origin(f"http://{host}"),
            additional_headers={"Cookie": f"{cookie_of(address)}; dockpose_{urlsplit(address).port}_look={look}"},
            subprotocols=[SUBPROTOCOL],
            max_size=None,
            compression=None,
            close_timeout=1,
            ping_interval=None,
        )
        self.hears: Callable[..., object] = hears  # is given each message; may be replaced
        self.was_dark: list[bool] = []
        self.values, self.ids, self.buttons, self.notices, self.kinds = {}, {}, {}, [], {}
        self.bytes_read, self.messages_read = 0, 0
        self.is_replayed, self.changed = threading.Event(), threading.Condition()
        self.send(VIEWPOINT)
        if reads:
            threading.Thread(target=self._read, daemon=True).start()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.close()

    def close(self):
        self.socket.close()

    def send(self, message):
        self.send_raw(packed(message))

    def send_raw(self, raw):
        self.socket.send(raw)

    def set(self, label, value):
        """Send a value for the control of that label, without any check."""
        self.send(messages.GuiUpdateMessage(self.ids[label], {"value": value}))

    @property
    def is_dark(self):
        return self.was_dark[-1] if self.was_dark else None

    @property
    def is_open(self):
        return self.socket.protocol.state.name == "OPEN"

    def until(self, condition, timeout_s=60.0):
        """Wait until something is so; return whether it is."""
        end_s = time.monotonic() + timeout_s
        with self.changed:
            while not condition(self) and self.is_open and time.monotonic() < end_s:
                self.changed.wait(0.05)
            return condition(self)

    def _read(self):
        with contextlib.suppress(ConnectionClosed, OSError):
            while True:
                raw = self.socket.recv(decode=False)
                size = int.from_bytes(raw[8:16], "little")
                inner = zstandard.ZstdDecompressor().decompress(
                    raw[16 : 16 + size], max_output_size=int.from_bytes(raw[:8], "little")
                )
                with self.changed:
                    self.bytes_read += len(raw)
                    for message in msgspec.msgpack.decode(inner)["messages"]:
                        self._take(message)
                    self.changed.notify_all()

    def _take(self, message):
        self.messages_read += 1
        self.hears(message)
        kind = message["type"]
        if kind == "GuiUpdateMessage":
            if "value" in message["updates"]:
                self.values[message["uuid"]] = message["updates"]["value"]
        elif kind == "ThemeConfigurationMessage":
            self.was_dark.append(message["dark_mode"])
        elif kind == "ReplayDoneMessage":
            self.is_replayed.set()
        elif kind == "NotificationShowMessage":
            self.notices.append(message["props"])
        elif kind == "GuiUploadButtonMessage":
            self.buttons[message["props"]["label"]] = message["uuid"]
        elif "props" in message and "label" in (message["props"] or {}):
            self.ids.setdefault(message["props"]["label"], message["uuid"])
            self.kinds[message["uuid"]] = kind
            self.values[message["uuid"]] = message.get("value")
