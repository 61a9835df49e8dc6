"""A session that frames are added to, and the sessions in one folder on this machine, which the page lists."""

import contextlib
import datetime
import hashlib
import json
import math
import re
import threading
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import cv2
import msgspec
import numpy as np
from dockpose import Estimate
from dockpose.app.errors import UserError, why
from dockpose.app.experiment import record as files
from dockpose.app.experiment.lock import LOCK, FolderLock, InUseError
from dockpose.app.experiment.record import Row, checked_edit, clean_text, estimate_values, is_session
from dockpose.app.inputs.received import below, safe_name
from dockpose.app.resources import versions, with_versions
from dockpose.files import FileError, remove, remove_temporaries, sync_folder, to_yaml, write_whole

_FRAME = re.compile(r"(\d+)\.(?:png|json)")
_MOST = 500  # sessions that are listed


class SessionError(FileError):
    """Something that could not be done with a session; the text names it and says why."""


class Session(contextlib.AbstractContextManager["Session"]):
    """One session, held until it is closed, for several threads; ``notices`` are sentences on what was irregular."""

    def __init__(self, record: files.SessionRecord, lock: FolderLock) -> None:
        self._record, self._held, self.folder = record, lock, record.folder
        self._results = files.ResultsFile(record.folder, record.rows)
        self._busy = threading.RLock()
        self._closed = False
        matches = (_FRAME.fullmatch(path.name) for path in (record.folder / files.FRAMES).iterdir())
        frames = {int(match[1]) for match in matches if match}
        listed = {row.number for row in record.rows}
        self._last = max([0, *frames, *listed])
        self.notices = tuple(_notices(record, sorted(frames - listed)))

    @classmethod
    def create(cls, folder: str | Path, notes: str = "") -> "Session":
        """Make a new session."""
        folder, info = Path(folder), {"schema": files.SCHEMA, "created": _now(), "program": versions()}
        info["notes"] = clean_text("notes", notes)
        is_new = not folder.exists()
        with _telling(folder, "a session cannot be made"), contextlib.ExitStack() as undo:
            folder.mkdir(parents=True, exist_ok=True)
            _check_unused(folder)
            lock = FolderLock(folder)
            undo.callback(lock.release)
            _check_unused(folder)  # nobody was faster
            undo.callback(_unmake, folder, lock, is_new)
            _make_files(folder, info)
            undo.pop_all()
        return cls(files.SessionRecord(folder, info, ()), lock)

    @classmethod
    def open(cls, folder: str | Path) -> "Session":
        """Reopen a session; temporary files of a program that was stopped are removed."""
        folder = Path(folder)
        if not files.is_session(folder):
            raise SessionError(f"{folder}: is not a session; it has no file {files.INFO}")
        with _telling(folder, "the session cannot be reopened"):
            lock = FolderLock(folder)
            try:
                (folder / files.FRAMES).mkdir(exist_ok=True)
                for place in (folder, folder / files.FRAMES):
                    remove_temporaries(place)
                return cls(files.read_session(folder), lock)
            except BaseException:
                lock.release()
                raise

    @property
    def rows(self) -> tuple[Row, ...]:
        """All rows, in the order in which they were taken."""
        with self._busy:
            return tuple(self._results.rows)

    @property
    def record(self) -> files.SessionRecord:
        """The session as it stands, for tables and reports."""
        return files.SessionRecord(self.folder, self._record.info, self.rows)

    def take(self, image: Any, estimate: Estimate, source: str, sha256: str | None = None, **fields: Any) -> Row:
        """Add a frame, with fields as :meth:`edit`. When this returns, the row and its picture are on the disk."""
        source, fields = clean_text("source", source), checked_edit(fields)
        png = cv2.imencode(".png", np.asarray(image))[1].tobytes()
        with self._busy:
            number = self._last + 1
            name = f"{number:04d}"
            row = Row(
                number=number,
                time=_now(),
                source=source,
                file=f"{files.FRAMES}/{name}.png",
                sha256=hashlib.sha256(png).hexdigest(),
                source_sha256=sha256,
                **estimate_values(estimate),
                **fields,
            )
            line = with_versions(estimate.to_dict(source, frame=number - 1, sha256=sha256))
            line["picture"] = {"file": f"{name}.png", "sha256": row.sha256}
            line["taken"] = row.time
            self._write(row, png, (json.dumps(line, allow_nan=False, indent=1) + "\n").encode())
        return row

    def edit(self, number: int, **fields: Any) -> Row:
        """Edit the measured values (``measured_x_cm``, ..., ``distance_cm``) or ``notes`` of a row."""
        fields = checked_edit(fields)
        with self._busy:
            rows = {row.number: row for row in self._results.rows}
            if number not in rows:
                raise ValueError(f"number is {number!r}; the session has no such row")
            rows[number] = row = msgspec.structs.replace(rows[number], **fields)
            with _telling(self.folder, f"row {number} cannot be changed"):
                self._check_open()
                self._results.write(list(rows.values()))
        return row

    def close(self) -> None:
        """Let others have the session. It may be called again."""
        with self._busy:
            self._closed = True
            self._held.release()

    def __exit__(self, *_: object) -> None:
        self.close()

    def _check_open(self) -> None:
        if self._closed:
            raise SessionError(f"{self.folder}: the session was closed")

    def _write(self, row: Row, png: bytes, line: bytes) -> None:
        picture = self.folder / row.file
        contents = {picture: png, picture.with_suffix(".json"): line}
        with _telling(self.folder, f"frame {row.number} cannot be saved"):
            self._check_open()
            if any(path.exists() for path in contents):
                raise SessionError(f"{picture}: is there already, and is not overwritten")
            try:
                for path, data in contents.items():
                    write_whole(path, data)
                sync_folder(picture.parent)
                self._results.write([*self._results.rows, row])
                self._last = row.number
            except BaseException:
                if row in self._results.rows:
                    self._last = row.number
                else:
                    for path in contents:
                        remove(path)
                raise


