"""Decoding that gives no picture which a decoder made up, in whole or in part, for what is damaged or lost."""

import contextlib
from collections import deque
from collections.abc import Collection
from typing import Any

import av
import numpy as np
from av.error import FFmpegError
from dockpose.sources.ffmpeg import picture_of
from dockpose.sources.units import Gaps, lengthened

_CODINGS = {"h264", "hevc"}  # whose packets are looked into, and whose decoders begin where pictures are whole
# Whose decoders begin with pictures that lack what they refer to.
_BEGIN_ANYWHERE = {"mpeg1video", "mpeg2video", "mpeg4"}
_MOST_WAITING = 1000  # packets of which no frame came so far
_MOST_HELD = 16  # as many as pictures to which others may refer
_BEGINS, _ENDS = b"\xff\xda", b"\xff\xd9"  # of the pixels and of the whole in JPEG


class Guard:
    """Decodes packets; from one that is damaged, or misses others before it, until the next key frame nothing is given.

    What a decoder fills gaps with looks good and has lights where they were before, and so have the pictures that are
    predicted from it. Where pictures are coded each by itself, the damaged one alone is left out. Where there are no
    key frames (intra refresh), a message in the stream says from when on all is whole. FFmpeg's decoder of H.265 reads
    on behind the end of a slice that is cut, without a word: where nothing else tells of that (``is_bare``), all is
    decoded once more with other bytes behind each slice, which change no picture that is whole.
    """

    def __init__(
        self,
        context: av.VideoCodecContext,
        *,
        is_late: bool = False,
        damaged: Collection[int] | None = None,
        is_bare: bool = False,
    ):
        self._context, self._damaged = context, damaged
        self._other: Any = None
        if is_bare and context.name == "hevc":
            self._other = av.CodecContext.create("hevc", "r")
            self._other.thread_count, self._other.flags = 1, context.flags
        self._others = dict[int | None, np.ndarray]()  # its pictures by their time stamps
        self._is_jpeg, self._is_late, self._was_corrupt = context.name == "mjpeg", is_late, False
        if self._is_jpeg and not context.is_open:
            context.options = {**context.options, "err_detect": "explode"}  # where pixels end before the end mark
        self._gaps = Gaps(context.name, bytes(context.extradata or b"")) if context.name in _CODINGS else None
        self._number = 0  # of packets so far
        self._numbers = dict[int | None, int]()  # of packets by their time stamps, until their frames come
        self._bad = list[int]()  # numbers of packets from which on pictures are not whole
        # Number of the packet from which on all must be good: of the last key frame.
        self._since = None if context.name in _BEGIN_ANYWHERE else 0
        self._recovering: tuple[int, int] | None = None  # numbers of the packets where that begins, and is done
        self._held = deque[tuple[int | None, int, av.VideoFrame]]()  # with the number of each, which are to be given
        self.left_out = 0  # pictures so far
        self.failures = 0  # packets in a row that could not be decoded
        self.has_lost_end = False  # whether threads lost what came after a damaged packet, among the last ones

    def decode(self, packet: av.Packet | None) -> list[av.VideoFrame]:
        """The whole pictures that come with a packet, or at the end with none or an empty one."""
        number, is_end = self._number, packet is None or packet.size == 0
        if packet is not None and not is_end:
            self._numbers[packet.pts], self._number = number, number + 1
            if len(self._numbers) > _MOST_WAITING:
                del self._numbers[next(iter(self._numbers))]
            if self._is_damaged(packet):
                self._bad.append(number)
        try:
            frames = self._context.decode(packet)
            self.failures = 0
        except FFmpegError:
            self.has_lost_end = is_end
            # Of several threads that tell in turn, the others have begun later ones.
            self._bad.append(number + 1 - (self._context.thread_count if self._context.thread_type.value & 1 else 1))
            self.left_out, self.failures, frames = self.left_out + 1, self.failures + 1, []
        if self._other is not None:
            self._decode_otherwise(packet, is_end)
        for frame in frames:
            if isinstance(frame, av.VideoFrame):
                self._take(frame)
        whole = []
        # Pictures may be shown before one to which they refer, of which it is not known yet whether it is damaged.
        while self._held and (
            is_end
            or len(self._held) > _MOST_HELD
            or all(waiting > self._held[0][1] for waiting in self._numbers.values())
        ):
            since, number, frame = self._held.popleft()
            if since is None or any(since <= bad <= number for bad in self._bad):
                self.left_out += 1
            else:
                whole.append(frame)
        return whole

    @property
    def held(self) -> int:
        """How many pictures wait for others that are decoded."""
        return len(self._held)

    def miss(self) -> None:
        """Note that a packet is missing before the next one."""
        self._bad.append(self._number)

    def _decode_otherwise(self, packet: av.Packet | None, is_end: bool) -> None:
        other = None
        if packet is not None and not is_end:
            other = av.Packet(lengthened(bytes(packet)))
            other.pts, other.dts = packet.pts, packet.dts
        with contextlib.suppress(FFmpegError):
            self._others |= {frame.pts: picture_of(frame, grey=True) for frame in self._other.decode(other)}
        while len(self._others) > _MOST_HELD:  # of packets of which no picture came
            del self._others[next(iter(self._others))]

    def _take(self, frame: av.VideoFrame) -> None:
        number = self._numbers.pop(frame.pts, self._number - 1)
        is_same = self._other is None or np.array_equal(self._others.pop(frame.pts, 0), picture_of(frame, grey=True))
        if frame.is_corrupt or not is_same:
            self._bad.append(number)
        if self._recovering is not None and number >= self._recovering[1]:
            self._since, self._recovering = max(self._since or 0, self._recovering[0]), None
        if frame.key_frame:
            least = min(number, self._held[0][0] or 0) if self._held else number
            self._bad, self._since = [bad for bad in self._bad if bad >= least], number
            self._numbers = {stamp: other for stamp, other in self._numbers.items() if other > number}
        self._held.append((self._since, number, frame))

    def _is_damaged(self, packet: av.Packet) -> bool:
        # FFmpeg marks the packet before the damaged one in MPEG-TS.
        is_corrupt, self._was_corrupt = self._was_corrupt if self._is_late else packet.is_corrupt, packet.is_corrupt
        if self._damaged is not None:
            is_corrupt = packet.pts in self._damaged
        if self._is_jpeg:
            data = bytes(packet)
            return is_corrupt or data.rfind(_ENDS) <= data.rfind(_BEGINS)
        if self._gaps is None:
            return is_corrupt
        is_corrupt |= self._gaps.see(bytes(packet))
        if self._gaps.recovers_after and self._recovering is None:
            self._recovering = self._number - 1, self._number - 1 + self._gaps.recovers_after
        return is_corrupt
