"""MCAP files, by their index; those without one, such as files that break off, record by record."""

from __future__ import annotations

import contextlib
import io
import os
import struct
import zlib
from collections.abc import Collection, Iterator
from pathlib import Path
from typing import BinaryIO

from dockpose.sources.bags.storage import MOST_RECORDS, Place, Storage, Topic, check_size, expanded, kind_of_message
from dockpose.sources.frames import SourceError

# What Python raises for numbers that lead beyond the file, and for text that is none.
_DAMAGE = (ValueError, struct.error, OverflowError, MemoryError, OSError, KeyError)
_MAGIC = b"\x89MCAP0\r\n"
_FOOTER, _SCHEMA, _CHANNEL, _MESSAGE, _CHUNK, _DATA_END = 0x02, 0x03, 0x04, 0x05, 0x06, 0x0F
_IN_SUMMARY = (_FOOTER, _SCHEMA, _CHANNEL, 0x08, 0x0A, 0x0B, 0x0D, 0x0E)  # and indexes, statistics, offsets
_END = struct.Struct("<BQQQI8s")  # the footer (kind, length, where summary and offsets begin, checksum) and the magic
_HEAD = struct.Struct("<BQ")  # of every record: what it is, and the length of its content
_MESSAGE_HEAD = struct.Struct("<HIQQ")  # channel, number, when recorded, when published
_CHUNK_HEAD = struct.Struct("<QQQII")  # begin, end, size, checksum, and the length of the compression's name


