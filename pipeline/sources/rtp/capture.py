"""An RTP sender as a source of pictures that may come later, go, and come back."""

import io
import time
from collections import deque

import av
from av.codec.context import Flags
from av.error import FFmpegError
from dockpose.sources.capture import Capture
from dockpose.sources.ffmpeg import opened
from dockpose.sources.frames import Callback
from dockpose.sources.rtp.description import described
from dockpose.sources.rtp.packets import Ordered, Receiver
from dockpose.sources.rtp.pictures import Assembly, Picture, coding_of

_SILENT_S = 2.0  # after which the sender counts as gone
_TELL_EVERY_S = 10.0


class RtpCapture(Capture):
    """Waits at a UDP port; a picture's time is that of its arrival."""

    def __init__(self, address: str, tell: Callback, *, grey: bool = False) -> None:
        super().__init__(grey=grey)
        self._address, self._tell = address, tell
        self._described = described(address)
        self._receiver = Receiver(address, self._described.host, self._described.port)
        self.about = f"waits for pictures at UDP port {self._described.port}"
        self.is_idle = True
        self._stream: av.VideoStream | None = None
        self._sets: dict[int, bytes] = {}  # with which the stream was opened
        self._reported_s = time.monotonic()
        self._is_there = False
        self._lost = self._left_out = 0  # since they were last reported
        self._forget_sender()

    def _forget_sender(self) -> None:
        self._ordered, self._complete, self._assembly = Ordered(), deque[Picture](), None

    def grab(self) -> bool:
        """Wait for the next picture; False where none came within a moment."""
        self.left_out = 0
        while True:
            while self._complete:
                if self._decode(self._complete.popleft()):
                    return True
            packet, is_new = self._receiver.receive()
            self._say(time.monotonic())
            if packet is None:
                return False
            if is_new:
                self._forget_sender()
            if self._assembly is None:
                self._assembly = Assembly(self._described.coding or coding_of(packet.payload), self._described.sets)
            for one, is_after_gap in self._ordered.put(packet):
                self._complete += self._assembly.take(one, is_after_gap)

    def release(self) -> None:
        """Let go of the port."""
        self._receiver.close()

    def _decode(self, picture: Picture) -> bool:
        """Decode a picture; False where none comes of it."""
        assert self._assembly is not None
        packet, frames, sets = av.Packet(picture.data), [], dict(self._assembly.sets)
        try:
            if self._stream is None or (picture.is_key and sets != self._sets):
                self._stream, self._sets = _stream_of(picture.data, self._assembly.coding.codec), sets
            elif picture.is_key:
                self._stream.codec_context.flush_buffers()
            packet.stream, packet.is_keyframe = self._stream, picture.is_key
            frames = [frame for frame in packet.decode() if isinstance(frame, av.VideoFrame)]
        except (FFmpegError, ValueError):
            pass  # as if it had been lost
        if not frames or frames[-1].is_corrupt:
            self._assembly.spoil()
            return False
        self._frame, self.packets = frames[-1], (packet,)
        # Before the first there was nothing to miss.
        self.left_out, self._assembly.left_out = self._assembly.left_out if self._is_there else 0, 0
        self._left_out += self.left_out
        about = f"{self._frame.width} x {self._frame.height} {self._assembly.coding.codec} from {self._receiver.sender}"
        if not self._is_there or about != self.about:
            self._tell(f"{self._address}: {about}")
        self.about, self._is_there = about, True
        return True

    def _say(self, now_s: float) -> None:
        """Say what is missing, and not too often."""
        self._lost, self._ordered.lost = self._lost + self._ordered.lost, 0
        if self._is_there and now_s - self._receiver.heard_s > _SILENT_S:
            self._tell(f"{self._address}: no more packets come, for {_SILENT_S:g} s; they are waited for")
            self._is_there, self._reported_s = False, now_s
        if now_s - self._reported_s < _TELL_EVERY_S:
            return
        if not self._is_there:
            port = self._described.port
            if now_s - self._receiver.heard_s < _SILENT_S:
                sentence = f"packets come to UDP port {port}, but no picture of H.264 or H.265 that begins by itself"
            elif now_s - self._receiver.other_s < _SILENT_S:
                sentence = f"{self._receiver.other} comes to UDP port {port}; H.264 and H.265 over RTP are read"
            else:
                sentence = f"nothing comes to UDP port {port}"
            self._tell(f"{self._address}: {sentence}")
        elif self._lost or self._left_out:
            self._tell(f"{self._address}: {self._lost} packets were lost, and {self._left_out} pictures are left out")
        self._reported_s, self._lost, self._left_out = now_s, 0, 0


def _stream_of(data: bytes, codec: str) -> av.VideoStream:
    """A stream whose decoder takes packets, opened by a picture that begins by itself, which tells the size."""
    stream = opened(io.BytesIO(data), format=codec).streams.video[0]
    stream.codec_context.thread_count = 1  # more hold pictures back
    stream.codec_context.flags |= Flags.low_delay
    return stream
