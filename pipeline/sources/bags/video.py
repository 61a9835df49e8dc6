"""Video in bags: a packet of H.264 or H.265 in each message, with the bag's times."""

from collections.abc import Callable
from typing import Any

import av
from av.codec.context import Flags
from dockpose.sources.frames import SourceError
from dockpose.sources.guard import Guard
from dockpose.sources.rtp.pictures import coding_of

_NEAR, _KEPT = 64, 32  # frames this far ahead are reached by reading on; so many that were decoded are kept
_CODECS = {"264": "h264", "avc": "h264", "265": "hevc", "hevc": "hevc"}
# Kinds of units with which decoding can begin: pictures of their own, and the sets of parameters before them.
_KEYS = {"h264": {5, 7}, "hevc": {*range(16, 22), 32, 33}}


def codec_of(name: str) -> str | None:
    """The coding that a message names, whatever it calls it; None where it names none that is read."""
    return next((codec for part, codec in _CODECS.items() if part in name.lower()), None)


def codec_by(data: bytes) -> str | None:
    """The coding of a packet by its first unit, behind 00 00 01; None of what is none."""
    head, start, _ = data[:5].partition(b"\0\0\1")
    return coding_of(data[len(head) + 3 :]).codec if start and not head.strip(b"\0") else None


class Packet:
    """A packet in a message, whatever type that has."""

    def __init__(self, message: Any) -> None:
        self.data = bytes(memoryview(message.data))
        name = getattr(message, "format", None) or getattr(message, "encoding", "")
        codec = codec_of(name) or codec_by(self.data)
        if codec is None:
            raise SourceError(f"has video of the format {name!r}; h264 and h265 are read")
        self.codec = codec

    @property
    def is_key(self) -> bool:
        """Whether decoding can begin with it; units stand behind 00 00 01."""
        units = self.data.split(b"\0\0\1")[1:]
        kinds = {unit[0] & 31 if self.codec == "h264" else unit[0] >> 1 & 63 for unit in units if unit}
        return bool(kinds & _KEYS[self.codec])


class Packets:
    """Decodes a topic's packets, of which ``read`` returns one by its number, in order or from any frame on."""

    def __init__(self, count: int, read: Callable[[int], Packet]) -> None:
        self._count, self._read = count, read
        self._next, self._done = -1 - _NEAR, dict[int, av.VideoFrame]()
        self._guard: Guard | None = None
        self._fault = ""  # of the last message that could not be read

    def frame(self, index: int) -> av.VideoFrame:
        """The frame of a packet. Raises SourceError where it cannot be decoded."""
        if index not in self._done and not self._next <= index <= self._next + _NEAR:
            self._begin(index)
        while index not in self._done and self._next <= self._count and self._next <= index + _KEPT:
            self._decode()
        if index not in self._done:
            raise SourceError(self._fault or "has a damaged packet, or no key frame came before it")
        return self._done[index]

    def _begin(self, index: int) -> None:
        """Go to the last key frame up to that number."""
        self._next = next((at for at in range(index, -1, -1) if self._is_key(at)), index)
        self._guard, self._fault = None, ""
        self._done.clear()

    def first_key(self) -> int:
        """The number of the first packet with which decoding can begin; 0 where there is none."""
        return next((at for at in range(self._count) if self._is_key(at)), 0)

    def _is_key(self, index: int) -> bool:
        try:
            return self._read(index).is_key
        except SourceError:
            return False

    def _decode(self) -> None:
        """Decode one more packet, or at the end what the decoder holds back."""
        number, self._next = self._next, self._next + 1
        try:
            packet = None if number == self._count else self._read(number)
        except SourceError as error:
            self._fault = str(error)
            if self._guard is not None:
                self._guard.miss()
            return
        for frame in self._frames_of(packet, number):
            if frame.pts is not None:
                self._done[frame.pts] = frame
        while len(self._done) > _KEPT:
            self._done.pop(min(self._done))

    def _frames_of(self, packet: Packet | None, number: int) -> list[av.VideoFrame]:
        if packet is None:
            return [] if self._guard is None else self._guard.decode(None)
        if self._guard is None:
            context: Any = av.CodecContext.create(packet.codec, "r")
            context.thread_count = 1
            context.flags |= Flags.low_delay  # no frame is held back, where none needs one that follows
            self._guard = Guard(context, is_bare=True)
        coded = av.Packet(packet.data)
        coded.pts = coded.dts = number
        return self._guard.decode(coded)
