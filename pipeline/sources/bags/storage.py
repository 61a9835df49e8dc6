"""What all kinds of bag files have in common: topics, and where each message lies."""

from __future__ import annotations

import abc
import bz2
import threading
from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

from dockpose.sources.frames import SourceError

# Of a chunk or message, expanded. Recorders make chunks of a few MB, or of one message where that is larger: a colour
# picture of 16 bits and 40 megapixels has 240 MB.
MOST_BYTES = 256_000_000
MOST_RECORDS = 500_000  # of a chunk that is gone through record by record; a MB holds at most some ten thousand

NEEDS = "needs the packages that read bags: pip install 'dockpose[ros]'"


@dataclass(frozen=True)
class Topic:
    """Messages of one kind under one name; a name has several where several programs published on it."""

    name: str  # as "/camera/image_raw"
    kind: str  # as "sensor_msgs/msg/Image", for ROS 1 as well
    encoding: str  # how messages are serialised: "cdr" by ROS 2, "ros1" by ROS 1


class Place(NamedTuple):
    """Where a message lies."""

    time_ns: int  # when it was recorded, by the clock of the recording machine
    topic: int  # key of its topic
    file: int  # which file of the bag
    chunk: int  # where its chunk begins in the file
    offset: int  # where it begins in the chunk or the file, or its number in a database


class Storage(abc.ABC):
    """One file of a bag, of which messages are read one by one, from any thread."""

    def __init__(self) -> None:
        self.topics: dict[int, Topic] = {}
        self.is_cut_short = False
        self.faults: list[str] = []
        self._lock = threading.Lock()

    @abc.abstractmethod
    def places(self, topics: Collection[int]) -> list[Place]:
        """Where the messages of some topics lie, in the order in which they were recorded."""

    def read(self, place: Place) -> bytes:
        """Return a message's bytes."""
        with self._lock:
            try:
                return self._read(place)
            except (OSError, ValueError, EOFError, KeyError, RuntimeError) as error:
                raise SourceError(f"a message cannot be read ({error})") from error

    @abc.abstractmethod
    def _read(self, place: Place) -> bytes:
        """As :meth:`read`; only one thread is in it, and what goes wrong is reported by the caller."""

    @abc.abstractmethod
    def close(self) -> None:
        """Release the file."""


def kind_of_message(name: str) -> str:
    """Name of a message's type as ROS 2 spells it: "sensor_msgs/Image" is "sensor_msgs/msg/Image"."""
    package, _, rest = name.partition("/")
    return name if "/" in rest or not rest else f"{package}/msg/{rest}"


def check_size(size: int) -> None:
    """Raise ValueError for a chunk that says that it is larger, in bytes, than any is read."""
    if size > MOST_BYTES:
        raise ValueError(f"a chunk of {size / 1e6:.0f} MB is larger than the {MOST_BYTES / 1e6:.0f} MB that are read")


def expanded(compression: str, data: bytes, size: int | None = None) -> bytes:
    """Expand a chunk; of one that breaks off, the beginning."""
    check_size(size or 0)
    most = (MOST_BYTES if size is None else size) + 1  # of one more no more is made, but it shows
    try:
        if compression == "zstd":
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
    if len(found) == most:
        raise ValueError(f"a chunk is damaged: it holds more than the {(most - 1) / 1e6:.3g} MB that it may")
    return found
