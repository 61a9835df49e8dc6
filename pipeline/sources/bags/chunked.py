"""MCAP files and bags of ROS 1, whose records the libraries `mcap` and `rosbags` parse, as far as a file goes."""

import abc
import contextlib
import io
import struct
import zlib
from collections.abc import Iterator
from itertools import islice
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

from dockpose.sources.bags import storage
from dockpose.sources.bags.storage import Message, Place, Storage, Topic
from dockpose.sources.frames import SourceError
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, Footer, Schema
from mcap.records import Message as McapMessage
from rosbags.rosbag1.reader import Header, ReaderError, RecordType, read_uint32

MOST_RECORDS = 500_000  # of a chunk; a MB holds at most some ten thousand
_HEAD = struct.Struct("<BQ")  # of each record of MCAP: what it is, and the length of its content
_FOOTER_BYTES = 37  # with the magic behind it
_MOST_RECORD = storage.MOST_BYTES + 1000  # with the head of a chunk
DAMAGE = (McapError, ReaderError, *storage.DAMAGE)


class _Record(NamedTuple):
    """A record of a file or chunk, as far as it is there."""

    kind: int
    data: bytes
    length: int  # of the data, as the record says
    header: Any = None  # of ROS 1, a `rosbags.rosbag1.reader.Header`


class ChunkedFile(Storage):
    """A file of records, of which chunks hold others."""

    _damage = DAMAGE
    _magic: bytes
    _refusal: str
    _chunk: int  # kind of a record that holds others

    def __init__(self, path: Path) -> None:
        super().__init__()
        self._file: BinaryIO = path.open("rb")
        self._kept: tuple[int, bytes] = (-1, b"")  # the chunk that was read last
        self.is_cut_short = True  # until its end is there
        if self._file.read(len(self._magic)) != self._magic:
            self._file.close()
            raise SourceError(self._refusal)

    def close(self) -> None:
        """Release the file."""
        self._file.close()

    def messages(self) -> Iterator[Message]:
        """Go through the file as far as it is there, and note what is amiss."""
        with contextlib.suppress(StopIteration, *DAMAGE):
            self._note_end()
        for at, record in self._records(self._file, len(self._magic)):
            if record.kind != self._chunk:
                yield from self._seen(record, Place(-1, at))
                continue
            try:
                self._kept = at, self._expanded(record)
            except DAMAGE as error:  # others follow
                self.faults.append(f"at byte {at}, {error}; what is in it is left out")
                continue
            inner = self._records(io.BytesIO(self._kept[1]), 0)
            for offset, each in islice(inner, MOST_RECORDS):
                yield from self._seen(each, Place(at, offset))
            if next(inner, None) is not None:
                what = f"the chunk at byte {at} has over {MOST_RECORDS} records"
                self.faults.append(f"{what}; those behind are left out")

    def _seen(self, record: _Record, place: Place) -> Iterator[Message]:
        try:
            found = self._note(record)
        except DAMAGE:  # others follow
            return
        if found is not None and found[0] in self.topics:
            yield Message(self.topics[found[0]], found[1], place, found[2])

    def _read(self, place: Place) -> bytes:
        stream = self._file
        if place.chunk >= 0:
            if self._kept[0] != place.chunk:
                _, record = next(self._records(self._file, place.chunk))
                self._kept = place.chunk, self._expanded(record)
            stream = io.BytesIO(self._kept[1])
        for _, record in self._records(stream, place.offset):
            if found := self._note(record):
                return found[2]
        raise ValueError("it is not where it was")

    @abc.abstractmethod
    def _note_end(self) -> None:
        """Note the topics that are described at the end too, where no damaged chunk hides them."""

    def _records(self, stream: BinaryIO, start: int) -> Iterator[tuple[int, _Record]]:
        """The records of a file or a chunk from one of them on, each with where it begins, as far as they are there."""
        with contextlib.suppress(*DAMAGE):  # where it is damaged it ends
            stream.seek(start)
            yield from self._parsed(stream, start)

    @abc.abstractmethod
    def _parsed(self, stream: BinaryIO, at: int) -> Iterator[tuple[int, _Record]]:
        """As :meth:`_records`; of a chunk that breaks off the beginning comes too."""

    @abc.abstractmethod
    def _expanded(self, record: _Record) -> bytes:
        """The records of a chunk; of one that breaks off, the beginning. Raises ValueError where it is damaged."""

    @abc.abstractmethod
    def _note(self, record: _Record) -> tuple[int, int, bytes] | None:
        """Note a topic; of a message return the key of its topic, its time in nanoseconds and its bytes."""


