"""Packets of RTP (RFC 3550), in their order, from a UDP port that an address or a description (RFC 4566) names."""

import base64
import contextlib
import re
import socket
import struct
import time
from pathlib import Path
from typing import NamedTuple
from urllib.parse import urlsplit

from dockpose.sources.bags.storage import check_regular
from dockpose.sources.frames import SourceError
from dockpose.sources.rtp.payload import JPEG_TYPE, payload_of

_LARGEST_BYTES = 2**16  # of a description
_BUFFER_BYTES = 2**22  # that the system keeps while a picture is decoded: seconds of them
_WAIT_S = 0.2
_NEW_SENDER_S = 1.0  # of silence, after which another one is listened to
_MOST_EARLY, _EARLY_S, _FAR = 32, 0.03, 1000  # packets and seconds that a late one is waited for; a restart


class Described(NamedTuple):
    """What an address or a description says of a stream."""

    host: str
    port: int
    payload_type: int | None = None  # None for any
    coding: str | None = None  # None where the packets tell
    sets: tuple[bytes, ...] = ()  # parameter sets


class Packet(NamedTuple):
    """A packet."""

    sequence: int
    stamp: int
    source: int
    payload_type: int
    is_last: bool  # of its picture
    payload: bytes


def described(address: str) -> Described:
    """Read an address, as rtp://:5600, or the file of a description; SourceError for neither."""
    if not address.lower().startswith("rtp://"):
        return _in_file(address)
    try:
        parts = urlsplit(address)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        host, port = "", None
    if not port:
        raise SourceError(f"{address}: names no UDP port; write it as rtp://:5600")
    return Described(host, port)


def _in_file(path: str) -> Described:
    check_regular(path)
    try:
        with Path(path).open("rb") as file:
            text = file.read(_LARGEST_BYTES).decode("utf-8", "replace")
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror or error})") from error
    video = re.search(r"^m=video[ \t]+(\d{1,5})\S*[ \t]+RTP/AVPF?[ \t]+(\d{1,3})\b(.*?)(?=^m=|\Z)", text, re.M | re.S)
    if video is None or not 0 < int(video[1]) < 2**16:
        raise SourceError(f"{path}: describes no video over RTP; a line m=video PORT RTP/AVP TYPE is missing")
    kind = int(video[2])
    named = re.search(rf"^a=rtpmap:{kind}[ \t]+([^/\s]+)", video[3], re.M)
    coding = named[1] if named else "JPEG" if kind == JPEG_TYPE else ""
    if payload_of(coding) is None:
        raise SourceError(f"{path}: describes {coding or f'payload {kind}'}; H264, H265 and JPEG over RTP are read")
    said = re.search(rf"^a=fmtp:{kind}[ \t]+(.*)$", video[3], re.M)
    sets = re.findall(r"sprop-(?:parameter-sets|vps|sps|pps)=([^;\s]+)", said[1] if said else "")
    where = re.search(r"^c=IN IP4 ([\d.]+)", video[3] + text[: video.start()], re.M)
    host = where[1] if where and _is_group(where[1]) else ""
    return Described(host, int(video[1]), kind, coding, tuple(_decoded(",".join(sets))))


def _decoded(text: str) -> list[bytes]:
    with contextlib.suppress(ValueError):
        return [base64.b64decode(part, validate=True) for part in text.split(",") if part]
    return []


def _is_group(host: str) -> bool:
    """Whether an address is one of a multicast group."""
    return host.partition(".")[0].isdigit() and 224 <= int(host.partition(".")[0]) < 240


def packet_in(data: bytes) -> Packet | None:
    """The packet in a datagram; None for what is none, and for the sender's reports (RTCP)."""
    if len(data) < 12 or data[0] >> 6 != 2 or 200 <= data[1] <= 204:
        return None
    at, end = 12 + 4 * (data[0] & 15), len(data) - (data[-1] if data[0] & 0x20 else 0)
    if data[0] & 0x10:  # an extension, after its kind and its length in words
        at += 4 + 4 * int.from_bytes(data[at + 2 : at + 4], "big")
    if at >= end:
        return None
    sequence, stamp, source = struct.unpack_from(">HII", data, 2)
    return Packet(sequence, stamp, source, data[1] & 0x7F, bool(data[1] & 0x80), data[at:end])


