"""What RTP packets carry, put together again: H.264 (RFC 6184), H.265 (RFC 7798) and JPEG (RFC 2435)."""

import struct
from collections.abc import Iterator, Sequence

import cv2
import numpy as np

_START = b"\0\0\0\1"  # of a unit, where they follow each other in a stream of bytes
JPEG_TYPE = 26  # the payload type of JPEG, the one that has a number of its own (RFC 3551)


class _Units:
    """Units of H.264 or H.265 as packets bring them: whole, several in one, or in parts; those of one picture."""

    codec: str
    clock_hz = 90_000
    is_each_whole = False  # whether each picture can be decoded without the one before it
    _head: int  # bytes of a unit's head
    _several: int
    _part: int
    _keys: frozenset[int]  # kinds with which decoding can begin
    _sets: tuple[int, ...]  # kinds of the parameter sets

    def __init__(self) -> None:
        self.sets: dict[int, bytes] = {}  # the parameter sets that came last, by kind
        self.begin()

    def begin(self) -> None:
        """Forget what came of a picture."""
        self._units: list[bytearray] = []
        self._is_open = False

    def kind(self, unit: bytes) -> int:
        """Kind of a unit, by its head."""
        raise NotImplementedError

    def add(self, payload: bytes) -> None:
        """Take a packet's payload. Raises ValueError for what is none."""
        kind = self.kind(payload) if len(payload) > self._head else -1
        if kind == self._several:
            self._units += map(bytearray, _lengths(payload[self._head :]))
        elif kind == self._part:
            self._add_part(payload)
        elif kind in range(self._several):
            self._units.append(bytearray(payload))
        else:
            raise ValueError(f"a payload of kind {kind}")

    def _add_part(self, payload: bytes) -> None:
        about, rest = payload[self._head], payload[self._head + 1 :]
        if about & 0x80:
            self._units.append(bytearray(self._whole_head(payload, about)) + rest)
        elif self._is_open:
            self._units[-1] += rest
        else:
            raise ValueError("a part without its beginning")
        self._is_open = not about & 0x40

    def _whole_head(self, payload: bytes, about: int) -> bytes:
        raise NotImplementedError

    def finish(self) -> tuple[bytes, bool]:
        """The picture's bytes, and whether decoding can begin with it, with all parameter sets then before it."""
        if self._is_open or not self._units:
            raise ValueError("a unit without its end")
        units = [bytes(unit) for unit in self._units]
        kinds = [self.kind(unit) for unit in units]
        self.sets.update((kind, unit) for kind, unit in zip(kinds, units, strict=True) if kind in self._sets)
        is_key = bool(self._keys & set(kinds)) and all(kind in self.sets for kind in self._sets)
        if is_key:
            units = [*(self.sets[kind] for kind in self._sets if kind not in kinds), *units]
        return b"".join(_START + unit for unit in units), is_key

    def remember(self, units: Sequence[bytes]) -> None:
        """Take parameter sets that a description brings."""
        self.sets.update((self.kind(unit), unit) for unit in units if len(unit) > self._head)


class H264(_Units):
    """H.264: a kind of unit in the last five bits of its first byte."""

    codec = "h264"
    _head, _several, _part, _keys, _sets = 1, 24, 28, frozenset({5}), (7, 8)

    def kind(self, unit: bytes) -> int:
        """Kind of a unit, by its head."""
        return unit[0] & 0x1F

    def _whole_head(self, payload: bytes, about: int) -> bytes:
        return bytes([payload[0] & 0xE0 | about & 0x1F])


class H265(_Units):
    """H.265: a kind of unit in six bits of its first byte."""

    codec = "hevc"
    _head, _several, _part, _keys, _sets = 2, 48, 49, frozenset(range(16, 22)), (32, 33, 34)

    def kind(self, unit: bytes) -> int:
        """Kind of a unit, by its head."""
        return unit[0] >> 1 & 0x3F

    def _whole_head(self, payload: bytes, about: int) -> bytes:
        return bytes([payload[0] & 0x81 | (about & 0x3F) << 1, payload[1]])


