"""A topic of a bag as frames, in order and by index."""

import contextlib
from dataclasses import dataclass, field
from itertools import accumulate
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.sources.bags import decoding
from dockpose.sources.bags.messages import camera_in, is_rectified, picture_in
from dockpose.sources.bags.opening import opened_files
from dockpose.sources.bags.storage import Message, Place, Storage, Topic
from dockpose.sources.bags.video import Packet, Packets, codec_by, codec_of
from dockpose.sources.ffmpeg import picture_of
from dockpose.sources.frames import Callback, Frame, Indexed, SourceError, growing

# Clocks that begin with a program or a simulation count from 0; this is in 1973, before anything was recorded.
_LEAST_UNIX_NS = 10**17
_DECIMALS = 9
_TRIED = 50  # pictures at the beginning, and as many further on, of which one must be whole, so that its size is known
_ROUNDED = 1e-6  # by how much two cameras may differ that are the same, as a share, or in pixels
_MOST_SAID = 100  # by a topic's cameras, of which two are too many already
_OF_CAMERAS = ("info", "camera_info", "calibration")  # names of what is around the topic of a camera
# What we wrote and published up to version 0.3: annotated pictures, beside a topic that tells them by name.
_DRAWN, _BESIDE = "/dock/image/compressed", "/dock/pose_a"


@dataclass
class _Index:
    """What a bag's topics have, by one reading of it."""

    topics: dict[str, Topic] = field(default_factory=dict)
    # Of each message of a topic with pictures: its file, where it lies in it, when it was recorded, and its own time
    # stamp, None where it cannot be read.
    frames: dict[str, list[tuple[Storage, Place, int, int | None]]] = field(default_factory=dict)
    # Of each topic with cameras the messages that say something new.
    cameras: dict[str, dict[bytes, Message]] = field(default_factory=dict)

    def read(self, file: Storage) -> None:
        """Go through a file of the bag."""
        for message in file.messages():
            topic = message.topic
            if topic.kind in decoding.PICTURES and decoding.is_read(topic):
                entry = file, message.place, message.time_ns, decoding.stamp_ns(topic, message.data)
                self.frames.setdefault(topic.name, []).append(entry)
            elif topic.kind in decoding.CAMERAS and decoding.is_read(topic):
                said = self.cameras.setdefault(topic.name, {})
                if len(said) < _MOST_SAID:
                    said.setdefault(decoding.without_stamp(topic, message.data), message)
        self.topics.update({topic.name: topic for topic in file.topics.values()})


def _words(topic: Topic) -> str:
    """The type of a topic's messages, and their encoding where that is what cannot be read."""
    is_unread = topic.kind in decoding.PICTURES and not decoding.is_read(topic)
    return f"{topic.kind} in {topic.encoding}, which is not read" if is_unread else topic.kind or topic.encoding


def _is_alike(camera: Camera, other: Camera) -> bool:
    """Whether two cameras of a recording are the same but for how their numbers were rounded."""
    numbers = ([*each.matrix.flat, each.width, each.height, each.fisheye, *each.distortion] for each in (camera, other))
    first, second = numbers
    return len(first) == len(second) and np.allclose(first, second, rtol=_ROUNDED, atol=_ROUNDED)


