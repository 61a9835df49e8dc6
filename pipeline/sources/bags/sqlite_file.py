"""SQLite databases of ROS 2."""

import contextlib
import shutil
import sqlite3
import tempfile
from collections.abc import Iterator
from functools import partial
from itertools import repeat
from pathlib import Path
from typing import Any

from dockpose.sources.bags import storage
from dockpose.sources.bags.storage import MOST_BYTES, Message, Place, Storage, Topic, kind_of_message
from dockpose.sources.frames import SourceError
from dockpose.text import shown

_STEPS, _TIMES = 10_000, 100  # of SQLite's machine for one row, which takes a few dozen
_MOST_TOPICS = 10_000
_NO_NAME = 32  # bytes


class SqliteFile(Storage):
    """A database as rosbag2 writes it, with the tables "topics" and "messages"."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        if storage.ending_of(storage.head_of(path)) != ".db3":
            raise SourceError("is not an SQLite database")
        self._bytes = path.stat().st_size
        with contextlib.ExitStack() as stack:
            address = self._copied(path, stack) or f"{path.resolve().as_uri()}?immutable=1"  # no file is made beside it
            self._database = sqlite3.connect(address, uri=True, check_same_thread=False)
            stack.callback(self._database.close)
            self._database.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_BYTES)
            try:
                try:
                    self._read_topics()
                except sqlite3.DatabaseError:
                    self.is_cut_short = True
                    # Otherwise SQLite refuses every file that is shorter than its header says.
                    self._database.execute("PRAGMA writable_schema=ON")
                    self._read_topics()
            except sqlite3.Error as error:
                what = "is not a bag of ROS 2, or is cut short before its first message"
                raise SourceError(f"{what} ({error})") from error
            self._open = stack.pop_all()

    def close(self) -> None:
        """Release the file."""
        self._open.close()

    def _copied(self, path: Path, stack: contextlib.ExitStack) -> str | None:
        """Copy a database whose recorder was killed, with the log beside it that SQLite plays back; None without."""
        found = {
            end: log
            for end in ("-wal", "-journal")
            for at in (path.resolve(), path)
            if (log := at.with_name(at.name + end)).is_file() and log.stat().st_size
        }
        if not found:
            return None
        copy = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="dockpose-"))) / "copy.db3"
        for end, source in {"": path, **found}.items():
            try:
                shutil.copyfile(source, copy.with_name(copy.name + end))
            except OSError as error:
                where = f"must be copied to {copy.parent} to be read with its {next(iter(found.values())).name}"
                raise SourceError(f"{where}, which failed ({error.strerror})") from error
            self._bytes += source.stat().st_size if end else 0
        if "-journal" in found:
            with copy.with_name(f"{copy.name}-journal").open("ab") as journal:
                journal.write(bytes(_NO_NAME))  # what stands at its end may be a file's name, which SQLite deletes
        self.unfinished = f"as there is {' and '.join(log.name for log in found.values())}"
        return copy.as_uri()

    def _rows(self, query: str, *values: object) -> Iterator[tuple[Any, ...]]:
        """The rows of a query, each of which must come within a million steps of SQLite's machine."""
        # A signal is obeyed between rows alone: what counts the steps is no Python code, in which it would be lost.
        self._database.set_progress_handler(partial(next, repeat(0, _TIMES), 1), _STEPS)
        try:
            for row in self._database.execute(query, values):
                yield row
                self._database.set_progress_handler(partial(next, repeat(0, _TIMES), 1), _STEPS)
        except (UnicodeDecodeError, MemoryError) as error:  # by names that are no text, and sizes that cannot be
            raise sqlite3.DatabaseError("it is damaged") from error
        except sqlite3.OperationalError as error:
            if str(error) != "interrupted":
                raise
            raise SourceError(f"is damaged: SQLite finds no row of it in {_STEPS * _TIMES} steps") from error

    def _read_topics(self) -> None:
        for key, *words in self._rows("SELECT id, name, type, serialization_format FROM topics"):
            if not isinstance(key, int) or not all(isinstance(word, str) for word in words):
                raise SourceError(f"the row {shown((key, *words))} of its table 'topics' is not a topic")
            if len(self.topics) == _MOST_TOPICS or key in self.topics:
                raise SourceError(f"its table 'topics' is damaged: it has over {len(self.topics)} rows, or one twice")
            name, kind, encoding = words
            self.topics[key] = Topic(name, kind_of_message(kind), encoding)

    def messages(self) -> Iterator[Message]:
        """Go through all messages in the order of their numbers, as far as they are there."""
        held = 0  # bytes, as the file can hold no more than it has: a view and a forged schema can compute endless rows
        try:
            for key, topic, time_ns, data in self._rows("SELECT id, topic_id, timestamp, data FROM messages"):
                if not all(isinstance(each, int) for each in (key, topic, time_ns)):
                    values = f"topic {shown(topic)} and timestamp {shown(time_ns)}, which must be whole numbers"
                    raise SourceError(f"message {shown(key)} has {values}")
                held += 1 + (len(data) if isinstance(data, bytes) else 0)
                if held > self._bytes:
                    raise SourceError("is not a bag of ROS 2: its messages hold more bytes than the file")
                if topic in self.topics:
                    yield Message(self.topics[topic], time_ns, Place(-1, key), self._bytes_of(data))
        except (sqlite3.DataError, sqlite3.OperationalError) as error:
            raise SourceError(f"is not a bag of ROS 2 ({error})") from error
        except sqlite3.DatabaseError:
            self.is_cut_short = True
        except SourceError:
            if not self.is_cut_short:
                raise

    def _bytes_of(self, data: object) -> bytes:
        """What a message holds; nothing where it is damaged, which is reported when it is read."""
        try:
            return _expanded(data) if isinstance(data, bytes) else b""
        except ValueError:
            return b""

    def _read(self, place: Place) -> bytes:
        try:
            row = next(self._rows("SELECT data FROM messages WHERE id = ?", place.offset), None)
        except sqlite3.Error as error:
            raise ValueError(str(error)) from error
        if row is None:
            raise ValueError("it is not there")
        if not isinstance(row[0], bytes):
            raise ValueError(f"its data are {shown(row[0])}, not bytes")
        return _expanded(row[0])


def _expanded(data: bytes) -> bytes:
    """A message, expanded where rosbag2 compressed each by itself: none of ROS 2 begins as Zstandard does."""
    return storage.expanded("zstd", data) if data.startswith(storage.ZSTD_BEGINS) else data