class Jpeg:
    """JPEG, of which packets leave the head out; Huffman's tables are the usual ones, which decoders know."""

    codec = "mjpeg"
    clock_hz = 90_000
    is_each_whole = True

    def __init__(self) -> None:
        self._tables: dict[int, bytes] = {}
        self.sets: dict[int, bytes] = {}  # it has none
        self.begin()

    def begin(self) -> None:
        """Forget what came of a picture."""
        self._head, self._scan = b"", bytearray()

    def add(self, payload: bytes) -> None:
        """Take a packet's payload. Raises ValueError for what is none, and where parts are missing before it."""
        if len(payload) < 8:
            raise ValueError("a payload without its head")
        offset, kind, quality = int.from_bytes(payload[1:4], "big"), payload[4], payload[5]
        size, at, interval = (8 * payload[6], 8 * payload[7]), 8, 0
        if offset != len(self._scan):
            raise ValueError("a part without its beginning")
        if 64 <= kind < 128:
            interval, at = int.from_bytes(payload[8:10], "big"), 12
        if kind & 0x3F > 1 or not all(size):
            raise ValueError(f"JPEG of type {kind}")
        if offset == 0:
            if quality >= 128:
                length = int.from_bytes(payload[at + 2 : at + 4], "big")
                at += 4
                if length:
                    self._tables[quality] = payload[at : at + length]
                at += length
            self._head = _jpeg_head(size, kind & 1, interval, self._quantisers(quality))
        self._scan += payload[at:]

    def finish(self) -> tuple[bytes, bool]:
        """The picture's bytes, and that decoding can begin with it."""
        if not self._head:
            raise ValueError("a part without its beginning")
        return self._head + bytes(self._scan) + b"\xff\xd9", True

    def remember(self, units: Sequence[bytes]) -> None:
        """There is nothing to remember."""

    def _quantisers(self, quality: int) -> bytes:
        """Both tables of 64 bytes, in zigzag order."""
        if quality < 128 and quality not in self._tables:
            # The scale of the RFC is that of every encoder; ours writes the tables as they are to be.
            jpeg = cv2.imencode(".jpg", np.zeros((8, 8, 3), np.uint8), [cv2.IMWRITE_JPEG_QUALITY, quality])[1].tobytes()
            parts = jpeg.split(b"\xff\xdb\0\x43")[1:]
            self._tables[quality] = b"".join(part[1:65] for part in parts[:2])
        tables = self._tables.get(quality, b"")
        if len(tables) not in (64, 128):
            raise ValueError("JPEG without its tables")
        return (2 * tables)[:128]  # FFmpeg sends one for brightness and colour


Payload = H264 | H265 | Jpeg


def _jpeg_head(size: tuple[int, int], is_halved: int, interval: int, tables: bytes) -> bytes:
    """Everything before the scan (ITU-T T.81, annex B)."""
    quantisers = b"".join(b"\xff\xdb\0\x43" + bytes([n]) + tables[64 * n : 64 * n + 64] for n in range(2))
    restarts = b"\xff\xdd\0\4" + struct.pack(">H", interval) if interval else b""
    colours = bytes([1, 0x22 if is_halved else 0x21, 0, 2, 0x11, 1, 3, 0x11, 1])
    frame = b"\xff\xc0\0\x11\x08" + struct.pack(">HH", size[1], size[0]) + b"\3" + colours
    return b"\xff\xd8" + quantisers + restarts + frame + b"\xff\xda\0\x0c\3" + bytes([1, 0, 2, 17, 3, 17, 0, 63, 0])


def _lengths(data: bytes) -> Iterator[bytes]:
    """The units in a packet of several, each after its length in two bytes."""
    at = 0
    while at < len(data):
        length = int.from_bytes(data[at : at + 2], "big")
        if length == 0 or at + 2 + length > len(data):
            raise ValueError("a unit longer than its packet")
        yield data[at + 2 : at + 2 + length]
        at += 2 + length


_OF_H264 = {1, 5, 7, 8, 24, 28}
_OF_H265 = {0, 1, 19, 20, 21, 32, 33, 34, 48, 49}


def payload_of(name: str) -> Payload | None:
    """What puts a coding together, by its name in a description; None for others."""
    kinds: dict[str, type[Payload]] = {"H264": H264, "H265": H265, "JPEG": Jpeg}
    return kinds[name.upper()]() if name.upper() in kinds else None


def name_of(payload_type: int, payload: bytes) -> str | None:
    """The name of the coding that a payload shows, where no description says it; None where it may be either."""
    if payload_type == JPEG_TYPE:
        return "JPEG"
    if len(payload) < 3:
        return None
    is_h264 = not payload[0] & 0x80 and payload[0] & 0x1F in _OF_H264
    is_h265 = payload[0] & 0x81 == 0 and payload[1] == 1 and payload[0] >> 1 in _OF_H265
    return None if is_h264 == is_h265 else "H264" if is_h264 else "H265"