class Bag(Indexed):
    """The pictures of one topic of a bag of ROS 1 or ROS 2, or of the only topic with pictures, each read when due."""

    def __init__(self, source: str, tell: Callback | None = None, topic: str | None = None) -> None:
        super().__init__(source, tell)
        self._storages, self._unfinished, self._open = opened_files(source)
        try:
            index = _Index()
            for file in self._storages:
                index.read(file)
            self.topic = self._chosen(index, topic)
            self._topic, self._frames = index.topics[self.topic], index.frames.get(self.topic, [])
            self.count = len(self._frames)
            self._tell_faults()
            if not self._frames:
                raise SourceError(f"{source}: has no message of the topic {self.topic}")
            self._packets = Packets(self.count, lambda at: Packet(self._message(at))) if self._is_video() else None
            self._set_clock()
            frame, size = self._first_readable()
            if size is not None and index.cameras:
                self._describe_camera(index, frame, size)
        except BaseException as error:
            self.close()
            if isinstance(error, SourceError) and not str(error).startswith(source):
                raise SourceError(f"{source}: {error}") from error
            raise

    def _message(self, index: int) -> Any:
        file, place, _, _ = self._frames[index]
        return decoding.fields_of(self._topic, file.read(place))

    def _frame(self, index: int) -> Frame:
        name = f"{self.source}: frame {index}"
        try:
            encoded = None
            if self._packets is None:
                message = self._message(index)
                image = picture_in(message, name)
                encoded = bytes(memoryview(message.data)) if self._topic.kind in decoding.COMPRESSED_KINDS else None
            else:
                image = picture_of(self._packets.frame(index))
        except SourceError as error:
            raise SourceError(f"{name}: {error}") from error
        time_ns = self._stamps_ns[index]
        time_unix_s = time_ns / 1e9 if time_ns >= _LEAST_UNIX_NS and not self._runs_back else None
        time_s = round(self._times_ns[index] / 1e9, _DECIMALS)
        return Frame(image, index, time_s, self.source, time_unix_s=time_unix_s, encoded=encoded)

    def _chosen(self, index: _Index, topic: str | None) -> str:
        """The topic that was asked for, or the only one with pictures."""
        known = index.topics
        pictures = sorted(
            name for name, one in known.items() if one.kind in decoding.PICTURES and decoding.is_read(one)
        )
        drawn = {name for name in pictures if name.endswith(_DRAWN) and name.removesuffix(_DRAWN) + _BESIDE in known}
        pictures = [name for name in pictures if name not in drawn]
        if drawn and (not pictures or f"/{(topic or '').lstrip('/')}" in drawn):
            what = f"topic {min(drawn)}: has pictures that dockpose has drawn on"
            raise SourceError(f"{self.source}: {what}; give what they were made from")
        if topic is not None:
            wanted = topic if topic in known or topic.startswith("/") else f"/{topic}"
            if wanted in pictures:
                return wanted
            there = f"it is {_words(known[wanted])}" if wanted in known else "there is no such topic"
            listed = f"pictures are on {', '.join(pictures)}" if pictures else "no topic has pictures"
            raise SourceError(f"{self.source}: topic {topic}: {there}; {listed}")
        if not pictures:
            faults = [fault for file in self._storages for fault in file.faults]
            if faults:
                raise SourceError(f"{self.source}: no topic of the bag has pictures that can be read: {faults[0]}")
            others = ", ".join(f"{name} ({_words(one)})" for name, one in sorted(known.items()))
            raise SourceError(f"{self.source}: no topic of the bag has pictures; its topics are {others or 'none'}")
        if len(pictures) > 1:
            raise SourceError(f"{self.source}: which topic? Say --topic with one of {', '.join(pictures)}")
        return pictures[0]

    def _set_clock(self) -> None:
        """Take the times of all pictures from their stamps; from the recording where the pictures have none."""
        self._stamps_ns = self._clock()
        self._times_ns, back = growing(self._stamps_ns)
        self._runs_back = bool(back)
        if back:
            jump_s = (self._stamps_ns[back[0] - 1] - self._stamps_ns[back[0]]) / 1e9
            more = f" and {len(back) - 1} times more" if len(back) > 1 else ""
            jump = f"by {jump_s:.6g} s at frame {back[0]}{more}"
            self._tell(f"{self.source}: its clock jumps back {jump}; time goes on by the usual interval there")
        if self._stamps_ns[0] != self._stamps_ns[-1]:
            self.rate_hz = (len(self._frames) - 1) * 1e9 / self._times_ns[-1]

    def _clock(self) -> list[int]:
        """Time stamps of all pictures, in nanoseconds."""
        stamps_ns = [stamp_ns for *_, stamp_ns in self._frames]
        first_ns = next((each for each in stamps_ns if each is not None), 0)
        if first_ns == 0:
            if any(each == 0 for each in stamps_ns):
                self._tell(f"{self.source}: its pictures have no time stamps; the times of the recording are taken")
            return [time_ns for _, _, time_ns, _ in self._frames]
        if first_ns < _LEAST_UNIX_NS:
            begin = f"its time stamps begin at {first_ns / 1e9:.3f} s, which is not a time of day"
            self._tell(f"{self.source}: {begin}; times are counted from the first frame alone")
        # One that cannot be read, or has none, has that of the picture before.
        return list(accumulate(stamps_ns, lambda last, each: each or last, initial=first_ns))[1:]

    def _is_video(self) -> bool:
        """Whether the messages are packets of a video, by their type, or by the format of the first that is whole."""
        if self._topic.kind not in decoding.COMPRESSED_KINDS:
            return self._topic.kind in decoding.VIDEO
        for at in range(len(self._frames)):
            with contextlib.suppress(SourceError):
                message = self._message(at)
                return (codec_of(message.format) or codec_by(bytes(memoryview(message.data)))) is not None
        return False

    def _first_readable(self) -> tuple[str, tuple[int, int] | None]:
        """The frame of reference of the first picture that can be read, and its width and height; None of none.

        Raises SourceError where all that are tried cannot be read for one and the same reason.
        """
        first = 0 if self._packets is None else self._packets.first_key()
        reasons = list[str]()
        count = len(self._frames)
        begin = min(first + _TRIED, count)
        for at in (*range(first, begin), *range(begin, count, max(1, count // _TRIED))):
            try:
                height, width = self._frame(at).image.shape[:2]
                return decoding.frame_of(self._message(at)), (width, height)
            except ValueError as error:
                reasons.append(str(error).removeprefix(f"{self.source}: frame {at}: "))
        if len(set(reasons)) == 1:
            raise SourceError(f"{self.source}: no picture of {self.topic} can be read: the first {reasons[0]}")
        return "", None

    def _describe_camera(self, index: _Index, frame: str, size: tuple[int, int]) -> None:
        """Take the camera of the pictures from a topic beside them, where it can be theirs; the notes tell of it."""
        above = self.topic.rpartition("/")[0]  # of what is compressed or packed, the topic is one level up
        levels = 1 if self._topic.kind == decoding.IMAGE else 2
        beside = [f"{above}/camera_info", f"{above.rpartition('/')[0]}/camera_info"][:levels]
        usual = next((name for name in beside if name in index.cameras), None)
        near = self._near(index, frame) if usual is None else {usual}
        found, unusable = dict[Camera, tuple[str, list[str]]](), dict[str, None]()
        for name in sorted(near):
            for said in index.cameras[name].values():
                notes = list[str]()
                try:
                    message = decoding.fields_of(said.topic, said.data)
                    camera = camera_in(message, size, notes.append, is_rectified(self.topic))
                except ValueError as error:
                    unusable[f"the camera of {name} cannot be used ({error})"] = None
                    continue
                if camera is None:
                    unusable[f"the camera of {name} was not calibrated (its focal length is 0)"] = None
                elif not any(_is_alike(camera, other) for other in found):
                    found[camera] = name, notes
        if len(found) == 1:
            self.camera, (name, notes) = found.popitem()
            self.camera_notes = [f"the camera is that of the bag's topic {name}", *notes]
            return
        self.camera_notes += unusable
        names = {name for name, _ in found.values()}
        if len(names) == 1:
            spans = [(axis, [getattr(camera, axis) for camera in found]) for axis in ("fx", "cx", "cy")]
            change = ", ".join(f"{axis} from {min(each):.6g} to {max(each):.6g}" for axis, each in spans)
            note = f"the camera of {names.pop()} changes during the recording ({change} px), so give one as a file"
            self.camera_notes.append(note)
        elif usual is None:
            why = "more than one of them may be" if found else "none of them is surely"
            known = ", ".join(sorted(index.cameras))
            self.camera_notes.append(f"its cameras are on {known}; {why} that of {self.topic}, so give it as a file")

    def _near(self, index: _Index, frame: str) -> set[str]:
        """Topics of cameras that are beside or above that of the pictures, by whatever name, or of the same frame."""
        found = dict[str, int]()
        for name, said in index.cameras.items():
            message = next(iter(said.values()))
            with contextlib.suppress(SourceError):
                own = decoding.frame_of(decoding.fields_of(message.topic, message.data))
                parts = name.split("/")[:-1]
                while parts and parts[-1] in _OF_CAMERAS:
                    parts.pop()
                is_above = self.topic.split("/")[: len(parts)] == parts
                if own == frame if own and frame else is_above:
                    found[name] = len(parts) if is_above else 0
        return {name for name, depth in found.items() if depth == max(found.values())}

    def _tell_faults(self) -> None:
        for fault in [fault for file in self._storages for fault in file.faults]:
            self._skip(f"{self.source}: {fault}")
        frames = "1 frame is" if self.count == 1 else f"{self.count} frames are"
        if any(file.is_cut_short for file in self._storages):
            self.is_cut_short = True
            self._tell(f"{self.source}: the bag is cut short: {frames} there")
        elif why := self._unfinished or next(filter(None, (file.unfinished for file in self._storages)), ""):
            self._tell(f"{self.source}: the bag was not closed, {why}: {frames} there")
