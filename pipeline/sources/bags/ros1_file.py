"""Bags of ROS 1 (http://wiki.ros.org/Bags/Format/2.0), by their index; those that break off, record by record."""

import struct
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from dockpose.sources.bags import storage

_MESSAGE, _CHUNK_INFO, _CONNECTION = 2, 6, 7


class Ros1File(storage.ChunkedFile):
    """A bag of ROS 1, format 2.0."""

    _magic, _refusal, _chunk_kind = b"#ROSBAG V2.0\n", "is not a bag of ROS 1 in format 2.0", 5

    def _read_index(self, path: Path) -> bool:
        from rosbags.rosbag1 import Reader, ReaderError

        try:
            self._check_index()
            with Reader(path) as reader:
                for connection in reader.connections:
                    self.topics[connection.id] = storage.Topic(connection.topic, connection.msgtype, "ros1")
                    self._places += [
                        storage.Place(entry.time, connection.id, self, entry.chunk_pos, entry.offset)
                        for entry in reader.indexes[connection.id]
                    ]
        except (ReaderError, StopIteration, AssertionError, *storage.DAMAGE):
            self.topics.clear()
            self._places.clear()
            return False
        self._places.sort(key=lambda place: (place.chunk, place.offset))
        return True

    def _check_index(self) -> None:
        """Raise ValueError where the index names a chunk twice, whose entries would be read each time."""
        begin = _number(next(self._records(self._file, len(self._magic), self._length)), "index_pos")
        index = self._records(self._file, begin, self._length)
        chunks = [record.header["chunk_pos"] for record in index if record.kind == _CHUNK_INFO]
        if len(set(chunks)) < len(chunks):
            raise ValueError("its index names a chunk twice")

    def _read(self, place: storage.Place) -> bytes:
        for stream, record in self._records_from(place):
            if record.kind == _MESSAGE:  # the connection may be described once more before its message
                return record.data(stream)
        raise ValueError("it is not where the index says")

    def _see(self, record: storage.Record, stream: BinaryIO, chunk: int) -> None:
        if record.kind == _CONNECTION:
            kind = storage.kind_of_message(_fields(record.data(stream))["type"].decode())
            self.topics[_number(record, "conn")] = storage.Topic(record.header["topic"].decode(), kind, "ros1")
        elif record.kind == _MESSAGE and chunk >= 0:
            seconds, nanoseconds = struct.unpack("<II", record.header["time"])
            time_ns = seconds * 10**9 + nanoseconds
            self._places.append(storage.Place(time_ns, _number(record, "conn"), self, chunk, record.at))

    def _expanded(self, record: storage.Record) -> bytes:
        compression, size = record.header["compression"].decode(), _number(record, "size")
        storage.check_size(max(size, record.length if compression == "none" else 0))
        if compression not in ("none", "bz2", "lz4"):
            raise ValueError(f"a chunk is compressed by {compression!r}; bz2 and lz4 are read")
        data = record.data(self._file)
        return data if compression == "none" else storage.expanded(compression, data, size)

    def _records(self, stream: BinaryIO, start: int, end: int) -> Iterator[storage.Record]:
        while start + 4 <= end:
            stream.seek(start)
            size = int.from_bytes(stream.read(4), "little")
            header = stream.read(min(size, end))
            length = stream.read(4)
            fields = _fields(header)
            if len(header) < size or len(length) < 4 or len(fields.get("op", b"")) != 1:
                return
            begin, data_at, wanted = start, start + 8 + size, int.from_bytes(length, "little")
            start = data_at + wanted
            there = min(wanted, end - data_at)
            yield storage.Record(fields["op"][0], begin, data_at, there, there == wanted, fields)


def _number(record: storage.Record, name: str) -> int:
    return int.from_bytes(record.header[name], "little")


def _fields(header: bytes) -> dict[str, bytes]:
    """Names and values of a header."""
    fields, start = {}, 0
    while start + 4 <= len(header):
        size = int.from_bytes(header[start : start + 4], "little")
        name, _, value = header[start + 4 : start + 4 + size].partition(b"=")
        fields[name.decode("ascii", "replace")] = value
        start += 4 + size
    return fields
