"""An RTP sender as a source of pictures that may come later, go, and come back."""

import io
import math
import time
from collections import deque
from fractions import Fraction
from typing import NamedTuple

import av
from av.codec.context import Flags
from av.error import FFmpegError
from dockpose.sources.capture import Capture
from dockpose.sources.ffmpeg import opened
from dockpose.sources.frames import Tell
from dockpose.sources.rtp.packets import Ordered, Packet, Receiver, described
from dockpose.sources.rtp.payload import Payload, name_of, payload_of

_MICROSECOND = Fraction(1, 1_000_000)
_DRIFT = 0.1  # the most that the sender's clock goes off ours: some count frames at a rate that they do not keep
_CLOCK_WAS_SET_S = 5.0
_SILENT_S = 2.0  # after which the sender counts as gone
_TELL_EVERY_S = 10.0


class Whole(NamedTuple):
    """A picture whose packets all came, and all of those that it depends on."""

    data: bytes
    is_key: bool  # whether decoding can begin with it
    begins: bool  # whether it does, there being nothing before it, or not all
    sent_s: float  # by the sender's clock


class Assembly:
    """A picture is left out if a packet of it is lost, and those after it until the next that begins by itself.

    What a decoder makes up for lost packets looks like a picture, and has lights where they were before.
    """

    def __init__(self, payload: Payload) -> None:
        self._payload = payload
        self.left_out = 0
        self._ticks = 0
        self._before: int | None = None  # stamp of the packet before
        self._is_open = False
        # Nobody knows how many packets were before the first.
        self._needs_key, self._is_damaged = True, not payload.is_each_whole

    def take(self, packet: Packet, is_after_gap: bool) -> list[Whole]:
        """Take the next packet; returns what is whole with it."""
        whole: list[Whole] = []
        if self._is_open and packet.stamp != self._before:  # its last packet is lost, or is not marked as the last
            self._is_damaged |= is_after_gap
            whole += self._finished()
        self._is_damaged |= is_after_gap and not self._payload.is_each_whole  # which notices what is missing
        step = 0 if self._before is None else (packet.stamp - self._before + 2**31) % 2**32 - 2**31
        self._ticks, self._before, self._is_open = self._ticks + step, packet.stamp, True
        if not self._is_damaged:
            try:
                self._payload.add(packet.payload)
            except ValueError:
                self._is_damaged = True
        return whole + (self._finished() if packet.is_last else [])

    def spoil(self) -> None:
        """Begin anew with the next picture that begins by itself, since one could not be decoded."""
        self.left_out += 1
        self._needs_key = True

    def _finished(self) -> list[Whole]:
        """The picture that is open, if it is whole."""
        is_damaged, self._is_damaged, self._is_open = self._is_damaged, False, False
        try:
            data, is_key = (b"", False) if is_damaged else self._payload.finish()
        except ValueError:
            is_damaged, data, is_key = True, b"", False
        self._payload.begin()
        self._needs_key |= is_damaged
        if self._needs_key and not is_key:
            self.left_out += 1
            return []
        begins, self._needs_key = self._needs_key, False
        return [Whole(data, is_key, begins, self._ticks / self._payload.clock_hz)]


