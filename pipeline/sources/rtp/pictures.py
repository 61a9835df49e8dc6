"""Pictures of H.264 (RFC 6184) and H.265 (RFC 7798), put together from RTP packets where none is missing."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from dockpose.sources.rtp.packets import Packet

_START = b"\0\0\0\1"  # of a unit, where they follow each other in a stream of bytes


class Coding(NamedTuple):
    """A video coding, whose units begin with a head that tells their kind."""

    name: str  # in a description
    codec: str  # FFmpeg's name
    head_bytes: int
    aggregate: int  # kind of a packet that holds several units
    fragment: int  # kind of a packet that holds a part of a unit
    keys: frozenset[int]  # kinds with which decoding can begin
    sets: tuple[int, ...]  # kinds of the parameter sets, in the order in which decoders want them

    def kind(self, unit: bytes) -> int:
        """Kind of a unit, by its head."""
        return unit[0] & 0x1F if self.head_bytes == 1 else unit[0] >> 1 & 0x3F

    def unit_head(self, payload: bytes) -> bytes:
        """Head of the unit of which a payload holds the first part."""
        kind = payload[self.head_bytes]
        if self.head_bytes == 1:
            return bytes([payload[0] & 0xE0 | kind & 0x1F])
        return bytes([payload[0] & 0x81 | (kind & 0x3F) << 1, payload[1]])


H264 = Coding("H264", "h264", 1, 24, 28, frozenset({5}), (7, 8))
H265 = Coding("H265", "hevc", 2, 48, 49, frozenset(range(16, 22)), (32, 33, 34))
CODINGS = {coding.name: coding for coding in (H264, H265)}
# Kinds with which senders of H.265 begin, and whose heads no unit of H.264 has.
_H265_BEGINS = {0, 1, 19, 20, 21, 32, 33, 34, 35, 39, 48, 49}


def coding_of(payload: bytes) -> Coding:
    """The coding that a payload shows, where no description names it."""
    has_head = len(payload) > 2 and not payload[0] & 0x81 and payload[1] == 1
    return H265 if has_head and H265.kind(payload) in _H265_BEGINS else H264


class Picture(NamedTuple):
    """A picture whose packets all came, and all of those that it depends on."""

    data: bytes
    is_key: bool  # whether decoding can begin with it


class Assembly:
    """A picture is left out if a packet of it is lost, and those after it until the next that begins by itself.

    What a decoder makes up for lost packets looks like a picture, and has lights where they were before.
    """

    def __init__(self, coding: Coding, sets: Sequence[bytes] = ()) -> None:
        self.coding = coding
        self.sets = {coding.kind(unit): unit for unit in sets if len(unit) > coding.head_bytes}  # the newest, by kind
        self.left_out = 0
        self._stamp: int | None = None  # of the picture that is open
        self._units: list[bytearray] = []
        self._is_cut = False  # whether the last unit lacks its end
        # Nobody knows how many packets were before the first.
        self._needs_key = self._is_damaged = True

    def take(self, packet: Packet, is_after_gap: bool) -> list[Picture]:
        """Take the next packet; returns the pictures that are complete with it."""
        complete: list[Picture] = []
        self._is_damaged |= is_after_gap
        if self._stamp not in (None, packet.stamp):  # its last packet is lost, or is not marked as the last
            complete += self._finished()
            self._is_damaged |= is_after_gap
        self._stamp = packet.stamp
        if not self._is_damaged:
            try:
                self._add(packet.payload)
            except ValueError:
                self._is_damaged = True
        return complete + (self._finished() if packet.is_last else [])

    def spoil(self) -> None:
        """Begin anew with the next picture that begins by itself, since one could not be decoded."""
        self.left_out += 1
        self._needs_key = True

    def _add(self, payload: bytes) -> None:
        """Add what a payload holds; raises ValueError for what is no unit."""
        head_bytes = self.coding.head_bytes
        kind = self.coding.kind(payload) if len(payload) > head_bytes else -1
        if kind == self.coding.aggregate:
            self._units += map(bytearray, _aggregated(payload[head_bytes:]))
        elif kind == self.coding.fragment:
            flags, part = payload[head_bytes], payload[head_bytes + 1 :]
            if flags & 0x80:  # the first part
                self._units.append(bytearray(self.coding.unit_head(payload)))
            elif not self._is_cut:
                raise ValueError("a part without its beginning")
            self._units[-1] += part
            self._is_cut = not flags & 0x40
        elif 0 <= kind < self.coding.aggregate:
            self._units.append(bytearray(payload))
        else:
            raise ValueError(f"a payload of kind {kind}")

    def _finished(self) -> list[Picture]:
        """The open picture, if it is complete, with all parameter sets where decoding can begin with it."""
        units = [bytes(unit) for unit in self._units]
        is_damaged = self._is_damaged or self._is_cut or not units
        self._stamp, self._units, self._is_cut, self._is_damaged = None, [], False, False
        kinds = [self.coding.kind(unit) for unit in units]
        is_key = False
        if not is_damaged:
            self.sets.update((kind, unit) for kind, unit in zip(kinds, units, strict=True) if kind in self.coding.sets)
            is_key = not self.coding.keys.isdisjoint(kinds) and all(kind in self.sets for kind in self.coding.sets)
        self._needs_key = (self._needs_key or is_damaged) and not is_key
        if self._needs_key:
            self.left_out += 1
            return []
        if is_key:
            units = [*(self.sets[kind] for kind in self.coding.sets if kind not in kinds), *units]
        return [Picture(b"".join(_START + unit for unit in units), is_key)]


def _aggregated(data: bytes) -> Iterator[bytes]:
    """The units in a packet of several, each after its length in two bytes."""
    while data:
        end = 2 + int.from_bytes(data[:2], "big")
        if not 2 < end <= len(data):
            raise ValueError("a unit longer than its packet")
        yield data[2:end]
        data = data[end:]
