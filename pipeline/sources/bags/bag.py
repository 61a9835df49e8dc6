"""A topic of a bag as frames, in order and by index."""

import contextlib
import struct
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import accumulate
from pathlib import Path
from typing import Any

from dockpose.camera.camera import Camera
from dockpose.files import FileError, read_yaml
from dockpose.sources.bags import storage
from dockpose.sources.bags.messages import CAMERA_INFO, COMPRESSED, IMAGE, camera_in, picture_in
from dockpose.sources.bags.sqlite_file import SqliteFile
from dockpose.sources.bags.storage import BAG_METADATA, Message, Place, Storage, Topic
from dockpose.sources.bags.video import DEFINITIONS, VIDEO, FoxgloveVideo, Packet, Packets
from dockpose.sources.ffmpeg import picture_of
from dockpose.sources.frames import Callback, Frame, Indexed, SourceError, growing
from dockpose.sources.pictures import numeric

_MOST_TIMES = 1000  # that a file expands by, beyond the size of a chunk; dark pictures reach some hundreds
_PART_BYTES = 1 << 20


def opened_files(source: str) -> tuple[list[Storage], bool, contextlib.ExitStack]:
    """The files of a bag, whether its recorder was killed before it closed it, and what closes them."""
    path = Path(source)
    try:
        import mcap.records  # noqa: F401
        import rosbags.typesys  # noqa: F401
    except ImportError as error:
        needed = "needs the packages that read bags: pip install 'dockpose[ros]'"
        raise SourceError(f"{source}: {needed}") from error
    paths, is_by_message, is_unfinished = [path], False, path.is_dir() and not (path / BAG_METADATA).is_file()
    if is_unfinished:
        paths = sorted(filter(storage.is_rosbag2_file, path.iterdir()), key=numeric)
    elif path.is_dir():
        paths, is_by_message = _described(path)
    if not paths:
        raise SourceError(f"{path}: the bag has no files")
    expand = partial(storage.expanded, "zstd") if is_by_message else None
    with contextlib.ExitStack() as stack:
        return [_opened(each, expand, stack) for each in paths], is_unfinished, stack.pop_all()


def _opened(path: Path, expand: Callable[[bytes], bytes] | None, stack: contextlib.ExitStack) -> Storage:
    from dockpose.sources.bags.chunked import McapFile, Ros1File

    try:
        storage.check_regular(path)
        if path.stat().st_size == 0:
            raise SourceError("the file is empty (0 bytes)")
        if is_packed := storage.head_of(path).startswith(storage.ZSTD_BEGINS) or path.suffix.lower() == ".zstd":
            path = _unpacked(path, Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="dockpose-"))))
        ending = storage.ending_of(storage.head_of(path))
        if ending is None and is_packed:
            raise SourceError("is compressed by zstd, and what is in it is no bag")
        ending = ending or path.suffix.lower()  # whose reader says what is amiss
        if ending == ".db3":
            file: Storage = SqliteFile(path, expand)
        else:
            file = McapFile(path) if ending == ".mcap" else Ros1File(path)
    except OSError as error:
        raise SourceError(f"{path}: cannot be read ({error.strerror or error})") from error
    except SourceError as error:
        raise SourceError(f"{path}: {error}") from error
    stack.callback(file.close)
    return file


def _unpacked(path: Path, folder: Path) -> Path:
    """Expand a file that was compressed as a whole into a folder."""
    import zstandard

    unpacked = folder / path.stem
    most = storage.MOST_BYTES + _MOST_TIMES * path.stat().st_size
    too_much = SourceError(f"expands to more than {_MOST_TIMES} times its size, as no bag does")
    try:
        with path.open("rb") as file, unpacked.open("wb") as target:
            if zstandard.frame_content_size(file.read(32)) > most:  # as far as the file says
                raise too_much
            file.seek(0)
            reader = zstandard.ZstdDecompressor().stream_reader(file)
            while part := reader.read(_PART_BYTES):
                target.write(part)
                if target.tell() > most:
                    raise too_much
    except zstandard.ZstdError as error:
        raise SourceError(f"is damaged: {error}") from error
    return unpacked


