"""A video file as frames, in order and by index."""

import time
from collections.abc import Iterator
from datetime import datetime
from fractions import Fraction
from functools import partial

import av
import numpy as np
from av.error import FFmpegError
from dockpose.camera import mark
from dockpose.sources import ffmpeg
from dockpose.sources.ffmpeg import picture_of
from dockpose.sources.frames import Callback, Frame, Frames, SourceError
from dockpose.sources.guard import Guard
from dockpose.sources.order import Order, counts, order_of

_NEAR = 32  # frames this far ahead are reached by reading on rather than by seeking
_STEPS_BACK = (0, 8, 64)  # frames before the wanted one to seek to, until it is not overshot
_DECIMALS = 6  # of times in seconds
_FIRST_YEAR, _A_DAY_S = 2000, 86400  # an earlier clock was never set, and one far ahead is wrong
_ASSUMED_HZ = 25.0  # rate of a file that gives none
_NAMED = 3  # gaps, of more their number is said
_BARE = ("h264", "hevc")  # units one after another, of which no container tells how long they are
_FAILURES = 1000  # damaged packets in a row after which a file is given up


class Video(Frames):
    """Frames of a video file, identified by their time stamps, or else by their packets.

    A frame's index is the rank of its time stamp among those of all the file's packets, which are read on opening
    without decoding (some microseconds each). So a corrupt frame leaves its index out, and a frame has the same index
    and the same time whether it was reached from the beginning or by seeking. Times are those of the file, constant
    rate or not, from its first frame on; where its clock runs back, as in files that were joined, they go on from the
    frame before. ``rate_hz`` is for files whose frames have no times.
    """

    def __init__(
        self, source: str, tell: Callback | None = None, *, grey: bool = False, rate_hz: float | None = None
    ) -> None:
        super().__init__(source, tell)
        self._grey = grey
        container, is_broken_off = ffmpeg.video_in(source)
        with container:
            if mark.COMMENT in container.metadata.values():
                raise SourceError(mark.refusal(source, "video"))
            stream = ffmpeg.best_video(container)
            if sentence := ffmpeg.others_sentence(container):
                self._tell(f"{source}: {sentence}")
            self._time_base = Fraction(stream.time_base or 1)
            self._told = stream.frames or None
            self._order = order_of(container, stream)
            self._began_unix_s = began_unix_s(container.format.name, container.metadata.get("creation_time"))
            self._is_steady = ffmpeg.is_without_clock(container, source)
            # The average rate of such files is made up, that of the codec is not.
            told_hz = stream.codec_context.framerate if self._is_steady else stream.average_rate
        self.rate_hz = float(told_hz) if told_hz else None
        if self._order.count == 0:
            raise SourceError(ffmpeg.why_not(source))
        self.count = self._order.count
        if self._is_steady:
            self._take_rate(rate_hz)
        elif self.rate_hz is None and self._order.stamps is not None:
            length = int(self._order.stamps[-1] - self._order.stamps[0]) * self._time_base
            self.rate_hz = float((self._order.count - 1) / length) if length else None
        self._kept: _Decoder | None = None
        self._tell_faults(is_broken_off)

    def __iter__(self) -> Iterator[Frame]:
        return self.between(0, self._order.count)

    def between(self, start: int, stop: int) -> Iterator[Frame]:
        """Yield the frames with ``start`` <= index < ``stop``."""
        start = max(0, start)
        if start >= stop:
            return
        decoder = _Decoder(self._address, self._order)
        expected, missing = start, list[range]()
        try:
            found = decoder.go_to(start)
            while found is not None and found[0] < stop:
                missing.append(range(expected, found[0]))
                yield self._frame(*found)
                expected = found[0] + 1
                if expected >= stop:
                    return
                found = decoder.advance()
            if not (self.is_cut_short and expected == self._order.count - 1):
                missing.append(range(expected, min(stop, self._order.count)))
        finally:
            decoder.close()
            self._tell_missing(list(filter(None, missing)))

    def at(self, index: int) -> Frame:
        """Return one frame; frames a little ahead of the last one are reached by reading on."""
        if self._kept is None:
            self._kept = _Decoder(self._address, self._order)
        found = self._kept.go_to(index) if index >= 0 else None
        if found is None or found[0] != index:
            raise SourceError(f"{self.source}: frame {index} of {self.count} is not there or corrupt")
        return self._frame(*found)

    def close(self) -> None:
        """Release the file."""
        if self._kept is not None:
            self._kept.close()
            self._kept = None

    def _frame(self, index: int, decoded: av.VideoFrame) -> Frame:
        image, time_s = picture_of(decoded, grey=self._grey), self._time_s(index)
        shown = partial(picture_of, decoded) if self._grey else None
        began_s = self._began_unix_s
        taken_s = None if began_s is None or time_s is None else round(began_s + time_s, _DECIMALS)
        self._tell_orientation(ffmpeg.orientation_of(decoded), self.source)
        return self._turned(Frame(image, index, time_s, self.source, shown=shown, time_unix_s=taken_s))

    def _time_s(self, index: int) -> float | None:
        if self._order.stamps is not None and not self._is_steady:
            ticks = int(self._order.stamps[index] - self._order.stamps[0])
            return round(float(ticks * self._time_base), _DECIMALS)
        return None if self.rate_hz is None else round(index / self.rate_hz, _DECIMALS)

    def _tell_missing(self, missing: list[range]) -> None:
        """Say once which frames were left out."""
        if count := sum(map(len, missing)):
            named = [f"{each[0]} to {each[-1]}" if len(each) > 1 else str(each[0]) for each in missing[:_NAMED]]
            named += [f"{len(missing) - _NAMED} more"] if len(missing) > _NAMED else []
            which = " and ".join(filter(None, (", ".join(named[:-1]), named[-1])))
            text = f"frames {which} are left out, {count} in all: damaged, or predicted from damaged ones"
            text = text if count > 1 else f"frame {which} is corrupt and left out"
            is_end = self._is_steady and missing[-1][0] + 1 == self.count
            self._skip(f"{self.source}: {text}{'; the file ends there, perhaps cut short' if is_end else ''}", count)

    def _take_rate(self, rate_hz: float | None) -> None:
        if rate_hz is None and self.rate_hz is None:
            text = f"the file gives no frame rate; {_ASSUMED_HZ:g} frames a second are assumed (--rate sets another)"
            self._tell(f"{self.source}: {text}")
        self.rate_hz = rate_hz or self.rate_hz or _ASSUMED_HZ

    def _tell_faults(self, is_broken_off: bool) -> None:
        count, joins = str(self.count), self._order.joins
        if is_broken_off or self._order.is_torn:
            if self._told is not None and self._order.count < self._told:
                count = f"{count} of the {self._told}"
            self.is_cut_short = True
            there = f"{count} frames are there, the last of them perhaps in part"
            self._tell(f"{self.source}: the video is cut short: {there}")
        if joins:
            where = f"frame {joins[0]}" + (f" and {len(joins) - 1} more" if len(joins) > 1 else "")
            text = "as where files were joined; times go on from the frame before, of which a part may be missing"
            self._tell(f"{self.source}: its clock jumps at {where}, {text}")


