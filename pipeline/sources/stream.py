"""A network stream, read so that each frame is there as soon as it arrives."""

import time
from collections.abc import Callable
from functools import partial

import av
import numpy as np
from av.error import FFmpegError
from dockpose.sources.capture import Wishes
from dockpose.sources.container import opened
from dockpose.sources.frames import SourceError
from dockpose.sources.pixels import picture_of

# Frames are neither queued nor waited for, and the format is recognised from half a second of them rather than five.
# FFmpeg's RTSP loses frames over UDP without a word.
_OPTIONS = {"fflags": "nobuffer", "flags": "low_delay", "analyzeduration": "500000", "rtsp_transport": "tcp"}
_YEAR_2000_S = 946_684_800  # an earlier clock was never set
# Formats whose frames carry the sender's clock; for others, FFmpeg makes times up from a frame rate.
_WITH_CLOCK = {"rtsp", "rtp", "sdp", "mpegts", "flv", "live_flv", "hls"}


class StreamCapture:
    """A stream that is open; one thread decodes it, since more of them hold frames back."""

    is_idle, has_our_clock, left_out = False, False, 0  # see RtpCapture

    def __init__(self, address: str, timeout_s: float, *, grey: bool = False) -> None:
        self._grey = grey
        start_s = time.monotonic()
        try:
            self._container = opened(address, options=_OPTIONS, timeout=(timeout_s, timeout_s))
            if not self._container.streams.video:
                self._container.close()
                raise OSError("has no video in it")
        except (FFmpegError, OSError, ValueError) as error:
            if time.monotonic() - start_s >= 0.9 * timeout_s:
                raise SourceError(f"{address}: does not answer within {timeout_s:g} s") from error
            what = "nothing answers there, or what answers is not a video"
            raise SourceError(f"{address}: cannot be opened: {what}") from error
        self._stream = self._container.streams.video[0]
        self._stream.codec_context.thread_count = 1
        self._has_clock = bool(_WITH_CLOCK & set(self._container.format.name.split(",")))
        self._is_intra = self._stream.codec_context.codec.intra_only
        self._packets = self._container.demux(self._stream)
        self._waiting: list[av.VideoFrame] = []
        self._frame: av.VideoFrame | None = None
        self.packets: tuple[av.Packet, ...] = ()
        rate = self._stream.average_rate if self._has_clock else None
        codec = self._stream.codec_context
        shown = f" at {float(rate):.4g} frames/s" if rate else ""
        self.about = f"{codec.width} x {codec.height} {codec.name}{shown}"

    @property
    def unix_at_zero_s(self) -> float | None:
        """Time of day at the zero of ``time_s`` by the sender's reports (RTCP); None where it sent none yet."""
        began_us = self._container.start_time_realtime
        return None if began_us is None or began_us / 1e6 < _YEAR_2000_S else began_us / 1e6

    def ask(self, wishes: Wishes) -> tuple[str, ...]:
        """Nothing can be set at a stream; its sender decides."""
        return ()

    @property
    def is_recording(self) -> bool:
        """Whether it has an end, as a file on a server has."""
        return self._stream.frames > 0 or (self._container.duration or 0) > 0

    @property
    def time_s(self) -> float | None:
        """Time of the frame that was grabbed last by the sender's clock, in seconds; None where it has none."""
        return None if self._frame is None or not self._has_clock else self._frame.time

    def grab(self) -> bool:
        """Wait for the next frame; False if there is none or it is corrupt."""
        self.packets = ()
        while not self._waiting:
            try:
                packet = next(self._packets)
                # Without a clock the frame's time is all that there is, so that it must be the frame's packet alone.
                self.packets = (*self.packets, packet) if self._has_clock else (packet,) if self._is_intra else ()
                self._waiting = [frame for frame in packet.decode() if isinstance(frame, av.VideoFrame)]
            except (StopIteration, FFmpegError):
                return False
            if packet.size == 0 and not self._waiting:
                return False
        self._frame = self._waiting.pop(0)
        return not self._frame.is_corrupt

    def retrieve(self) -> np.ndarray | None:
        """Return the frame that was grabbed last, (H, W) or (H, W, 3) BGR, uint8 or uint16."""
        return None if self._frame is None else picture_of(self._frame, grey=self._grey)

    @property
    def shown(self) -> Callable[[], np.ndarray] | None:
        """Returns the frame that was grabbed last as it is shown, where only its brightness was retrieved."""
        return partial(picture_of, self._frame) if self._grey and self._frame is not None else None

    def release(self) -> None:
        """Close the connection."""
        self._container.close()
