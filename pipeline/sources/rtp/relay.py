"""RTSP over TCP, passed on to FFmpeg with a mark wherever packets were lost before they were sent, which it joins."""

import contextlib
import re
import socket
import threading
from urllib.parse import urlsplit

# Filler, which belongs to the picture before it and which decoders pass over, of bytes that nobody else sends.
MARK = b"dockpose: packets are missing here"
_UNITS = {b"H264": b"\x0c", b"H265": b"\x4c\1"}  # heads of such a unit
_RTSP_PORT = 554
_LARGEST_BYTES = 2**16  # that are taken at once, and of an answer's head


class Marks:
    """Passes on what a server sends, with a mark on either side of where the packets' numbers have a gap."""

    def __init__(self) -> None:
        self._waiting = bytearray()
        self._units = dict[int, bytes]()  # heads of a mark by the packets' types
        self._next = dict[int, int]()  # number of the next packet of each channel

    def pass_on(self, data: bytes) -> bytes:
        """Take what comes next, and return what of it is complete."""
        self._waiting += data
        found = list[bytes]()
        while part := self._first():
            del self._waiting[: len(part)]
            found.append(self._marked(part) if part[:1] == b"$" else part)
        return b"".join(found)

    def _first(self) -> bytes:
        """The first packet (RFC 2326, 10.12) or answer that waits; empty where it is not complete."""
        data, end = self._waiting, 4 + int.from_bytes(self._waiting[2:4], "big")
        if data[:1] != b"$":
            if (end := data.find(b"\r\n\r\n") + 4) < 4:
                if len(data) > _LARGEST_BYTES:
                    raise ConnectionError("neither an answer nor a packet")
                return b""
            length = re.search(rb"^content-length:\s*(\d{1,9})", data[:end], re.I | re.M)
            end += int(length[1]) if length else 0
            about = re.findall(rb"^a=rtpmap:(\d{1,3}) (H26[45])/", data[:end], re.I | re.M)
            self._units |= {int(kind): _UNITS[bytes(name).upper()] for kind, name in about}
        return bytes(data[:end]) if len(data) >= max(end, 4) else b""

    def _marked(self, part: bytes) -> bytes:
        channel, head, number = part[1], part[4:16], int.from_bytes(part[6:8], "big")
        unit = self._units.get(head[1] & 0x7F) if len(head) == 12 and channel % 2 == 0 else None  # odd are reports
        expected, self._next[channel] = self._next.get(channel, number), (number + 1) % 2**16
        if unit is None or number == expected:
            return part
        mark = b"\x80" + bytes([head[1] & 0x7F]) + head[2:] + unit + MARK
        mark = part[:2] + len(mark).to_bytes(2, "big") + mark
        return mark + part + mark


class Relay:
    """Listens on loopback for one client, in place of a server, until either closes; OSError where none is there."""

    def __init__(self, address: str, timeout_s: float) -> None:
        parts = urlsplit(address)
        self._server = socket.create_connection((parts.hostname or "", parts.port or _RTSP_PORT), timeout_s)
        self._listening = socket.create_server(("127.0.0.1", 0))
        self._listening.settimeout(timeout_s)
        name, at, _ = parts.netloc.rpartition("@")
        self.address = parts._replace(netloc=f"{name}{at}127.0.0.1:{self._listening.getsockname()[1]}").geturl()
        threading.Thread(target=self._run, name="dockpose RTSP", daemon=True).start()

    def _run(self) -> None:
        with contextlib.suppress(OSError), self._listening, self._server, self._listening.accept()[0] as client:
            self._server.settimeout(None)  # the client knows how long to wait
            threading.Thread(target=_copy, args=(client, self._server), name="dockpose RTSP", daemon=True).start()
            _copy(self._server, client, Marks())


def _copy(source: socket.socket, target: socket.socket, marks: Marks | None = None) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(_LARGEST_BYTES):
            target.sendall(marks.pass_on(data) if marks else data)
    with contextlib.suppress(OSError):
        target.shutdown(socket.SHUT_RDWR)
