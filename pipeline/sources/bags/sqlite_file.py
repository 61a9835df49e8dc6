"""SQLite databases of ROS 2."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable, Collection
from pathlib import Path

from dockpose.sources.bags.storage import Place, Storage, Topic, kind_of_message
from dockpose.sources.frames import SourceError


class SqliteFile(Storage):
    """A database as rosbag2 writes it, with the tables "topics" and "messages".

    Parameters
    ----------
    path : Path
        The file.
    number : int
        Which file of the bag it is.
    expand : callable, optional
        Expands messages that were compressed one by one.

    Raises
    ------
    SourceError
        If it cannot be read or is none.
    """

    def __init__(self, path: Path, number: int = 0, expand: Callable[[bytes], bytes] | None = None) -> None:
        super().__init__()
        with path.open("rb") as file:
            if file.read(16) != b"SQLite format 3\0":
                raise SourceError("is no SQLite database")
        self._number, self._expand = number, expand
        address = f"{path.resolve().as_uri()}?mode=ro"
        self._database = sqlite3.connect(address, uri=True, check_same_thread=False)
        try:
            try:
                self._read_topics()
                self._rows = self._listed()
            except sqlite3.DatabaseError:
                self.is_cut_short = True
                self._database.close()
                self._database = sqlite3.connect(f"{address}&immutable=1", uri=True, check_same_thread=False)
                # Otherwise SQLite refuses every file that is shorter than its header says.
                self._database.execute("PRAGMA writable_schema=ON")
                self._read_topics()
                self._rows = self._listed()
        except sqlite3.Error as error:
            self._database.close()
            raise SourceError(f"is no bag of ROS 2, or is cut short before its first message ({error})") from error

    def places(self, topics: Collection[int]) -> list[Place]:
        """Where the messages of some topics lie, in the order in which they were recorded."""
        return sorted(place for place in self._rows if place.topic in topics)

    def close(self) -> None:
        """Release the file."""
        self._database.close()

    def _read_topics(self) -> None:
        rows = self._database.execute("SELECT id, name, type, serialization_format FROM topics")
        for key, name, kind, encoding in rows:
            self.topics[key] = Topic(name, kind_of_message(kind), encoding)

    def _listed(self) -> list[Place]:
        """All messages in the order of their numbers, as far as they are there."""
        rows: list[Place] = []
        try:
            found = self._database.execute("SELECT id, topic_id, timestamp FROM messages ORDER BY id")
            for key, topic, time_ns in found:
                rows.append(Place(time_ns, topic, self._number, -1, key))
        except sqlite3.DatabaseError:
            if not self.is_cut_short:
                raise
        while self.is_cut_short and rows and not self._is_there(rows[-1]):
            rows.pop()
        return rows

    def _is_there(self, place: Place) -> bool:
        try:
            return bool(self.read(place))
        except SourceError:
            return False

    def _read(self, place: Place) -> bytes:
        try:
            row = self._database.execute("SELECT data FROM messages WHERE id = ?", (place.offset,)).fetchone()
        except sqlite3.Error as error:
            raise ValueError(str(error)) from error
        if row is None:
            raise ValueError("it is not there")
        return row[0] if self._expand is None else self._expand(row[0])