def began_unix_s(container: str, creation_time: str | None) -> float | None:
    """Time of day of a video's first frame, in seconds since 1970-01-01 00:00 UTC; None where it is not sure."""
    # Files say when they were made, but seldom whether recording began or ended then: cameras and phones differ in
    # their MP4 files, and programs that convert a file write the time of that, all of them in whole seconds. So only
    # Matroska's date (DateUTC) is believed, and only where it has a fraction of a second, as recorders write it that
    # are at work while it happens, when they begin.
    if creation_time is None or "matroska" not in container.split(","):
        return None
    try:
        began = datetime.fromisoformat(creation_time)
    except ValueError:
        return None
    is_sure = began.tzinfo is not None and began.microsecond != 0 and began.year >= _FIRST_YEAR
    return began.timestamp() if is_sure and began.timestamp() < time.time() + _A_DAY_S else None


class _Decoder:
    """Decodes on in a video from any frame; damaged frames are passed over."""

    def __init__(self, source: str, order: Order) -> None:
        self._source, self._order = source, order
        self._open()

    def close(self) -> None:
        self._container.close()

    def go_to(self, index: int) -> tuple[int, av.VideoFrame] | None:
        """Index and frame of that index or of the next good one; None at the end."""
        found = self._near(index)
        while found is not None and found[0] < index:
            found = self.advance()
        return found

    def advance(self) -> tuple[int, av.VideoFrame] | None:
        """Index and frame of the next good frame; None at the end."""
        decoded = next(self._frames, None)
        if decoded is not None:
            self._last = (self._index_of(decoded), decoded)
            self._following = self._last[0] + 1
            return self._last
        self._last = None
        order, following = self._order, self._following
        if not self._is_threaded or following >= order.count or not self._guard.has_lost_end:
            return None
        self.close()
        self._open(is_threaded=False)
        return self.go_to(following)

    def _open(self, *, is_threaded: bool = True) -> None:
        self._container, _ = ffmpeg.video_in(self._source)
        self._stream = ffmpeg.best_video(self._container)
        self._is_threaded = is_threaded
        context = self._stream.codec_context
        # One that conceals a damaged slice of FFV1 writes into the picture before, which others give out meanwhile.
        self._stream.thread_type = "SLICE" if context.name == "ffv1" else "AUTO"
        # Those that share a picture tell of no missing slice of H.264, and those that take turns of no end that is cut.
        context.thread_count = 0 if is_threaded and self._container.format.name not in _BARE else 1
        self._frames = self._decoded()
        self._last: tuple[int, av.VideoFrame] | None = None
        self._following = self._count = 0

    def _near(self, index: int) -> tuple[int, av.VideoFrame] | None:
        """Go to that frame or somewhat before it."""
        if self._last is not None and self._last[0] == index:
            return self._last
        if self._last is not None and self._last[0] < index <= self._last[0] + _NEAR:
            return self.advance()
        order = self._order
        if order.stamps is not None and order.is_sought and index < order.count:
            for step in _STEPS_BACK:
                if index - step <= 0:
                    break
                self._container.seek(int(order.stamps[index - step]), stream=self._stream)
                self._frames, self._following = self._decoded(), index - step
                found = self.advance()
                if found is not None and min(found[0], self._began) <= index:
                    return found
        self.close()
        self._open(is_threaded=self._is_threaded)
        return self.advance()

    def _decoded(self) -> Iterator[av.VideoFrame]:
        """Decoded frames from where the file is, without those that are damaged or depend on such."""
        packets, order = self._container.demux(self._stream), self._order
        is_bare = self._container.format.name in _BARE
        self._guard = guard = Guard(self._stream.codec_context, damaged=order.damaged, is_bare=is_bare)
        given, number, is_end = 0, 0, False
        self._began = 2**62  # frame of the first packet, if it is a key frame
        while guard.failures < _FAILURES and not is_end:
            try:
                packet = next(packets, None)
            except FFmpegError:
                packet = None
            is_end = packet is None
            if packet is not None and counts(packet):
                is_first = number == 0 and packet.is_keyframe
                if is_first and order.is_sought and order.stamps is not None:
                    self._began = int(np.searchsorted(order.stamps, packet.pts or 0))
                if not order.is_sought:
                    packet.pts, packet.dts = number, None
                number += 1
            for frame in guard.decode(packet):
                self._count = guard.left_out + given
                given += 1
                yield frame

    def _index_of(self, decoded: av.VideoFrame) -> int:
        order, stamp = self._order, decoded.pts
        if stamp is not None:
            if order.is_sought and order.stamps is not None:
                return min(int(np.searchsorted(order.stamps, stamp)), order.count - 1)
            if order.ranks is not None and stamp < order.count:
                return int(order.ranks[stamp])
        return min(self._count, order.count - 1)