class McapFile(Storage):
    """An MCAP file.

    The format: https://mcap.dev/spec
    """

    def __init__(self, path: Path, number: int = 0) -> None:
        super().__init__()
        from mcap.records import Channel, Schema

        self._Channel, self._Schema = Channel, Schema
        self._path, self._number = path, number
        self._file: BinaryIO = path.open("rb")
        self._kept: tuple[int, bytes] = (-1, b"")
        self._schemas: dict[int, str] = {}
        self._indexed: list[tuple[int, dict[int, int]]] | None = None
        self._scanned: list[Place] = []
        try:
            if self._file.read(8) != _MAGIC:
                raise SourceError("is not an MCAP file")
            self._length = self._file.seek(0, os.SEEK_END)
            if not self._read_index():
                self._scan()
        except BaseException:
            self._file.close()
            raise

    def places(self, topics: Collection[int]) -> list[Place]:
        """Where the messages of some channels lie, in the order in which they were recorded."""
        if self._indexed is None:
            return [place for place in self._scanned if place.topic in topics]
        found = []
        for chunk, index_of in self._indexed:
            for topic in index_of.keys() & topics:
                entries = self._entries(index_of[topic])
                found += [Place(time_ns, topic, self._number, chunk, offset) for time_ns, offset in entries]
        return sorted(found, key=lambda place: (place.chunk, place.offset))

    def close(self) -> None:
        """Release the file."""
        self._file.close()

    def _read(self, place: Place) -> bytes:
        if place.chunk < 0:
            return self._content(self._file, place.offset)[_MESSAGE_HEAD.size :]
        if self._kept[0] != place.chunk:
            self._kept = (place.chunk, self._decompressed(place.chunk))
        return self._content(io.BytesIO(self._kept[1]), place.offset)[_MESSAGE_HEAD.size :]

    def _read_index(self) -> bool:
        """Take topics and chunks from the summary at the end of the file; False where it is not there or not whole."""
        from mcap.exceptions import McapError
        from mcap.reader import make_reader

        try:
            if not self._has_summary():
                return False
            self._file.seek(0)
            summary = make_reader(self._file).get_summary()
        except (McapError, *_DAMAGE):
            return False
        counted = None if summary is None else summary.statistics
        if summary is None or counted is None or not summary.channels:
            return False
        chunks = summary.chunk_indexes
        if counted.chunk_count != len(chunks) or (counted.message_count and not chunks):
            return False
        starts = [at for chunk in chunks for at in chunk.message_index_offsets.values()]
        if any(not chunk.message_index_offsets for chunk in chunks) or len(set(starts)) < len(starts):
            return False
        for schema in summary.schemas.values():
            self._schemas[schema.id] = schema.name
        for channel in summary.channels.values():
            self._note(channel.id, channel.schema_id, channel.topic, channel.message_encoding)
        self._indexed = [(chunk.chunk_start_offset, chunk.message_index_offsets) for chunk in chunks]
        return True

    def _has_summary(self) -> bool:
        """Whether the file ends with a summary that is whole, by its checksum, and holds only what belongs there."""
        self._file.seek(max(0, self._length - _END.size))
        end = self._file.read()
        if len(end) < _END.size or end[-8:] != _MAGIC:
            return False
        kind, _, start, _, checksum, _ = _END.unpack(end)
        stop = self._length - _END.size
        if kind != _FOOTER or not len(_MAGIC) <= start < stop:
            return False
        self._file.seek(start)
        if checksum and zlib.crc32(self._file.read(stop + _END.size - 12 - start)) != checksum:
            self.faults.append("its index does not match its checksum, so it is read record by record")
            return False
        return all(kind in _IN_SUMMARY for kind, _, _ in _records(self._file, start, stop))

    def _note(self, key: int, schema: int, name: str, encoding: str) -> None:
        kind = kind_of_message(self._schemas.get(schema, ""))
        self.topics[key] = Topic(name, kind, encoding)

    def _entries(self, start: int) -> Iterator[tuple[int, int]]:
        """Times and offsets in the index of one channel's messages in one chunk."""
        content = self._content(self._file, start)
        return struct.iter_unpack("<QQ", content[6 : 6 + (len(content) - 6) // 16 * 16])

    def _scan(self) -> None:
        """Go through the whole file, as far as it is there."""
        self.is_cut_short = True
        for kind, start, length in _records(self._file, len(_MAGIC), self._length):
            if kind == _DATA_END:
                self.is_cut_short = False
                self._check_data(start)
                return
            if kind != _CHUNK:
                self._see(kind, self._file, start, length, -1)
                continue
            try:
                content = self._decompressed(start)
            except _DAMAGE as error:  # others follow
                self.faults.append(f"{error}; what is in it is left out")
                continue
            chunk = io.BytesIO(content)
            for count, (inner, offset, size) in enumerate(_records(chunk, 0, len(content))):
                if count == MOST_RECORDS:
                    self.faults.append(f"the chunk at byte {start} has over {count} records; those behind are left out")
                    break
                if offset + _HEAD.size + size <= len(content):
                    self._see(inner, chunk, offset, size, start)

    def _check_data(self, end: int) -> None:
        """Compare what comes before the record at the data's end with the checksum in it."""
        content = self._content(self._file, end)
        checksum = int.from_bytes(content[:4], "little")
        if not checksum:  # not given
            return
        self._file.seek(0)
        found, left = 0, end
        while left > 0 and (part := self._file.read(min(left, 1 << 20))):
            found, left = zlib.crc32(part, found), left - len(part)
        if found != checksum:
            self.faults.append("its data do not match their checksum: some of it is damaged")

    def _see(self, kind: int, stream: BinaryIO, start: int, length: int, chunk: int) -> None:
        """Note a record, if it is there as a whole and of concern."""
        if kind not in (_SCHEMA, _CHANNEL, _MESSAGE) or (chunk < 0 and start + _HEAD.size + length > self._length):
            return
        from mcap.data_stream import ReadDataStream

        stream.seek(start + _HEAD.size)
        with contextlib.suppress(*_DAMAGE):  # others follow
            if kind == _MESSAGE:
                channel, _, time_ns, _ = _MESSAGE_HEAD.unpack(stream.read(_MESSAGE_HEAD.size))
                self._scanned.append(Place(time_ns, channel, self._number, chunk, start))
            elif kind == _SCHEMA:
                schema = self._Schema.read(ReadDataStream(stream))
                self._schemas[schema.id] = schema.name
            else:
                channel = self._Channel.read(ReadDataStream(stream))
                self._note(channel.id, channel.schema_id, channel.topic, channel.message_encoding)

    def _content(self, stream: BinaryIO, start: int) -> bytes:
        """The content of the record there; of one that breaks off, the beginning."""
        left = (self._length if stream is self._file else stream.seek(0, os.SEEK_END)) - start - _HEAD.size
        if left < 0:
            raise SourceError("its index leads beyond its end")
        stream.seek(start)
        _, length = _HEAD.unpack(stream.read(_HEAD.size))
        return stream.read(min(length, left))

    def _decompressed(self, at: int) -> bytes:
        """The records of the chunk there; of one that breaks off, the beginning."""
        content = self._content(self._file, at)
        if len(content) < _CHUNK_HEAD.size:
            return b""
        size, checksum, letters = _CHUNK_HEAD.unpack_from(content)[2:]
        start = _CHUNK_HEAD.size + letters
        name, data = content[_CHUNK_HEAD.size : start], content[start + 8 :]
        if len(content) < start + 8:
            return b""
        try:
            check_size(size)
            found = expanded(name.decode(), data, size) if name else data[:size]
        except ValueError as error:
            raise ValueError(f"at byte {at}, {error}") from error
        is_whole = len(data) == int.from_bytes(content[start : start + 8], "little")
        if is_whole and checksum and zlib.crc32(found) != checksum:
            raise ValueError(f"at byte {at}, a chunk is damaged: it does not match its checksum")
        return found


def _records(stream: BinaryIO, start: int, end: int) -> Iterator[tuple[int, int, int]]:
    """Kind, place and length of the records of a file or chunk; the last need not be there as a whole."""
    while start + _HEAD.size <= end:
        stream.seek(start)
        kind, length = _HEAD.unpack(stream.read(_HEAD.size))
        yield kind, start, length
        start += _HEAD.size + length
