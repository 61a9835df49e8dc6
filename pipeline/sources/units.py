"""What the units of H.264 and H.265 (ITU-T, of these names) tell of pictures and slices that are lost."""

import contextlib
import re
from collections.abc import Iterator

from dockpose.sources.rtp.relay import MARK

_USUAL = 4  # pictures in a row with slices at the same places, after which one that lacks such a slice is not whole
_HIGH = {44, 83, 86, 100, 110, 118, 122, 128, 134, 135, 138, 139, 244}  # profiles of H.264 that tell of colours too
_HEAD_BYTES = 256  # of a unit, which are looked at
_MORE = bytes(range(101, 165))  # behind a slice
_RECOVERY = 6  # kind of the message that pictures are whole from some time on


class Gaps:
    """Looks at one packet after another; FFmpeg decodes on where something is missing before it, without a word.

    H.264 numbers the pictures to which others refer. H.265 says where each slice begins, and most encoders cut all
    pictures alike.
    """

    def __init__(self, codec: str, extradata: bytes) -> None:
        self._is_h265 = codec == "hevc"
        self._prefix_bytes = 0  # of a unit's length, as in MP4; 0 where units stand behind 00 00 01
        self._bits = 0  # of a picture's number, or of a slice's place; 0 where it cannot be looked at
        self._is_dependent = False
        self._last: int | None = None  # number of the last picture to which others refer
        self._usual, self._alike = (0,), 0
        self.recovers_after: int | None = None  # so many pictures after this one all is whole, whatever came before it
        if extradata[:1] == b"\1":
            self._prefix_bytes = (extradata.ljust(22)[21 if self._is_h265 else 4] & 3) + 1
        with contextlib.suppress(ValueError, IndexError):  # of parameters that are damaged
            for unit in _sets(extradata, self._is_h265) if self._prefix_bytes else self._units(extradata):
                self._look(unit)

    def see(self, data: bytes) -> bool:
        """Whether something is missing in a picture's packet, or before it."""
        self.recovers_after = None
        if MARK in data:
            return True
        try:
            slices = [found for unit in self._units(data) if (found := self._look(unit)) is not None]
        except (ValueError, IndexError):  # what is damaged shows when it is decoded
            return False
        if not slices or not self._bits:
            return False
        return self._lacks_slice(tuple(slices)) if self._is_h265 else self._is_after_gap(slices[0])

    def _is_after_gap(self, number: int) -> bool:
        last, most = self._last, 1 << self._bits
        is_reference, number = bool(number & most), number & most - 1
        self._last = number if is_reference else last
        return last is not None and (number - last) % most > 1

    def _lacks_slice(self, places: tuple[int, ...]) -> bool:
        if self._alike >= _USUAL and set(places) < set(self._usual):
            return True
        self._usual, self._alike = places, self._alike + 1 if places == self._usual else 1
        return False

    def _look(self, unit: bytes) -> int | None:
        """Read a unit; of a slice its picture's number, with a bit above it for one to which others refer, or place."""
        if len(unit) < 3:
            return None
        kind = unit[0] >> 1 & 63 if self._is_h265 else unit[0] & 31
        bits = _Bits(unit[2 if self._is_h265 else 1 :])
        if kind == (39 if self._is_h265 else 6):
            self._read_message(bits)
        elif self._is_h265:
            return self._look_h265(kind, bits)
        elif kind == 7:
            self._bits = _number_bits(bits)
        elif kind in (1, 2, 5) and self._bits:
            bits.numbers(3)  # where it begins, its kind, and its parameter set
            number = bits.take(self._bits)
            if kind == 5:
                self._last = None  # pictures are counted anew
            return number | bool(unit[0] & 0x60) << self._bits
        return None

    def _look_h265(self, kind: int, bits: "_Bits") -> int | None:
        if kind == 33:
            self._bits = _place_bits(bits)
        elif kind == 34:
            bits.numbers(2)
            self._is_dependent = bool(bits.take(1))
        elif kind < 32 and self._bits:
            is_first = bits.take(1)
            bits.take(16 <= kind < 24)
            bits.numbers(1)
            return 0 if is_first else bits.take(self._is_dependent + self._bits) & (1 << self._bits) - 1
        return None

    def _read_message(self, bits: "_Bits") -> None:
        while bits.left > 16:
            kind, size = bits.long(), bits.long()
            if kind == _RECOVERY:
                count = bits.numbers(1)
                self.recovers_after = (count + 1) // 2 if self._is_h265 else count
            bits.take(min(8 * size, bits.left))

    def _units(self, data: bytes) -> Iterator[bytes]:
        at, size = 0, self._prefix_bytes
        if not size:
            begins = [match.end() for match in re.finditer(b"\0\0\1", data)]
            yield from (data[begin : begin + _HEAD_BYTES] for begin in begins)
        while size and at + size < len(data):
            begin = at + size
            at = begin + int.from_bytes(data[at:begin], "big")
            yield data[begin : min(at, begin + _HEAD_BYTES)]


