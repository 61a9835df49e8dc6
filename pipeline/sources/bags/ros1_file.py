"""Bags of ROS 1, by their index; those that were not closed or break off, record by record."""

from __future__ import annotations

import contextlib
import io
import os
import struct
from collections.abc import Collection, Iterator
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from dockpose.sources.bags.storage import MOST_RECORDS, Place, Storage, Topic, check_size, expanded
from dockpose.sources.frames import SourceError

_MAGIC = b"#ROSBAG V2.0\n"
_MESSAGE, _CHUNK, _CHUNK_INFO, _CONNECTION = 2, 5, 6, 7


class Ros1File(Storage):
    """A bag of ROS 1, format 2.0.

    The format: http://wiki.ros.org/Bags/Format/2.0
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        super().__init__()
        from rosbags.rosbag1 import Reader, ReaderError

        self._number = number
        self._file: BinaryIO = path.open("rb")
        self._kept: tuple[int, bytes] = (-1, b"")
        self._found: list[Place] = []
        try:
            if self._file.read(len(_MAGIC)) != _MAGIC:
                raise SourceError("is not a bag of ROS 1 in format 2.0")
            self._length = self._file.seek(0, os.SEEK_END)
            try:
                self._check_index()
                with Reader(path) as reader:
                    self._take_index(reader)
            except (ReaderError, StopIteration, ValueError, LookupError, AssertionError, struct.error):
                self._scan()
        except BaseException:
            self._file.close()
            raise

    def places(self, topics: Collection[int]) -> list[Place]:
        """Where the messages of some connections lie, in the order in which they were recorded."""
        found = (place for place in self._found if place.topic in topics)
        return sorted(found, key=lambda place: (place.chunk, place.offset))

    def close(self) -> None:
        """Release the file."""
        self._file.close()

    def _check_index(self) -> None:
        """Raise ValueError where the index names a chunk twice, whose entries would be read each time."""
        begin = next(_records(self._file, len(_MAGIC), self._length)).number("index_pos")
        index = _records(self._file, begin, self._length)
        chunks = [record.number("chunk_pos") for record in index if record.kind == _CHUNK_INFO]
        if len(set(chunks)) < len(chunks):
            raise ValueError("its index names a chunk twice")

    def _take_index(self, reader: Any) -> None:
        for connection in reader.connections:
            self.topics[connection.id] = Topic(connection.topic, connection.msgtype, "ros1")
            self._found += [
                Place(entry.time, connection.id, self._number, entry.chunk_pos, entry.offset)
                for entry in reader.indexes[connection.id]
            ]

    def _read(self, place: Place) -> bytes:
        if self._kept[0] != place.chunk:
            record = next(_records(self._file, place.chunk, self._length))
            self._kept = (place.chunk, self._expanded(record))
        chunk = io.BytesIO(self._kept[1])
        for record in _records(chunk, place.offset, len(self._kept[1])):
            if record.kind == _MESSAGE:  # the connection may be described once more before its message
                return record.data(chunk)
        raise ValueError("it is not where the index says")

    def _scan(self) -> None:
        """Go through the whole file, as far as it is there."""
        self.is_cut_short = True
        self.topics.clear()
        self._found.clear()
        for record in _records(self._file, len(_MAGIC), self._length):
            if record.kind != _CHUNK:
                continue
            try:
                content = self._expanded(record)
            except (ValueError, KeyError) as error:  # others follow
                self.faults.append(f"at byte {record.at}, {error}; what is in it is left out")
                continue
            chunk = io.BytesIO(content)
            for inner in islice(_records(chunk, 0, len(content)), MOST_RECORDS):
                if inner.start + inner.length <= len(content):
                    with contextlib.suppress(ValueError, KeyError, struct.error):  # a damaged record; others follow
                        self._see(inner, chunk, record.at)

    def _see(self, record: _Record, chunk: BinaryIO, at: int) -> None:
        """Note a record of the chunk that begins there, if it is of concern."""
        from rosbags.typesys.msg import normalize_msgtype

        if record.kind == _CONNECTION:
            kind = _fields(record.data(chunk))["type"].decode()
            self.topics[record.number("conn")] = Topic(record.header["topic"].decode(), normalize_msgtype(kind), "ros1")
        elif record.kind == _MESSAGE:
            seconds, nanoseconds = struct.unpack("<II", record.header["time"])
            time_ns = seconds * 10**9 + nanoseconds
            self._found.append(Place(time_ns, record.number("conn"), self._number, at, record.at))

    def _expanded(self, record: _Record) -> bytes:
        """The records of a chunk; of one that breaks off, the beginning."""
        compression, size = record.header["compression"].decode(), record.number("size")
        check_size(max(size, record.length if compression == "none" else 0))
        data = record.data(self._file)
        if compression not in ("none", "bz2", "lz4"):
            raise ValueError(f"a chunk is compressed by {compression!r}; bz2 and lz4 are read")
        return data if compression == "none" else expanded(compression, data, size)


class _Record(NamedTuple):
    """A record of a file or chunk: its header, where it and its data begin, and the length of its data."""

    header: dict[str, bytes]
    at: int
    start: int
    length: int

    @property
    def kind(self) -> int:
        return self.header["op"][0]

    def number(self, name: str) -> int:
        return int.from_bytes(self.header[name], "little")

    def data(self, stream: BinaryIO) -> bytes:
        stream.seek(self.start)
        return stream.read(self.length)


def _records(stream: BinaryIO, start: int, end: int) -> Iterator[_Record]:
    """The records of a file or chunk; the data of the last need not be there as a whole."""
    while start + 4 <= end:
        stream.seek(start)
        size = int.from_bytes(stream.read(4), "little")
        header = stream.read(size)
        length = stream.read(4)
        fields = _fields(header)
        if len(header) < size or len(length) < 4 or len(fields.get("op", b"")) != 1:
            return
        yield _Record(fields, start, start + 8 + size, int.from_bytes(length, "little"))
        start += 8 + size + int.from_bytes(length, "little")


def _fields(header: bytes) -> dict[str, bytes]:
    """Names and values of a header."""
    fields, start = {}, 0
    while start + 4 <= len(header):
        size = int.from_bytes(header[start : start + 4], "little")
        name, _, value = header[start + 4 : start + 4 + size].partition(b"=")
        fields[name.decode("ascii", "replace")] = value
        start += 4 + size
    return fields