class Receiver:
    """A UDP port; of several senders the first is listened to while it sends."""

    def __init__(self, wanted: Described, address: str) -> None:
        self._wanted, self.sender = wanted, ""
        self._source: tuple[str, int] | None = None
        self._heard_s = 0.0
        try:
            found = socket.getaddrinfo(wanted.host or "0.0.0.0", wanted.port, type=socket.SOCK_DGRAM)[0]
            self._socket = socket.socket(found[0], socket.SOCK_DGRAM)
        except OSError as error:
            raise SourceError(f"{address}: {wanted.host} is no address of this machine") from error
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
            if _is_group(wanted.host):
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                joined = socket.inet_aton(wanted.host) + socket.inet_aton("0.0.0.0")
                self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
            self._socket.bind(found[4])
            self._socket.settimeout(_WAIT_S)
        except OSError as error:
            self._socket.close()
            why = f"UDP port {wanted.port} cannot be listened to ({error.strerror or error}); does another program?"
            raise SourceError(f"{address}: {why}") from error

    def receive(self) -> tuple[Packet | None, bool]:
        """Wait for a packet, a moment long; and whether it is the first of a new sender."""
        try:
            data, peer = self._socket.recvfrom(2**16)
        except OSError:  # none came; or the port was closed meanwhile
            return None, False
        packet, now_s = packet_in(data), time.monotonic()
        kind = self._wanted.payload_type
        # Types from 96 on have no fixed meaning (RFC 3551).
        kinds = (JPEG_TYPE, *range(96, 128)) if kind is None else (kind,)
        if packet is None or packet.payload_type not in kinds:
            return None, False
        source = (str(peer[0]), packet.source)
        is_new = source != self._source
        if is_new and self._source is not None and now_s - self._heard_s < _NEW_SENDER_S:
            return None, False
        self._source, self._heard_s, self.sender = source, now_s, str(peer[0])
        return packet, is_new

    def close(self) -> None:
        """Let go of the port."""
        self._socket.close()


class Ordered:
    """Puts packets into their order; one that is missing is waited for, but not for long."""

    def __init__(self) -> None:
        self._next: int | None = None
        self._early: dict[int, tuple[Packet, float]] = {}
        self.lost = 0

    def put(self, packet: Packet, now_s: float) -> list[tuple[Packet, bool]]:
        """Return the packets whose turn it is, each with whether others before it are missing."""
        if self._next is None:
            self._next = packet.sequence
        ahead = (packet.sequence - self._next) % 2**16
        if 2**15 <= ahead < 2**16 - _FAR:  # the sender counts from elsewhere
            self._early.clear()
            self._next = (packet.sequence + 1) % 2**16
            return [(packet, True)]
        if ahead < 2**15:  # else it is late, or came twice
            self._early[packet.sequence] = packet, now_s
        return self._in_turn(False) + self.overdue(now_s)

    def overdue(self, now_s: float) -> list[tuple[Packet, bool]]:
        """Return the packets that have waited long enough for one before them."""
        found: list[tuple[Packet, bool]] = []
        if self._early and self._next is not None:
            is_late = now_s - min(early[1] for early in self._early.values()) > _EARLY_S
            if is_late or len(self._early) > _MOST_EARLY:
                lost, self._next = min(((number - self._next) % 2**16, number) for number in self._early)
                self.lost += lost
                found = self._in_turn(True)
        return found

    def _in_turn(self, is_after_gap: bool) -> list[tuple[Packet, bool]]:
        found: list[tuple[Packet, bool]] = []
        while self._next is not None and self._next in self._early:
            found.append((self._early.pop(self._next)[0], is_after_gap and not found))
            self._next = (self._next + 1) % 2**16
        return found
