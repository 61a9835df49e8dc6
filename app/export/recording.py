"""What a live source gives, kept in a file meanwhile: packets as they were sent, or else lossless frames."""

import contextlib
import threading
from collections import deque
from pathlib import Path
from typing import Any

import av
from av.error import FFmpegError
from dockpose.app.drawing.numbers import count
from dockpose.app.errors import UserError, writing
from dockpose.app.export.video import MILLISECOND, VideoFile, create_matroska, creation_time
from dockpose.sources import Arrival, Callback, Live

ENDING = ".mkv"
MOST_WAITING_BYTES = 256 * 2**20  # some three seconds of 1280 x 720 in colour
_TIMED_FRAMES = 5  # from which the rate in the file's header is estimated
_RATE_HZ = 25.0  # of fewer


class Recording:
    """Records every frame of a live source in its own thread: packets as they were sent, other frames as FFV1."""

    # If the kind of frame changes, as when a camera comes back with another size, it goes on in NAME-2.mkv.

    def __init__(self, path: Path, tell: Callback) -> None:
        check_name(path)
        with writing(path):
            path.touch(exist_ok=False)
        self.path, self._tell = path, tell
        self.missing = 0
        self._paths: list[Path] = []
        self._parts: list[_Part] = []
        self._kind: tuple[Any, ...] | None = None
        self._part: _Part | None = None
        self._waiting: deque[tuple[_Part, Arrival]] = deque()
        self._waiting_bytes = 0
        self._changed = threading.Condition()
        self._is_closed = self.has_failed = False
        self._thread = threading.Thread(target=self._run, name="dockpose recording", daemon=True)
        self._thread.start()

    @property
    def is_running(self) -> bool:
        """Whether frames are still taken; not once one could not be written."""
        return not (self._is_closed or self.has_failed)

    @property
    def frames(self) -> int:
        """How many frames are written so far; those of a stream count from the first that can be decoded by itself."""
        return sum(part.frames for part in self._parts)

    @property
    def size_bytes(self) -> int:
        """How much is written so far."""
        return sum(path.stat().st_size for path in self._paths if path.exists())

    def take(self, arrival: Arrival) -> None:
        """Have a frame written; takes next to no time. It is counted as missing where too much is waiting already."""
        size = sum(packet.size for packet in arrival.packets) or arrival.frame.image.nbytes
        with self._changed:
            if not self.is_running:
                return
            if self._waiting_bytes + size > MOST_WAITING_BYTES:
                self.missing += 1
                if self.missing == 1:
                    self._tell(f"{self.path}: frames come faster than they can be written; some will be missing")
                return
            kind = _kind_of(arrival)
            if self._part is None or kind != self._kind:
                try:
                    self._part, self._kind = self._new_part(arrival), kind
                    self._parts.append(self._part)
                except Exception as error:  # whatever is wrong with the file, the frames go on
                    self._fail(error)
                    return
            self._waiting.append((self._part, arrival))
            self._waiting_bytes += size
            self._changed.notify_all()

    def close(self) -> None:
        """Write what is waiting, finish the file, and tell what there is of it; once."""
        with self._changed:
            if self._is_closed:
                return
            self._is_closed = True
            self._changed.notify_all()
        self._thread.join()
        self._tell(self.summary())
        if self.frames == 0:  # the empty file that held the name
            for path in self._paths or [self.path]:
                with contextlib.suppress(OSError):
                    path.unlink()

    def is_whole(self) -> bool:
        """Finish the file, and tell whether every frame is in it."""
        self.close()
        return self.frames > 0 and not (self.missing or self.has_failed)

    def summary(self) -> str:
        """How much was recorded, in words."""
        where = " and ".join(map(str, self._paths or [self.path]))
        missing = f"; {self.missing} are missing, which there was no time to write" if self.missing else ""
        return f"{where}: {count(self.frames, 'frame')} recorded, {self.size_bytes / 1e6:.1f} MB{missing}"

    def _run(self) -> None:
        part: _Part | None = None
        while (item := self._next()) is not None and not self.has_failed:
            following, arrival = item
            try:
                if part is not None and following is not part:
                    part.close()
                part = following
                part.write(arrival)
            except Exception as error:
                self._fail(error)
        if part is not None:
            try:
                part.close()
            except Exception as error:
                self._fail(error)

    def _next(self) -> "tuple[_Part, Arrival] | None":
        """Wait for what is to be written; None once there is no more."""
        with self._changed:
            self._changed.wait_for(lambda: self._waiting or not self.is_running)
            if not self._waiting:
                return None
            part, arrival = self._waiting.popleft()
            self._waiting_bytes -= sum(packet.size for packet in arrival.packets) or arrival.frame.image.nbytes
            return part, arrival

    def _fail(self, error: Exception) -> None:
        """Say once why there is no more recorded."""
        if not self.has_failed:
            self.has_failed = True
            self._waiting.clear()
            said = str(error) if isinstance(error, UserError) else f"{self.path}: cannot be written ({error})"
            self._tell(f"{said}; it is no longer recorded, and all else goes on")

    def _new_part(self, arrival: Arrival) -> "_Part":
        """Begin a file for frames as this one, beside those that there are; of packets while their source is open."""
        number = len(self._paths) + 1
        path = self.path if number == 1 else self.path.with_stem(f"{self.path.stem}-{number}")
        if number > 1:
            with writing(path):
                path.touch(exist_ok=False)
            self._tell(f"{path}: the frames are of another kind from here on, and recorded here")
        self._paths.append(path)
        with writing(path):
            return _Packets(path, arrival) if arrival.packets else _Pictures(path)


