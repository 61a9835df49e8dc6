"""What all kinds of bag files have in common: topics, and where each message lies."""

from __future__ import annotations

import abc
import bz2
import threading
from collections.abc import Collection
from dataclasses import dataclass
from typing import NamedTuple

from dockpose.sources.frames import SourceError

_MOST_BYTES = 256_000_000  # of a chunk; recorders make them of a few MB

NEEDS = "needs the packages that read bags: pip install 'dockpose[ros]'"


@dataclass(frozen=True)
class Topic:
    """Messages of one kind under one name; a name has several where several programs published on it.

    Attributes
    ----------
    name : str
        As "/camera/image_raw".
    kind : str
        As "sensor_msgs/msg/Image", for ROS 1 as well.
    encoding : str
        How messages are serialised: "cdr" by ROS 2, "ros1" by ROS 1; others are not read.
    """

    name: str
    kind: str
    encoding: str


class Place(NamedTuple):
    """Where a message lies.

    Attributes
    ----------
    time_ns : int, nanoseconds
        When it was recorded, by the clock of the recording machine.
    topic : int
        Key of its topic.
    file : int
        Which file of the bag.
    chunk : int
        Where its chunk begins in the file; -1 where it lies in none.
    offset : int
        Where it begins in the chunk or the file, or its number in a database.
    """

    time_ns: int
    topic: int
    file: int
    chunk: int
    offset: int


class Storage(abc.ABC):
    """One file of a bag, of which messages are read one by one, from any thread.

    Attributes
    ----------
    topics : dict of int to Topic
        By their keys, which are those of the file.
    is_cut_short : bool
        Whether the end of the file is missing; what is there is read.
    """

    def __init__(self) -> None:
        self.topics: dict[int, Topic] = {}
        self.is_cut_short = False
        self._lock = threading.Lock()

    @abc.abstractmethod
    def places(self, topics: Collection[int]) -> list[Place]:
        """Where the messages of some topics lie, in the order in which they were recorded."""

    def read(self, place: Place) -> bytes:
        """Return a message's bytes.

        Raises
        ------
        SourceError
            If they cannot be read.
        """
        with self._lock:
            try:
                return self._read(place)
            except (OSError, ValueError, EOFError, KeyError, RuntimeError) as error:
                raise SourceError(f"a message cannot be read ({error})") from error

    @abc.abstractmethod
    def _read(self, place: Place) -> bytes:
        """As :meth:`read`; only one thread is in it, and what goes wrong is told by the caller."""

    @abc.abstractmethod
    def close(self) -> None:
        """Release the file."""


def kind_of_message(name: str) -> str:
    """Name of a message's type as ROS 2 spells it: "sensor_msgs/Image" is "sensor_msgs/msg/Image"."""
    package, _, rest = name.partition("/")
    return name if "/" in rest or not rest else f"{package}/msg/{rest}"


def expanded(compression: str, data: bytes) -> bytes:
    """Expand a chunk; of one that breaks off, the beginning.

    Parameters
    ----------
    compression : str
        "zstd", "lz4" or "bz2".
    data : bytes
        The compressed chunk; at most 256 MB come of it.

    Raises
    ------
    ValueError
        If it is damaged, or the compression is another one.
    """
    try:
        if compression == "zstd":
            import zstandard

            with zstandard.ZstdDecompressor().stream_reader(data) as reader:
                return reader.read(_MOST_BYTES)
        if compression == "lz4":
            import lz4.frame

            return lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=_MOST_BYTES)
        if compression == "bz2":
            return bz2.BZ2Decompressor().decompress(data, max_length=_MOST_BYTES)
    except Exception as error:  # each library has its own
        raise ValueError(f"a chunk is damaged: {error}") from error
    raise ValueError(f"is compressed by {compression!r}; zstd, lz4 and bz2 are read")
