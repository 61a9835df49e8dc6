"""What all kinds of bag files have in common: messages in order and by their place, and sizes that are read."""

import abc
import bz2
import re
import struct
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from dockpose.sources.frames import SourceError

FOXGLOVE = "foxglove_msgs/msg/"  # before the names of its types
BAG_METADATA = "metadata.yaml"  # beside the files of rosbag2
# Of a chunk or message, expanded. Recorders make chunks of a few MB, or of one message where that is larger: a colour
# picture of 16 bits and 40 megapixels has 240 MB.
MOST_BYTES = 256_000_000
# What Python raises for numbers that lead beyond the file, and for bytes that are no text.
DAMAGE = (ValueError, struct.error, OverflowError, MemoryError, OSError, LookupError, EOFError, RuntimeError)


ZSTD_BEGINS = b"\x28\xb5\x2f\xfd"  # of what was compressed as a whole
_BEGINNINGS = {b"\x89MCAP": ".mcap", b"#ROSBAG V": ".bag", b"SQLite format 3\0": ".db3"}


def ending_of(head: bytes) -> str | None:
    """The usual ending of a bag's name, by its first bytes; None of what is no bag."""
    return next((ending for begins, ending in _BEGINNINGS.items() if head.startswith(begins)), None)


def head_of(path: Path, size: int = 16) -> bytes:
    """The first bytes of a file."""
    with path.open("rb") as file:
        return file.read(size)


def is_rosbag2_file(path: Path) -> bool:
    """Whether a file's name is that of one of the files in a folder that rosbag2 writes."""
    return path.name.lower().removesuffix(".zstd").endswith((".mcap", ".db3"))


def check_regular(source: str | Path) -> None:
    """Raise SourceError for a pipe or a device in place of a file, from which reading might never end."""
    path = Path(source)
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise SourceError(f"{source}: is not a regular file, but a pipe or a device; only files are read")


class Topic(NamedTuple):
    """Messages of one kind under one name."""

    name: str  # as "/camera/image_raw"
    kind: str  # as "sensor_msgs/msg/Image", for ROS 1 as well
    encoding: str  # how messages are serialised: "cdr" by ROS 2, "ros1" by ROS 1


class Place(NamedTuple):
    """Where a message lies."""

    chunk: int  # where its chunk begins in the file; -1 outside of chunks
    offset: int  # where it begins in the chunk or the file, or its number in a database


class Message(NamedTuple):
    """A message as it was recorded."""

    topic: Topic
    time_ns: int  # by the clock of the recording machine
    place: Place
    data: bytes


class Storage(abc.ABC):
    """One file of a bag: gone through once, message by message, and then read at any place, from any thread."""

    _damage: tuple[type[Exception], ...] = DAMAGE

    def __init__(self) -> None:
        self.topics: dict[int, Topic] = {}  # as far as it was gone through
        self.is_cut_short = False
        self.unfinished = ""  # by what it shows that its recorder was killed
        self.faults: list[str] = []
        self._lock = threading.Lock()

    def read(self, place: Place) -> bytes:
        """Return a message's bytes."""
        with self._lock:
            try:
                return self._read(place)
            except self._damage as error:
                raise SourceError(f"a message cannot be read ({error})") from error

    @abc.abstractmethod
    def messages(self) -> Iterator[Message]:
        """Go through the file as far as it is there, and note what is amiss."""

    @abc.abstractmethod
    def _read(self, place: Place) -> bytes:
        """As :meth:`read`; only one thread is in it, and what goes wrong is reported by the caller."""

    @abc.abstractmethod
    def close(self) -> None:
        """Release the file."""


# Foxglove's types as Protocol Buffers, IDL and BlueROV's recorder call them, and ROS's as DDS does.
_OF_FOXGLOVE = "RawImage|CompressedImage|CompressedVideo|CameraCalibration"
_FOXGLOVE_NAME = re.compile(rf"foxglove(?:_msgs)?(?:\.|::|/)(?:msg(?:::|/))?({_OF_FOXGLOVE})")
_DDS_NAME = re.compile(r"(\w+)::msg::(?:dds_::)?(\w+?)_?")


def kind_of_message(name: str) -> str:
    """Name of a message's type as ROS 2 spells it: "sensor_msgs/Image" is "sensor_msgs/msg/Image"."""
    if found := _FOXGLOVE_NAME.fullmatch(name):
        return f"{FOXGLOVE}{found[1]}"
    if found := _DDS_NAME.fullmatch(name):
        return f"{found[1]}/msg/{found[2]}"
    package, _, rest = name.partition("/")
    return name if "/" in rest or not rest else f"{package}/msg/{rest}"


def check_size(size: int) -> None:
    """Raise ValueError for a chunk that says that it is larger, in bytes, than any is read."""
    if size > MOST_BYTES:
        raise ValueError(f"a chunk of {size / 1e6:.0f} MB is larger than the {MOST_BYTES / 1e6:.0f} MB that are read")


def expanded(compression: str, data: bytes, size: int | None = None) -> bytes:
    """Expand a chunk; of one that breaks off, the beginning."""
    check_size(len(data) if size is None else size)
    most = (MOST_BYTES if size is None else size) + 1  # of one more no more is made, but it shows
    try:
        if compression in ("", "none"):
            found = data
        elif compression == "zstd":
            import zstandard

            check_size(max(0, zstandard.frame_content_size(data)))  # -1 where the frame does not say
            with zstandard.ZstdDecompressor(max_window_size=MOST_BYTES).stream_reader(data) as reader:
                found = reader.read(most)
        elif compression == "lz4":
            import lz4.frame

            found = lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most)
        elif compression == "bz2":
            found = bz2.BZ2Decompressor().decompress(data, max_length=most)
        else:
            raise ValueError(f"is compressed by {compression!r}; zstd, lz4 and bz2 are read")
    except ValueError:
        raise
    except Exception as error:  # each library has its own
        raise ValueError(f"a chunk is damaged: {error}") from error
    if len(found) >= most:
        raise ValueError(f"a chunk is damaged: it holds more than the {(most - 1) / 1e6:.3g} MB that it may")
    return found
