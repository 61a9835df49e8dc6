"""Packets of RTP (RFC 3550) from a UDP port, in their order."""

import math
import socket
import struct
import time
from typing import NamedTuple

from dockpose.sources.frames import SourceError

_BUFFER_BYTES = 2**22  # that the system keeps while a picture is decoded: seconds of them
_WAIT_S = 0.2
_LEAST_TYPE = 96  # of a payload; those below have fixed meanings, none of them H.264 or H.265 (RFC 3551)
# What those are, as far as they are pictures; further down is sound.
_OTHERS = {26: "JPEG", 28: "nv", 31: "H.261", 32: "MPEG video", 33: "MPEG-TS", 34: "H.263"}
_NEW_SENDER_S = 1.0  # of silence, after which another one is listened to
_MOST_EARLY = 8  # packets that come while a late one is waited for: half a picture of a BlueROV
_FAR = 1000  # packets; a sender that goes back by more has begun anew


class Packet(NamedTuple):
    """A packet."""

    sequence: int
    stamp: int
    source: int
    payload_type: int
    is_last: bool  # of its picture
    payload: bytes


def is_multicast(host: str) -> bool:
    """Whether an address is one of a multicast group."""
    first = host.partition(".")[0]
    return first.isdigit() and 224 <= int(first) < 240


def packet_in(data: bytes) -> Packet | None:
    """The packet in a datagram; None for other data, and for the sender's reports (RTCP)."""
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

    def __init__(self, address: str, host: str, port: int) -> None:
        self.sender = ""
        self._source: tuple[str, int] | None = None
        self.heard_s = -math.inf  # when a packet came last
        self.other, self.other_s = "", -math.inf  # what else came, in words, and when
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, _BUFFER_BYTES)
            if is_multicast(host):
                self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
                joined = socket.inet_aton(host) + socket.inet_aton("0.0.0.0")
                self._socket.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP, joined)
            self._socket.bind((host, port))
            self._socket.settimeout(_WAIT_S)
        except OSError as error:
            self._socket.close()
            why = f"UDP port {port} cannot be listened to ({error.strerror or error}); does another program?"
            raise SourceError(f"{address}: {why}") from error

    def receive(self) -> tuple[Packet | None, bool]:
        """Wait for a packet, a moment long; and whether it is the first of a new sender."""
        try:
            data, peer = self._socket.recvfrom(2**16)
        except OSError:  # none came; or the port was closed meanwhile
            return None, False
        packet, now_s = packet_in(data), time.monotonic()
        if packet is None or packet.payload_type < _LEAST_TYPE:
            if packet is not None:
                name = _OTHERS.get(packet.payload_type, "neither H.264 nor H.265")
                self.other, self.other_s = f"RTP of type {packet.payload_type} ({name})", now_s
            elif data[:1] == b"\x47" and len(data) % 188 == 0:
                self.other, self.other_s = "MPEG-TS without RTP, which udp:// in place of rtp:// reads,", now_s
            return None, False
        source = (str(peer[0]), packet.source)
        is_new = source != self._source
        if is_new and now_s - self.heard_s < _NEW_SENDER_S:
            return None, False
        self._source, self.heard_s, self.sender = source, now_s, str(peer[0])
        return packet, is_new

    def close(self) -> None:
        """Let go of the port."""
        self._socket.close()


class Ordered:
    """Puts packets into their order; one that is missing is waited for until a few later ones have come."""

    def __init__(self) -> None:
        self._next: int | None = None
        self._early: dict[int, Packet] = {}
        self.lost = 0

    def put(self, packet: Packet) -> list[tuple[Packet, bool]]:
        """Return the packets whose turn it is, each with whether others before it are missing."""
        self._next = packet.sequence if self._next is None else self._next
        ahead = (packet.sequence - self._next) % 2**16
        if 2**15 <= ahead < 2**16 - _FAR:  # the sender counts from elsewhere
            self._early.clear()
            self._next = (packet.sequence + 1) % 2**16
            return [(packet, True)]
        if ahead < 2**15:  # else it is late, or came twice
            self._early[packet.sequence] = packet
        in_turn: list[tuple[Packet, bool]] = []
        while self._early:
            is_missing = self._next not in self._early
            if is_missing:
                if len(self._early) < _MOST_EARLY:
                    break
                lost, self._next = min(((number - self._next) % 2**16, number) for number in self._early)
                self.lost += lost
            in_turn.append((self._early.pop(self._next), is_missing))
            self._next = (self._next + 1) % 2**16
        return in_turn
