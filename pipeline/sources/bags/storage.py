"""What all kinds of bag files have in common: topics, where each message lies, and chunks of records."""

import abc
import bz2
import contextlib
import io
import os
import struct
import threading
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO, NamedTuple

from dockpose.sources.frames import SourceError

BAG_METADATA = "metadata.yaml"  # beside the files of rosbag2
# Of a chunk or message, expanded. Recorders make chunks of a few MB, or of one message where that is larger: a colour
# picture of 16 bits and 40 megapixels has 240 MB.
MOST_BYTES = 256_000_000
MOST_RECORDS = 500_000  # of a chunk that is gone through record by record; a MB holds at most some ten thousand
# What Python raises for numbers that lead beyond the file, and for bytes that are no text.
DAMAGE = (ValueError, struct.error, OverflowError, MemoryError, OSError, LookupError, EOFError, RuntimeError)


def is_rosbag2_file(path: Path) -> bool:
    """Whether a file's name is that of one of the files in a folder that rosbag2 writes."""
    return path.name.lower().removesuffix(".zstd").endswith((".mcap", ".db3"))


def check_regular(source: str | Path) -> None:
    """Raise SourceError for a pipe or a device in place of a file, from which reading might never end."""
    path = Path(source)
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise SourceError(f"{source}: is not a regular file, but a pipe or a device; only files are read")


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
    file: "Storage"  # of the bag
    chunk: int  # where its chunk begins in the file; -1 outside of chunks
    offset: int  # where it begins in the chunk or the file, or its number in a database


class Storage(abc.ABC):
    """One file of a bag, of which messages are read one by one, from any thread."""

    def __init__(self) -> None:
        self.topics: dict[int, Topic] = {}
        self.is_cut_short = False
        self.faults: list[str] = []
        self._places: list[Place] = []
        self._lock = threading.Lock()

    def places(self, topics: Collection[int]) -> list[Place]:
        """Where the messages of some topics lie, in the order in which they were recorded."""
        return [place for place in self._places if place.topic in topics]

    def read(self, place: Place) -> bytes:
        """Return a message's bytes."""
        with self._lock:
            try:
                return self._read(place)
            except DAMAGE as error:
                raise SourceError(f"a message cannot be read ({error})") from error

    @abc.abstractmethod
    def _read(self, place: Place) -> bytes:
        """As :meth:`read`; only one thread is in it, and what goes wrong is reported by the caller."""

    @abc.abstractmethod
    def close(self) -> None:
        """Release the file."""


class Record(NamedTuple):
    """A record of a file or chunk, as far as it is there."""

    kind: int
    at: int  # where it begins
    start: int  # where its data begin
    length: int  # of its data
    is_whole: bool
    header: dict[str, bytes]  # names and values, which ROS 1 has

    def data(self, stream: BinaryIO) -> bytes:
        """What is in it."""
        stream.seek(self.start)
        return stream.read(self.length)


class ChunkedFile(Storage):
    """A file of records, of which chunks hold others; read by its index, or else record by record."""

    _magic: bytes
    _refusal: str
    _chunk_kind: int

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file: BinaryIO = path.open("rb")
        self._kept: tuple[int, bytes] = (-1, b"")
        try:
            if self._file.read(len(self._magic)) != self._magic:
                raise SourceError(self._refusal)
            self._length = self._file.seek(0, os.SEEK_END)
            if not self._read_index(path):
                self.is_cut_short = True
                self._scan()
        except BaseException:
            self._file.close()
            raise

    def close(self) -> None:
        """Release the file."""
        self._file.close()

    @abc.abstractmethod
    def _read_index(self, path: Path) -> bool:
        """Take topics and places from the index; False where it is not there or not whole."""

    @abc.abstractmethod
    def _records(self, stream: BinaryIO, start: int, end: int) -> Iterator[Record]:
        """The records of a file or chunk from one of them on."""

    @abc.abstractmethod
    def _expanded(self, record: Record) -> bytes:
        """The records of a chunk; of one that breaks off, the beginning. Raises ValueError where it is damaged."""

    @abc.abstractmethod
    def _see(self, record: Record, stream: BinaryIO, chunk: int) -> None:
        """Note a record, if it is of concern."""

    def _is_end(self, record: Record) -> bool:
        """Whether what follows is no data any more."""
        return False

    def _records_from(self, place: Place) -> Iterator[tuple[BinaryIO, Record]]:
        """The record there and those that follow it, each with what it lies in."""
        stream, end = self._file, self._length
        if place.chunk >= 0:
            if self._kept[0] != place.chunk:
                self._kept = (place.chunk, self._content(self._record(place.chunk)))
            stream, end = io.BytesIO(self._kept[1]), len(self._kept[1])
        for record in self._records(stream, place.offset, end):
            yield stream, record

    def _record(self, at: int) -> Record:
        """The record of the file that begins there."""
        for record in self._records(self._file, at, self._length):
            return record
        raise SourceError("its index leads beyond its end")

    def _content(self, record: Record) -> bytes:
        try:
            return self._expanded(record)
        except DAMAGE as error:
            raise ValueError(f"at byte {record.at}, {error}") from error

    def _scan(self) -> None:
        """Go through the whole file, as far as it is there."""
        for record in self._records(self._file, len(self._magic), self._length):
            if self._is_end(record):
                return
            if record.kind == self._chunk_kind:
                self._scan_chunk(record)
            else:
                self._try_to_see(record, self._file, -1)

    def _scan_chunk(self, record: Record) -> None:
        try:
            content = self._content(record)
        except ValueError as error:  # others follow
            self.faults.append(f"{error}; what is in it is left out")
            return
        chunk = io.BytesIO(content)
        for count, inner in enumerate(self._records(chunk, 0, len(content))):
            if count == MOST_RECORDS:
                what = f"the chunk at byte {record.at} has over {count} records"
                self.faults.append(f"{what}; those behind are left out")
                return
            self._try_to_see(inner, chunk, record.at)

    def _try_to_see(self, record: Record, stream: BinaryIO, chunk: int) -> None:
        if record.is_whole:
            with contextlib.suppress(*DAMAGE):  # others follow
                self._see(record, stream, chunk)


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