class McapFile(ChunkedFile):
    """An MCAP file: https://mcap.dev/spec."""

    _magic, _refusal, _chunk = b"\x89MCAP0\r\n", "is not an MCAP file", Opcode.CHUNK

    def _note_end(self) -> None:
        self._schemas: dict[int, str] = {}
        self._file.seek(-_FOOTER_BYTES, io.SEEK_END)
        footer = self._file.read(_FOOTER_BYTES)[_HEAD.size :]
        for _, record in self._records(self._file, Footer.read(_stream(footer)).summary_start):
            self._note(record)

    def _parsed(self, stream: BinaryIO, at: int) -> Iterator[tuple[int, _Record]]:
        checksum = zlib.crc32(self._magic)  # of all before, where the file is gone through from its beginning
        while len(head := stream.read(_HEAD.size)) == _HEAD.size:
            kind, length = _HEAD.unpack(head)
            data = stream.read(min(length, _MOST_RECORD))
            if kind == Opcode.DATA_END and stream is self._file:
                self.is_cut_short = False
                given = int.from_bytes(data[:4], "little")  # 0: none is given
                if given and given != checksum:
                    self.faults.append("its data do not match their checksum: some of it is damaged")
                return
            if len(data) == length or kind == self._chunk:
                yield at, _Record(kind, data, length)
            checksum = zlib.crc32(data, zlib.crc32(head, checksum))
            at = stream.seek(at + _HEAD.size + length)

    def _expanded(self, record: _Record) -> bytes:
        chunk = Chunk.read(_stream(record.data))
        found = storage.expanded(chunk.compression, chunk.data, chunk.uncompressed_size)
        is_whole = len(record.data) == record.length
        if is_whole and chunk.uncompressed_crc and zlib.crc32(found) != chunk.uncompressed_crc:
            raise ValueError("a chunk is damaged: it does not match its checksum")
        return found

    def _note(self, record: _Record) -> tuple[int, int, bytes] | None:
        stream = _stream(record.data)
        if record.kind == Opcode.MESSAGE:
            message = McapMessage.read(stream, record.length)
            return message.channel_id, message.log_time, message.data
        if record.kind == Opcode.CHANNEL:
            channel = Channel.read(stream)
            kind = storage.kind_of_message(self._schemas.get(channel.schema_id, ""))
            self.topics[channel.id] = Topic(channel.topic, kind, channel.message_encoding)
        elif record.kind == Opcode.SCHEMA:
            schema = Schema.read(stream)
            self._schemas[schema.id] = schema.name
        return None


def _stream(data: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(data))


class Ros1File(ChunkedFile):
    """A bag of ROS 1: http://wiki.ros.org/Bags/Format/2.0."""

    _magic, _refusal, _chunk = b"#ROSBAG V2.0\n", "is not a bag of ROS 1 in format 2.0", RecordType.CHUNK

    def _note_end(self) -> None:
        _, head = next(self._records(self._file, len(self._magic)))
        begin, chunks = head.header.get_uint64("index_pos"), head.header.get_uint32("chunk_count")
        for _, record in self._records(self._file, begin) if begin else ():  # 0: it was not closed
            self._note(record)
            chunks -= record.kind == RecordType.CHUNK_INFO
        self.is_cut_short = not begin or chunks > 0

    def _parsed(self, stream: BinaryIO, at: int) -> Iterator[tuple[int, _Record]]:
        while True:
            header = Header.read(stream)
            length = read_uint32(stream)
            begin, kind = stream.tell(), header.get_uint8("op")
            data = stream.read(min(length, _MOST_RECORD))
            if len(data) == length or kind == self._chunk:
                yield at, _Record(kind, data, length, header)
            at = stream.seek(begin + length)

    def _expanded(self, record: _Record) -> bytes:
        compression, size = record.header.get_string("compression"), record.header.get_uint32("size")
        return storage.expanded(compression, record.data, max(size, record.length if compression == "none" else 0))

    def _note(self, record: _Record) -> tuple[int, int, bytes] | None:
        header = record.header
        if record.kind == RecordType.MSGDATA:
            return header.get_uint32("conn"), header.get_time("time"), record.data
        if record.kind == RecordType.CONNECTION:
            about = Header.read(io.BytesIO(len(record.data).to_bytes(4, "little") + record.data))
            kind = storage.kind_of_message(about.get_string("type"))
            self.topics[header.get_uint32("conn")] = Topic(header.get_string("topic"), kind, "ros1")
        return None
