"""MCAP files and bags of ROS 1, by their index; those without one, such as files that break off, record by record."""

import contextlib
import io
import struct
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import Any, BinaryIO

from dockpose.sources.bags import storage

_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _DATA_END = 0x02, 0x03, 0x04, 0x05, 0x0F
_END = struct.Struct("<BQQQI8s")  # the footer (kind, length, where summary and offsets begin, checksum) and the magic
_HEAD = struct.Struct("<BQ")  # of every record: what it is, and the length of its content
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, number, when recorded, when published


class McapFile(storage.ChunkedFile):
    """An MCAP file: https://mcap.dev/spec."""

    _magic, _refusal, _chunk_kind = b"\x89MCAP0\r\n", "is not an MCAP file", 0x06

    def __init__(self, path: Path) -> None:
        self._schemas: dict[int, str] = {}
        self._indexed: list[tuple[int, dict[int, int]]] = []
        super().__init__(path)

    def places(self, topics: Collection[int]) -> list[storage.Place]:
        """Where the messages of some channels lie, in the order in which they were recorded."""
        found = super().places(topics)
        for chunk, index_of in self._indexed:
            for topic in index_of.keys() & topics:
                content = self._record(index_of[topic]).data(self._file)[6:]
                entries = struct.iter_unpack("<QQ", content[: len(content) // 16 * 16])
                found += [storage.Place(time_ns, topic, self, chunk, offset) for time_ns, offset in entries]
        return sorted(found, key=lambda place: (place.chunk, place.offset)) if self._indexed else found

    def _read(self, place: storage.Place) -> bytes:
        for stream, record in self._records_from(place):
            return record.data(stream)[_MESSAGE_HEAD.size :]
        raise ValueError("its index leads beyond its end")

    def _read_index(self, path: Path) -> bool:
        from mcap.records import Channel, ChunkIndex, Schema, Statistics

        by_kind: dict[type, list[Any]] = {Channel: [], ChunkIndex: [], Schema: [], Statistics: []}
        for record in self._summary():
            by_kind.get(type(record), []).append(record)
        chunks, counted = by_kind[ChunkIndex], by_kind[Statistics]
        if not by_kind[Channel] or not counted or counted[0].chunk_count != len(chunks):
            return False
        starts = [at for chunk in chunks for at in chunk.message_index_offsets.values()]
        is_indexed = all(chunk.message_index_offsets for chunk in chunks) and len(set(starts)) == len(starts)
        if not is_indexed or (counted[0].message_count and not chunks):
            return False
        for record in (*by_kind[Schema], *by_kind[Channel]):
            self._note(record)
        self._indexed = [(chunk.chunk_start_offset, chunk.message_index_offsets) for chunk in chunks]
        return True

    def _summary(self) -> list[Any]:
        """The records of the summary at the end of the file; none where it is not there or not whole."""
        from mcap.exceptions import McapError
        from mcap.stream_reader import StreamReader

        self._file.seek(max(0, self._length - _END.size))
        end = self._file.read()
        if len(end) < _END.size or end[-8:] != self._magic:
            return []
        kind, _, start, _, checksum, _ = _END.unpack(end)
        size = self._length - _END.size - start
        if kind != _FOOTER or start < len(self._magic) or not 0 < size <= storage.MOST_BYTES:
            return []
        self._file.seek(start)
        summary = self._file.read(size) + end
        if checksum and zlib.crc32(summary[:-12]) != checksum:
            self.faults.append("its index does not match its checksum, so it is read record by record")
            return []
        try:
            return list(StreamReader(io.BytesIO(summary), skip_magic=True, emit_chunks=True).records)
        except (McapError, *storage.DAMAGE):
            return []

    def _note(self, record: Any) -> None:
        """Note a schema or a channel."""
        if hasattr(record, "topic"):
            kind = storage.kind_of_message(self._schemas.get(record.schema_id, ""))
            self.topics[record.id] = storage.Topic(record.topic, kind, record.message_encoding)
        else:
            self._schemas[record.id] = record.name

    def _is_end(self, record: storage.Record) -> bool:
        if record.kind != _DATA_END:
            return False
        self.is_cut_short = False
        checksum = int.from_bytes(record.data(self._file)[:4], "little")
        self._file.seek(0)
        found, left = 0, record.at if checksum else 0  # 0: none is given
        while left > 0 and (part := self._file.read(min(left, 1 << 20))):
            found, left = zlib.crc32(part, found), left - len(part)
        if found != checksum:
            self.faults.append("its data do not match their checksum: some of it is damaged")
        return True

    def _see(self, record: storage.Record, stream: BinaryIO, chunk: int) -> None:
        from mcap.data_stream import ReadDataStream
        from mcap.exceptions import EndOfFile
        from mcap.records import Channel, Schema

        if record.kind == _MESSAGE:
            stream.seek(record.start)
            channel, _, time_ns, _ = _MESSAGE_HEAD.unpack(stream.read(_MESSAGE_HEAD.size))
            self._places.append(storage.Place(time_ns, channel, self, chunk, record.at))
        elif record.kind in (_SCHEMA, _CHANNEL):
            content = ReadDataStream(io.BytesIO(record.data(stream)))
            with contextlib.suppress(EndOfFile):  # others follow
                self._note(Schema.read(content) if record.kind == _SCHEMA else Channel.read(content))

    def _expanded(self, record: storage.Record) -> bytes:
        from mcap.data_stream import ReadDataStream
        from mcap.exceptions import EndOfFile
        from mcap.records import Chunk

        try:
            chunk = Chunk.read(ReadDataStream(io.BytesIO(record.data(self._file))))
        except (EndOfFile, struct.error):  # within its head
            return b""
        size = chunk.uncompressed_size
        storage.check_size(size)
        found = storage.expanded(chunk.compression, chunk.data, size) if chunk.compression else chunk.data[:size]
        if record.is_whole and chunk.uncompressed_crc and zlib.crc32(found) != chunk.uncompressed_crc:
            raise ValueError("a chunk is damaged: it does not match its checksum")
        return found

    def _records(self, stream: BinaryIO, start: int, end: int) -> Iterator[storage.Record]:
        while start + _HEAD.size <= end:
            stream.seek(start)
            kind, length = _HEAD.unpack(stream.read(_HEAD.size))
            begin, start = start, start + _HEAD.size + length
            there = min(length, end - begin - _HEAD.size)
            yield storage.Record(kind, begin, begin + _HEAD.size, there, there == length, {})


_ROS1_MESSAGE, _ROS1_CHUNK_INFO, _ROS1_CONNECTION = 2, 6, 7


class Ros1File(storage.ChunkedFile):
    """A bag of ROS 1: http://wiki.ros.org/Bags/Format/2.0."""

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
        chunks = [record.header["chunk_pos"] for record in index if record.kind == _ROS1_CHUNK_INFO]
        if len(set(chunks)) < len(chunks):
            raise ValueError("its index names a chunk twice")

    def _read(self, place: storage.Place) -> bytes:
        for stream, record in self._records_from(place):
            if record.kind == _ROS1_MESSAGE:  # the connection may be described once more before its message
                return record.data(stream)
        raise ValueError("it is not where the index says")

    def _see(self, record: storage.Record, stream: BinaryIO, chunk: int) -> None:
        if record.kind == _ROS1_CONNECTION:
            kind = storage.kind_of_message(_fields(record.data(stream))["type"].decode())
            self.topics[_number(record, "conn")] = storage.Topic(record.header["topic"].decode(), kind, "ros1")
        elif record.kind == _ROS1_MESSAGE and chunk >= 0:
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