def _described(folder: Path) -> tuple[list[Path], bool]:
    """The files that a folder's metadata.yaml names, and whether messages are compressed one by one."""
    try:
        content = read_yaml(folder / BAG_METADATA)
    except FileError as error:
        raise SourceError(str(error)) from error
    about = content.get("rosbag2_bagfile_information")
    if not isinstance(about, dict) or not isinstance(about.get("relative_file_paths"), list):
        raise SourceError(f"{folder / BAG_METADATA}: describes no bag: it names no relative_file_paths")
    paths = list(dict.fromkeys(folder / Path(str(name)).name for name in about["relative_file_paths"]))
    missing = [str(path) for path in paths if not path.is_file()]
    if missing:
        raise SourceError(f"{folder}: the bag's {', '.join(missing)} is not there")
    if about.get("compression_format") not in (None, "", "zstd"):
        raise SourceError(f"{folder}: is compressed by {about['compression_format']!r}; zstd is read")
    return paths, str(about.get("compression_mode", "")).lower() == "message"


_PICTURES = {(kind, encoding) for kind in (IMAGE, COMPRESSED) for encoding in ("cdr", "ros1")} | VIDEO
# Clocks that begin with a program or a simulation count from 0; this is in 1973, before anything was recorded.
_LEAST_UNIX_NS = 10**17
_DECIMALS = 9


@dataclass
class _Index:
    """What a bag's topics have, by one reading of it."""

    topics: dict[str, Topic] = field(default_factory=dict)
    # Of each message of a topic with pictures: its file, where it lies in it, when it was recorded, and its own time
    # stamp, None where it cannot be read.
    frames: dict[str, list[tuple[Storage, Place, int, int | None]]] = field(default_factory=dict)
    cameras: dict[str, Message] = field(default_factory=dict)  # the first of each topic with cameras

    def read(self, file: Storage) -> None:
        """Go through a file of the bag."""
        for message in file.messages():
            topic = message.topic
            if topic[1:] in _PICTURES:
                entry = file, message.place, message.time_ns, _stamp_ns(message)
                self.frames.setdefault(topic.name, []).append(entry)
            elif topic.kind == CAMERA_INFO:
                self.cameras.setdefault(topic.name, message)
        self.topics.update({topic.name: topic for topic in file.topics.values()})


def _stamp_ns(message: Message) -> int | None:
    """The time stamp in the head of a message, in nanoseconds; None where it cannot be read."""
    try:
        if message.topic.encoding == "protobuf":
            return FoxgloveVideo(message.data).stamp_ns
        head = message.data[:12]
        if message.topic.encoding == "ros1":
            _, seconds, nanoseconds = struct.unpack("<III", head)
        else:
            seconds, nanoseconds = struct.unpack("<iI" if head[1] & 1 else ">iI", head[4:])
    except (struct.error, IndexError):
        return None
    return seconds * 10**9 + nanoseconds


def _fields(topic: Topic, data: bytes) -> Any:
    """A message with its fields. Raises SourceError where it is damaged."""
    try:
        if topic.encoding == "protobuf":
            return FoxgloveVideo(data)
        store = _store(topic.encoding)
        return (store.deserialize_ros1 if topic.encoding == "ros1" else store.deserialize_cdr)(data, topic.kind)
    except Exception as error:  # which errors damaged bytes raise is not documented
        raise SourceError(f"the message is damaged ({len(data)} bytes)") from error


