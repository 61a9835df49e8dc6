"""Video in bags: a packet of H.264 or H.265 in each message, with the bag's times."""

import struct
from collections.abc import Callable
from typing import Any

import av
from av.codec.context import Flags
from av.error import FFmpegError
from dockpose.sources.frames import SourceError

FOXGLOVE, FOXGLOVE_ROS = "foxglove.CompressedVideo", "foxglove_msgs/msg/CompressedVideo"
FFMPEG_PACKET = "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"
VIDEO = {(FOXGLOVE, "protobuf"), (FOXGLOVE_ROS, "cdr"), (FFMPEG_PACKET, "cdr")}  # types, and how they are serialised
DEFINITIONS = {
    FOXGLOVE_ROS: "builtin_interfaces/Time timestamp\nstring frame_id\nuint8[] data\nstring format\n",
    FFMPEG_PACKET: "std_msgs/Header header\nint32 width\nint32 height\nstring encoding\nuint64 pts\nuint8 flags\n"
    "bool is_bigendian\nuint8[] data\n",
}
_NEAR, _KEPT = 64, 32  # frames this far ahead are reached by reading on; so many that were decoded are kept
_CODECS = {"264": "h264", "avc": "h264", "265": "hevc", "hevc": "hevc"}
# Kinds of units with which decoding can begin: pictures of their own, and the sets of parameters before them.
_KEYS = {"h264": {5, 7}, "hevc": {*range(16, 22), 32, 33}}


class Packet:
    """A packet in a message, whatever type that has."""

    def __init__(self, message: Any) -> None:
        self.data = bytes(memoryview(message.data))
        name = getattr(message, "format", None) or getattr(message, "encoding", "")
        found = [codec for part, codec in _CODECS.items() if part in name.lower()]
        if not found:
            raise SourceError(f"has video of the format {name!r}; h264 and h265 are read")
        self.codec = found[0]

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
        self._context: Any = None
        self._fault = ""  # of the last message that could not be read

    def frame(self, index: int) -> av.VideoFrame:
        """The frame of a packet. Raises SourceError where it cannot be decoded."""
        if index not in self._done and not self._next <= index <= self._next + _NEAR:
            self._begin(index)
        while index not in self._done and self._next <= self._count and self._next <= index + _KEPT:
            self._decode()
        if index not in self._done:
            raise SourceError(self._fault or "its packet is damaged, or no key frame came before it")
        return self._done[index]

    def _begin(self, index: int) -> None:
        """Go to the last key frame up to that number."""
        self._next = next((at for at in range(index, -1, -1) if self._is_key(at)), index)
        self._context, self._fault = None, ""
        self._done.clear()

    def _is_key(self, index: int) -> bool:
        try:
            return self._read(index).is_key
        except SourceError:
            return False

    def _decode(self) -> None:
        """Decode one more packet, or at the end what the decoder holds back."""
        number, self._next = self._next, self._next + 1
        try:
            if number == self._count:
                frames = [] if self._context is None else self._context.decode(None)
            else:
                frames = self._frames_of(number)
        except FFmpegError:
            return
        except SourceError as error:
            self._fault = str(error)
            return
        for frame in frames:
            if frame.pts is not None and not frame.is_corrupt:
                self._done[frame.pts] = frame
        while len(self._done) > _KEPT:
            self._done.pop(min(self._done))

    def _frames_of(self, number: int) -> list[Any]:
        packet = self._read(number)
        if self._context is None:
            self._context = av.CodecContext.create(packet.codec, "r")
            self._context.thread_count = 1
            self._context.flags |= Flags.low_delay  # no frame is held back, where none needs one that follows
        coded = av.Packet(packet.data)
        coded.pts = coded.dts = number
        return self._context.decode(coded)


class FoxgloveVideo:
    """A message ``foxglove.CompressedVideo`` in Protocol Buffers: time stamp, frame, data and format are 1 to 4."""

    def __init__(self, data: bytes) -> None:
        _, fields = _fields(data)
        stamp, _ = _fields(fields.get(1, b""))
        if max(stamp.values(), default=0) >= 1 << 32:  # beyond which ROS has no time either
            raise struct.error("a time stamp that cannot be")
        self.stamp_ns = stamp.get(1, 0) * 10**9 + stamp.get(2, 0)
        self.data, self.format = fields.get(3, b""), fields.get(4, b"").decode("utf-8", "replace")


def _fields(data: bytes) -> tuple[dict[int, int], dict[int, bytes]]:
    """The numbers and the bytes of a message, by their keys; struct.error or IndexError where it is damaged."""
    numbers, found, at = dict[int, int](), dict[int, bytes](), 0
    while at < len(data):
        key, at = _varint(data, at)
        kind = key & 7
        if kind == 0:
            numbers[key >> 3], at = _varint(data, at)
        elif kind == 2:
            length, at = _varint(data, at)
            found[key >> 3], at = data[at : at + length], at + length
        else:
            at += {1: 8, 5: 4}.get(kind, len(data) + 1)
    if at > len(data):
        raise struct.error("a field is longer than its message")
    return numbers, found


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while shift < 64:
        byte = data[at]
        value, at, shift = value | (byte & 127) << shift, at + 1, shift + 7
        if byte < 128:
            return value, at
    raise struct.error("a number without end")