def _check_unused(folder: Path) -> None:
    """Check that a folder is empty, but for what a program stopped while making a session leaves."""
    names = {path.name for path in folder.iterdir() if not path.name.startswith(".")}
    has_rows = files.RESULTS in names and (folder / files.RESULTS).read_bytes() != files.EMPTY
    has_frames = files.FRAMES in names and any((folder / files.FRAMES).iterdir())
    if has_rows or has_frames or not names <= {files.RESULTS, files.FRAMES}:
        raise SessionError(f"{folder}: a session cannot be made: the folder is not empty")


def _make_files(folder: Path, info: dict[str, Any]) -> None:
    """Make a session's files; ``session.yaml`` comes last and makes it one."""
    remove_temporaries(folder)
    (folder / files.FRAMES).mkdir(exist_ok=True)
    write_whole(folder / files.RESULTS, files.EMPTY)
    write_whole(folder / files.INFO, to_yaml(info).encode())
    sync_folder(folder)
    sync_folder(folder.resolve().parent)


def _unmake(folder: Path, lock: FolderLock, is_new: bool) -> None:
    """Remove what a session that could not be made has left."""
    for path in (folder / files.INFO, folder / files.RESULTS, folder / LOCK):
        remove(path)
    lock.release()
    with contextlib.suppress(OSError):
        (folder / files.FRAMES).rmdir()
        if is_new:
            folder.rmdir()


def _now() -> str:
    return datetime.datetime.now().astimezone().isoformat(timespec="milliseconds")


def _moment(row: Row) -> float:
    """Time of a row, in seconds since 1970; nan where it has none that can be read."""
    try:
        return datetime.datetime.fromisoformat(row.time).timestamp()
    except (ValueError, OverflowError, OSError):
        return math.nan


def _notices(record: files.SessionRecord, unlisted: list[int]) -> Iterator[str]:
    if unlisted:
        numbers = ", ".join(f"{number:04d}" for number in unlisted)
        yield f"{numbers} in {record.folder / files.FRAMES} has no row: a program was stopped while it was being taken."
    back = [row.number for before, row in pairwise(record.rows) if _moment(row) < _moment(before)]
    if back:
        yield (
            f"By their times, row {', '.join(map(str, back))} was taken before the row above: the computer's clock was "
            "set back. Rows stand in the order in which they were taken."
        )
    gone = [row.number for row in record.rows if not (record.folder / row.file).is_file()]
    if gone:
        yield f"The picture of row {', '.join(map(str, gone))} is no longer in {record.folder / files.FRAMES}."


@contextlib.contextmanager
def _telling(folder: Path, what: str) -> Iterator[None]:
    """Turn errors of the system into one sentence."""
    try:
        yield
    except InUseError as error:
        raise SessionError(f"{folder}: {what}: it is in use by {error}") from error
    except OSError as error:
        raise SessionError(f"{folder}: {what}: {why(error)}") from error


class SessionFolder:
    """Sessions below ``root``, and nowhere else; the folder is created with the first session."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def names(self) -> list[str]:
        """Names of the sessions, the one that was changed last first; none where the folder cannot be read."""
        try:
            folders = [path for path in self.root.iterdir() if not path.name.startswith(".") and is_session(path)]
            changed_s = {path.name: max(path.stat().st_mtime, (path / files.INFO).stat().st_mtime) for path in folders}
            return sorted(changed_s, key=changed_s.__getitem__, reverse=True)[:_MOST]
        except OSError:
            return []

    def start(self, text: str) -> Session:
        """Start a session named after what was typed, else after the day. Raises SessionError if it cannot be made."""
        name = safe_name(text if text.strip() else f"{datetime.date.today():%Y-%m-%d}", taken=self._taken())
        return Session.create(self.root / name)

    def last_of_today(self) -> Session | None:
        """Reopen the session that was begun today and changed last; None where there is none, or another has it."""
        today = f"{datetime.date.today():%Y-%m-%d}"
        for name in self.names():
            with contextlib.suppress(FileError):
                if str(files.read_session(self.root / name).info.get("created", "")).startswith(today):
                    return Session.open(self.root / name)
        return None

    def last(self) -> Session | None:
        """Reopen the session that was changed last, whatever the clock says now; None where that cannot be."""
        for name in self.names():
            with contextlib.suppress(FileError):
                return Session.open(self.root / name)
        return None

    def take_up(self, name: str) -> Session:
        """Reopen a session."""
        if name not in self.names():
            raise UserError(f"{name}: there is no such session in {self.root}.")
        return Session.open(below(self.root, name))

    def _taken(self) -> list[str]:
        try:
            return [path.name for path in self.root.iterdir()]
        except FileNotFoundError:
            return []
        except OSError as error:
            raise SessionError(f"{self.root}: cannot be read ({error.strerror or error})") from error