class RtpCapture(Capture):
    """Waits at a UDP port. ``time_s`` is when a picture was sent, by time.monotonic(), as far as arrivals tell."""

    has_our_clock = True

    def __init__(self, address: str, tell: Tell, *, grey: bool = False) -> None:
        super().__init__(grey=grey)
        self._address, self._tell = address, tell
        self._described = described(address)
        self._receiver = Receiver(self._described, address)
        self.about = f"waits for pictures at UDP port {self._described.port}"
        self.is_idle = True
        self._ready: deque[Whole] = deque()
        self._stream: av.VideoStream | None = None
        self._sets: dict[int, bytes] = {}
        self._heard_s, self._told_s = -math.inf, time.monotonic()
        self._is_there = False
        self._lost = self._left_out = 0  # since they were told
        self._listen_anew()

    def _listen_anew(self) -> None:
        """Forget the sender."""
        self._ordered, self._clock = Ordered(), _Clock()
        self._assembly: Assembly | None = None
        self._payload: Payload | None = payload_of(self._described.coding or "")
        if self._payload is not None:
            self._payload.remember(self._described.sets)

    def grab(self) -> bool:
        """Wait for the next picture; False where none came within a moment."""
        self.left_out = 0
        while True:
            while self._ready:
                if self._decode(self._ready.popleft()):
                    return True
            packet, is_new = self._receiver.receive()
            now_s = time.monotonic()
            if is_new:
                self._listen_anew()
            self._heard_s = self._heard_s if packet is None else now_s
            self._say(now_s)
            in_turn = self._ordered.overdue(now_s) if packet is None else self._ordered.put(packet, now_s)
            for one, is_after_gap in in_turn:
                self._take(one, is_after_gap)
            if packet is None and not self._ready:
                return False

    def release(self) -> None:
        """Let go of the port."""
        self._receiver.close()

    def _take(self, packet: Packet, is_after_gap: bool) -> None:
        """Put the next packet to its picture."""
        if self._payload is None:
            self._payload = payload_of(name_of(packet.payload_type, packet.payload) or "")
        if self._payload is None:
            return
        if self._assembly is None:
            self._assembly = Assembly(self._payload)
        self._ready += self._assembly.take(packet, is_after_gap)

    def _decode(self, whole: Whole) -> bool:
        """Decode a picture; False where none comes of it."""
        assert self._assembly is not None
        assert self._payload is not None
        packet, frames = av.Packet(whole.data), []
        try:
            sets = dict(self._payload.sets)
            if self._stream is None or (whole.is_key and sets != self._sets):
                self._stream, self._sets = _stream_of(whole.data, self._payload.codec), sets
            elif whole.begins:
                self._stream.codec_context.flush_buffers()
            packet.stream, packet.time_base, packet.is_keyframe = self._stream, _MICROSECOND, whole.is_key
            frames = [frame for frame in packet.decode() if isinstance(frame, av.VideoFrame)]
        except (FFmpegError, ValueError):
            pass  # as if it had been lost
        if not frames or frames[-1].is_corrupt:
            self._assembly.spoil()
            return False
        self._frame, now_s = frames[-1], time.monotonic()
        time_s = self._clock.time_of(whole.sent_s, now_s)
        self.time_s = time_s if self.time_s is None else max(time_s, self.time_s + 1e-6)
        packet.pts = packet.dts = round(1e6 * self.time_s)
        self.packets = (packet,)
        # Before the first there was nothing to miss.
        self.left_out, self._assembly.left_out = self._assembly.left_out if self._is_there else 0, 0
        self._left_out += self.left_out
        self._say_there()
        return True

    def _say_there(self) -> None:
        """Say what comes, once it comes, or comes again."""
        assert self._frame is not None
        assert self._payload is not None
        about = f"{self._frame.width} x {self._frame.height} {self._payload.codec} from {self._receiver.sender}"
        if not self._is_there or about != self.about:
            self._tell(f"{self._address}: {about}")
        self.about, self._is_there = about, True

    def _say(self, now_s: float) -> None:
        """Say what is missing, and not too often."""
        self._lost, self._ordered.lost = self._lost + self._ordered.lost, 0
        if self._is_there and now_s - self._heard_s > _SILENT_S:
            self._tell(f"{self._address}: no more packets come, for {_SILENT_S:g} s; they are waited for")
            self._is_there, self._told_s = False, now_s
        if now_s - self._told_s < _TELL_EVERY_S:
            return
        if not self._is_there:
            hears, port = now_s - self._heard_s < _SILENT_S, self._described.port
            sentence = f"packets come to UDP port {port}, but no picture of H.264, H.265 or JPEG that begins by itself"
            self._tell(f"{self._address}: {sentence if hears else f'nothing comes to UDP port {port}'}")
        elif self._lost or self._left_out:
            self._tell(f"{self._address}: {self._lost} packets were lost, and {self._left_out} pictures are left out")
        self._told_s, self._lost, self._left_out = now_s, 0, 0


class _Clock:
    """The sender's clock by ours: the picture that took least on the way counts as if it had taken nothing."""

    def __init__(self) -> None:
        self._ahead_s: float | None = None
        self._before_s = 0.0

    def time_of(self, sent_s: float, now_s: float) -> float:
        """When a picture was sent, of which it is known when it came."""
        ahead_s = now_s - sent_s
        if self._ahead_s is None or abs(ahead_s - self._ahead_s) > _CLOCK_WAS_SET_S:
            self._ahead_s, self._before_s = ahead_s, sent_s
        self._ahead_s = min(ahead_s, self._ahead_s + _DRIFT * max(0.0, sent_s - self._before_s))
        self._before_s = sent_s
        return sent_s + self._ahead_s


def _stream_of(data: bytes, codec: str) -> av.VideoStream:
    """A stream whose decoder takes packets, opened by a picture that begins by itself, which tells the size."""
    stream = opened(io.BytesIO(data), format=codec).streams.video[0]
    stream.codec_context.thread_count = 1  # more hold pictures back
    stream.codec_context.flags |= Flags.low_delay
    return stream