def lengthened(data: bytes) -> bytes:
    """A packet of H.265 with further bytes behind each slice, which a decoder reaches only where that is cut."""
    first, *units = data.split(b"\0\0\1")
    more = (each.rstrip(b"\0") + _MORE if each[:1] < b"\x40" else each for each in units)  # slices by their kinds
    return b"\0\0\1".join([first, *more])


class _Bits:
    """Bits of a unit in their order."""

    def __init__(self, data: bytes) -> None:
        plain = data.replace(b"\0\0\3", b"\0\0")
        self._value, self.left = int.from_bytes(plain, "big"), 8 * len(plain)

    def take(self, count: int) -> int:
        self.left -= count
        if self.left < 0:
            raise ValueError("the unit ends")
        return self._value >> self.left & (1 << count) - 1

    def numbers(self, count: int) -> int:
        """Read numbers of variable length (Exp-Golomb), and return the last."""
        number = 0
        for _ in range(count):
            zeros = 0
            while not self.take(1):
                zeros += 1
            number = (1 << zeros) - 1 + self.take(zeros)
        return number

    def long(self) -> int:
        """Read a number in bytes, of which those of 255 go on."""
        number = byte = self.take(8)
        while byte == 255:
            number += (byte := self.take(8))
        return number


def _number_bits(bits: _Bits) -> int:
    """How many bits the number of a picture of H.264 has; 0 where numbers may be missing, or are not reached."""
    profile = bits.take(8)
    bits.take(16)
    bits.numbers(1)
    if profile in _HIGH:
        if bits.numbers(1) == 3 and bits.take(1):  # colours apart: two bits more before the number
            return 0
        bits.numbers(2)
        if bits.take(2) & 1:  # matrices follow
            return 0
    count = bits.numbers(1) + 4
    order = bits.numbers(1)
    if order == 1:
        bits.take(1)
        bits.numbers(2)
        bits.numbers(bits.numbers(1))
    else:
        bits.numbers(order == 0)
    bits.numbers(1)
    return 0 if bits.take(1) else count


def _place_bits(bits: _Bits) -> int:
    """How many bits the place of a slice of H.265 has."""
    bits.take(4)
    layers = bits.take(3)
    bits.take(1 + 96)
    there = [bits.take(2) for _ in range(8)][:layers] if layers else []
    for one in there:
        bits.take(88 * (one >> 1) + 8 * (one & 1))
    bits.numbers(1)
    if bits.numbers(1) == 3:
        bits.take(1)
    width, height = bits.numbers(1), bits.numbers(1)
    bits.numbers(4 * bits.take(1))
    bits.numbers(3)
    bits.numbers(3 * (layers + 1 if bits.take(1) else 1))
    block = 8 << bits.numbers(1)
    block <<= bits.numbers(1)
    return (-(-width // block) * -(-height // block) - 1).bit_length()


def _sets(extradata: bytes, is_h265: bool) -> Iterator[bytes]:
    """The parameter sets in the head of an MP4 or Matroska file (ISO 14496-15)."""
    at, arrays = (23, extradata[22]) if is_h265 else (5, 1)
    for _ in range(arrays):
        at += 3 if is_h265 else 1
        count = int.from_bytes(extradata[at - 2 : at], "big") if is_h265 else extradata[5] & 31
        for _ in range(count):
            size = int.from_bytes(extradata[at : at + 2], "big")
            yield extradata[at + 2 : at + 2 + size]
            at += 2 + size