def check_name(path: Path) -> None:
    """Raise UserError where a recording cannot have that name, or there is a file of that name."""
    if path.suffix.lower() != ENDING:
        raise UserError(f"{path}: a recording is a Matroska file; its name must end with {ENDING}")
    if path.exists():
        raise UserError(f"{path}: is there already, and a recording overwrites nothing; give another name")


def record(frames: Live, path: Path, tell: Callback) -> Recording | None:
    """Record a live source from its next frame on; None where that cannot be, of which ``tell`` hears."""
    try:
        recording = Recording(path, tell)
    except UserError as error:
        tell(f"{error}; it is not recorded, and all else goes on")
        return None
    frames.on_arrival = recording.take
    return recording


def _kind_of(arrival: Arrival) -> tuple[Any, ...]:
    """What must be the same of all frames in one file."""
    if not arrival.packets:
        return arrival.frame.image.shape, arrival.frame.image.dtype.str
    stream = arrival.packets[0].stream
    if not isinstance(stream, av.VideoStream):
        return "mjpeg", arrival.frame.image.shape[:2]
    codec = stream.codec_context
    return codec.name, codec.width, codec.height, codec.extradata


class _Pictures:
    """Frames as FFV1; the first few wait until the rate is known."""

    def __init__(self, path: Path) -> None:
        self._path, self.frames = path, 0
        self._first: list[Arrival] = []
        self._video: VideoFile | None = None
        self._began_s = 0.0

    def write(self, arrival: Arrival) -> None:
        if self._video is not None:
            self._video.write(arrival.frame.image, (arrival.frame.time_s or 0.0) - self._began_s)
            self.frames += 1
            return
        self._first.append(arrival)
        if len(self._first) >= _TIMED_FRAMES:
            self._begin()

    def close(self) -> None:
        if self._video is None and self._first:
            self._begin()
        if self._video is not None:
            self._video.close()

    def _begin(self) -> None:
        first, last = self._first[0].frame, self._first[-1].frame
        self._began_s = first.time_s or 0.0
        elapsed_s = (last.time_s or 0.0) - self._began_s
        rate_hz = (len(self._first) - 1) / elapsed_s if elapsed_s > 0 else _RATE_HZ
        began = {} if first.time_unix_s is None else {"creation_time": creation_time(first.time_unix_s)}
        self._video = VideoFile(self._path, rate_hz, metadata=began)
        for arrival in self._first:
            self.write(arrival)
        self._first.clear()


class _Packets:
    """Packets as they were sent, from the first one on that can be decoded by itself."""

    def __init__(self, path: Path, arrival: Arrival) -> None:
        self._path, self.frames = path, 0
        frame, stream = arrival.frame, arrival.packets[0].stream
        self._unix_at_zero_s = None if frame.time_unix_s is None else frame.time_unix_s - (frame.time_s or 0.0)
        self._container, self._file = create_matroska(path)
        try:
            if isinstance(stream, av.VideoStream):
                self._stream: Any = self._container.add_stream_from_template(stream)
            else:
                height, width = frame.image.shape[:2]
                self._stream = self._container.add_mux_stream("mjpeg", width=width, height=height)
            self._stream.time_base = MILLISECOND
        except (FFmpegError, ValueError) as error:
            self._container.close()
            self._file.close()
            raise UserError(f"{path}: cannot hold what is sent ({error})") from error
        self._began_us: int | None = None
        self._last_us = -1

    def write(self, arrival: Arrival) -> None:
        for packet in arrival.packets:
            shown_us, sent_us = _times_us(packet, arrival)
            if shown_us is None or packet.size == 0:
                continue
            if self._began_us is None:
                if not packet.is_keyframe and packet.stream is not None:
                    continue
                self._begin(shown_us)
            assert self._began_us is not None
            shown_us -= self._began_us
            if shown_us < 0:
                continue  # belongs to frames before the first whole one
            self._last_us = max(sent_us - self._began_us, self._last_us + 1)
            self._mux(packet, max(shown_us, self._last_us), self._last_us)

    def close(self) -> None:
        with writing(self._path):
            try:
                self._container.close()
            except FFmpegError as error:
                raise UserError(f"{self._path}: cannot be finished ({error.strerror})") from error
            finally:
                self._file.close()

    def _begin(self, shown_us: int) -> None:
        self._began_us = shown_us
        if self._unix_at_zero_s is not None:
            self._container.metadata["creation_time"] = creation_time(self._unix_at_zero_s + shown_us / 1e6)

    def _mux(self, packet: av.Packet, shown_us: int, sent_us: int) -> None:
        packet.stream = self._stream
        packet.pts, packet.dts, packet.duration, packet.time_base = shown_us, sent_us, 0, MILLISECOND
        with writing(self._path):
            try:
                self._container.mux(packet)
                self.frames += 1
            except FFmpegError as error:
                raise UserError(f"{self._path}: cannot be written ({error.strerror})") from error


_Part = _Pictures | _Packets  # one file of a recording, of frames of one kind


def _times_us(packet: av.Packet, arrival: Arrival) -> tuple[int | None, int]:
    """When a packet is to be shown and when it was sent, as times of frames."""
    if packet.stream is None or arrival.shift_s is None or not packet.time_base:
        arrived_us = round(1e6 * (arrival.frame.time_s or 0.0))
        return arrived_us, arrived_us
    if packet.pts is None:
        return None, 0
    shown_us = round(1e6 * (float(packet.pts * packet.time_base) + arrival.shift_s))
    sent = packet.pts if packet.dts is None else packet.dts
    return shown_us, round(1e6 * (float(sent * packet.time_base) + arrival.shift_s))