class Bag(Indexed):
    """The pictures of one topic of a bag of ROS 1 or ROS 2, or of the only topic with pictures, each read when due."""

    def __init__(self, source: str, tell: Callback | None = None, topic: str | None = None) -> None:
        super().__init__(source, tell)
        self._storages, self._is_unfinished, self._open = opened_files(source)
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
            is_video = self._topic[1:] in VIDEO
            self._packets = Packets(self.count, lambda at: Packet(self._message(at))) if is_video else None
            self._set_clock()
            self.camera, self.camera_topic = self._camera(index)  # and where it is from; None where there is none
        except BaseException as error:
            self.close()
            if isinstance(error, SourceError) and not str(error).startswith(source):
                raise SourceError(f"{source}: {error}") from error
            raise

    def _message(self, index: int) -> Any:
        file, place, _, _ = self._frames[index]
        return _fields(self._topic, file.read(place))

    def _frame(self, index: int) -> Frame:
        name = f"{self.source}: frame {index}"
        try:
            if self._packets is None:
                image = picture_in(self._message(index), name)
            else:
                image = picture_of(self._packets.frame(index))
        except SourceError as error:
            raise SourceError(f"{name}: {error}") from error
        time_ns = self._stamps_ns[index]
        time_unix_s = time_ns / 1e9 if time_ns >= _LEAST_UNIX_NS and not self._runs_back else None
        time_s = round(self._times_ns[index] / 1e9, _DECIMALS)
        return Frame(image, index, time_s, self.source, time_unix_s=time_unix_s)

    def _chosen(self, index: _Index, topic: str | None) -> str:
        """The topic that was asked for, or the only one with pictures."""
        known = index.topics
        pictures = sorted(name for name, one in known.items() if one[1:] in _PICTURES)
        if topic is not None:
            wanted = topic if topic in known or topic.startswith("/") else f"/{topic}"
            if wanted in pictures:
                return wanted
            there = f"it is {known[wanted].kind}" if wanted in known else "there is no such topic"
            listed = f"pictures are on {', '.join(pictures)}" if pictures else "no topic has pictures"
            raise SourceError(f"{self.source}: topic {topic}: {there}; {listed}")
        if not pictures:
            faults = [fault for file in self._storages for fault in file.faults]
            if faults:
                raise SourceError(f"{self.source}: no topic of the bag has pictures that can be read: {faults[0]}")
            others = ", ".join(f"{name} ({one.kind or one.encoding})" for name, one in sorted(known.items()))
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

    def _camera(self, index: _Index) -> tuple[Camera | None, str | None]:
        """The camera that the topic beside that of the pictures describes, and that topic."""
        above = self.topic.rsplit("/", 1)[0]
        names = [f"{above}/camera_info", f"{above.rsplit('/', 1)[0]}/camera_info"]  # of a compressed one, one level up
        # By the name that ROS gives to pictures of which a program took the distortion out.
        is_rectified = "rect" in self.topic.removesuffix("/compressed").rsplit("/")[-1]
        for name in names[: 1 if self._topic.kind == IMAGE else 2]:
            if name not in index.cameras:
                continue
            message = index.cameras[name]
            try:
                camera = camera_in(_fields(message.topic, message.data), is_rectified)
            except ValueError as error:
                self._tell(f"{self.source}: the camera of {name} cannot be used ({error})")
                continue
            if camera is not None:
                return camera, name
            self._tell(f"{self.source}: the camera of {name} was not calibrated (its focal length is 0)")
        return None, None

    def _tell_faults(self) -> None:
        for fault in [fault for file in self._storages for fault in file.faults]:
            self._skip(f"{self.source}: {fault}")
        frames = "1 frame is" if self.count == 1 else f"{self.count} frames are"
        if any(file.is_cut_short for file in self._storages):
            self.is_cut_short = True
            self._tell(f"{self.source}: the bag is cut short: {frames} there")
        elif self._is_unfinished:
            self._tell(f"{self.source}: the bag was not closed, as it has no metadata.yaml: {frames} there")


@lru_cache(maxsize=2)
def _store(encoding: str) -> Any:
    """What reads messages; it compiles itself for each type of message, which takes longer than many messages."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE)
    for name, definition in DEFINITIONS.items():
        store.register(get_types_from_msg(definition, name))
    return store
