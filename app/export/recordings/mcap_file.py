"""An MCAP file with the poses of each frame; one of a program that was killed can be read up to there."""

import contextlib
import dataclasses
from collections.abc import Callable, Iterator
from importlib.metadata import version
from pathlib import Path
from typing import Any, BinaryIO, cast

import numpy as np
from dockpose.app.errors import UserError, unwritable, writing
from dockpose.app.export.recordings.messages import TOPICS, Seen, messages_of
from dockpose.files.durable_files import GrowingFile

ENDING = ".mcap"
# So little is kept back that a frame with its picture is on the disk at once.
_CHUNK_BYTES = 16 * 1024
_PERIOD_S = 0.1  # between frames of which no time is known
_FIRST_S = 1.0  # stamp of the first frame where the time of day is not known; a stamp of 0 stands for none
_WITHOUT_DAY = "seconds since the first frame, plus 1; the source does not know the time of day"


class PoseFile:
    """An MCAP file with the poses of each frame; killed, it leaves what readers without an index read."""

    def __init__(self, path: Path, source: str, tell: Callable[[str], None]) -> None:
        try:
            from mcap.writer import Writer
            from rosbags.typesys import Stores, get_typestore
        except ImportError as error:
            raise UserError(f"--out {path}: needs the packages that write bags: pip install 'dockpose[ros]'") from error
        self._path, self._source, self._tell = path, source, tell
        with writing(path):
            self._file = GrowingFile(path)
        self._store = get_typestore(Stores.ROS2_HUMBLE)
        # What is called here as a file needs no more than a file's write, tell and flush.
        self._writer = Writer(cast("BinaryIO", self._file), chunk_size=_CHUNK_BYTES)
        with self._writing():
            self._writer.start(profile="ros2", library=f"dockpose {version('dockpose')}")
        self._channels: dict[str, int] = {}
        for topic, kind in TOPICS.items():
            definition = self._store.generate_msgdef(kind, ros_version=2)[0].encode()
            schema = self._writer.register_schema(kind, "ros2msg", definition)
            self._channels[topic] = self._writer.register_channel(topic, "cdr", schema)
        self._is_open = True
        self._begin_s: float | None = None  # of the clock of the stamps, at the frames' time 0
        self._clock = ""
        self._count = 0

    def write(self, seen: Seen, time_s: float | None, time_unix_s: float | None) -> None:
        """Add a frame."""
        stamp_s = self._stamp_s(time_s, time_unix_s)
        with self._writing():
            for topic, fields in messages_of(dataclasses.replace(seen, clock=self._clock), stamp_s):
                data = bytes(self._store.serialize_cdr(built(self._store, TOPICS[topic], fields), TOPICS[topic]))
                time_ns = round(1e9 * stamp_s)
                self._writer.add_message(self._channels[topic], time_ns, data, time_ns, self._count)
            self._file.mark()
        self._count += 1

    def close(self) -> None:
        """Finish the file."""
        if self._is_open:
            with self._writing():
                self._writer.finish()
                self._file.close()
            self._is_open = False

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        """Raise UserError where the file cannot be written, of which the frames until then stay."""
        try:
            yield
        except OSError as error:
            self._is_open = False
            raise unwritable(self._path, error, kept=self._file.cut()) from error

    def _stamp_s(self, time_s: float | None, time_unix_s: float | None) -> float:
        """Time of a frame by one clock for all of them."""
        since_s = _PERIOD_S * self._count if time_s is None else time_s
        if self._begin_s is None:
            self._begin_s = _FIRST_S - since_s if time_unix_s is None else time_unix_s - since_s
            self._clock = _WITHOUT_DAY if time_unix_s is None else "time of day"
            if time_unix_s is None:
                self._tell(f"{self._source}: time stamps in {self._path} are {_WITHOUT_DAY}")
            self._writer.add_metadata("dockpose", {"source": self._source, "stamps": self._clock})
        if time_unix_s is not None and self._clock != _WITHOUT_DAY:
            return time_unix_s
        return self._begin_s + since_s


def built(store: Any, kind: str, fields: dict[str, Any]) -> Any:
    """Build a message."""
    values = {}
    for name, described in store.fielddefs[kind][1]:
        values[name] = _value(store, described, fields[name])
    return store.types[kind](**values)


def _value(store: Any, described: Any, value: Any) -> Any:
    """A field's value, by how the store describes it."""
    sort, about = described
    if sort.name == "BASE":
        return value
    if sort.name == "NAME":
        return built(store, about, value)
    (inner, what), _ = about
    if inner.name == "NAME":
        return [built(store, what, one) for one in value]
    return np.frombuffer(value, np.uint8) if isinstance(value, bytes) else np.array(value, float)
