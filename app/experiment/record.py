"""A session's folder: reading it, without locking it, and ``results.csv`` as it grows."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from dockpose.app.experiment.row import COLUMNS, Row, csv_text, rows_from_csv
from dockpose.camera.image import read
from dockpose.files.durable_files import sync_folder, write_whole
from dockpose.files.yaml_file import FileError, read_yaml

SCHEMA = 1
INFO, RESULTS, FRAMES = "session.yaml", "results.csv", "frames"
EMPTY = csv_text([COLUMNS]).encode()
_LATER = "sigma_total"  # columns that older sessions lack; they get them with the next row


@dataclass(frozen=True)
class SessionRecord:
    """What a session's folder holds: the content of session.yaml, and the rows in the order they were taken."""

    folder: Path
    info: dict[str, Any]
    rows: tuple[Row, ...]

    @property
    def name(self) -> str:
        """The folder's name."""
        return self.folder.resolve().name

    def picture(self, row: Row) -> np.ndarray:
        """The pixels of a row's frame. Raises ImageError where they cannot be read."""
        return read(self.folder / row.file)

    def line(self, row: Row) -> dict[str, Any]:
        """The JSON object of a row's frame. Raises FileError where it cannot be read."""
        path = (self.folder / row.file).with_suffix(".json")
        try:
            content = msgspec.json.decode(path.read_bytes())
        except OSError as error:
            raise FileError(f"{path}: cannot be read ({error.strerror or error})") from error
        except (msgspec.DecodeError, UnicodeDecodeError) as error:
            raise FileError(f"{path}: is not a JSON file ({error})") from error
        if not isinstance(content, dict):
            raise FileError(f"{path}: is not a JSON object, but {type(content).__name__}")
        return content


def is_session(folder: Path) -> bool:
    """Whether a folder is a session's."""
    return (folder / INFO).is_file()


def files_of_session(folder: Path) -> Iterator[Path]:
    """The files that a session consists of."""
    yield from (folder / INFO, folder / RESULTS)
    yield from (folder / FRAMES).glob("*")


def read_session(folder: Path) -> SessionRecord:
    """Read a session's folder, even while a program is adding to it."""
    if not is_session(folder):
        raise FileError(f"{folder}: is not a session; it has no file {INFO}")
    info = read_yaml(folder / INFO)
    if info.get("schema") != SCHEMA:
        raise FileError(f"{folder / INFO}: schema is {info.get('schema')!r}; this program reads {SCHEMA}")
    return SessionRecord(folder, info, tuple(_read_rows(folder / RESULTS)))


def _read_rows(path: Path) -> list[Row]:
    try:
        text = path.read_bytes().decode("utf-8-sig")  # spreadsheets may save it with a byte order mark
    except FileNotFoundError:
        return []  # stopped after session.yaml was made, before the first row
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})") from error
    except UnicodeDecodeError as error:
        raise FileError(f"{path}: is not a text file in UTF-8") from error
    first = text.partition("\n")[0].strip().split(",")
    missing = [name for name in COLUMNS if name not in first and not name.startswith(_LATER)]
    if missing:
        raise FileError(f"{path}: has no column {missing[0]}")
    try:
        return rows_from_csv(text)
    except ValueError as error:
        raise FileError(f"{path}: {error}") from error


class ResultsFile:
    """The rows, the same in memory as on the disk; each change replaces the file, lest half a row be left."""

    def __init__(self, folder: Path, rows: Sequence[Row]) -> None:
        self._path = folder / RESULTS
        self.rows = list(rows)
        if not self._path.exists():
            write_whole(self._path, EMPTY)
            sync_folder(folder)
        self._content = self._path.read_bytes()
        first = self._content.partition(b"\n")[0].decode("utf-8-sig").strip().split(",")
        unknown = [name for name in first if name not in COLUMNS]
        if unknown:
            raise FileError(f"{self._path}: the column {unknown[0]} would be lost; move it to a file of its own")

    def add(self, row: Row) -> None:
        """Add a row at the end; see :meth:`replace`."""
        self._write([*self.rows, row])

    def replace(self, index: int, row: Row) -> None:
        """Replace the row at ``index``."""
        self._write([*self.rows[:index], row, *self.rows[index + 1 :]])

    def _write(self, rows: list[Row]) -> None:
        if self._path.exists() and self._path.read_bytes() != self._content:
            raise FileError(f"{self._path}: was changed by another program; close the session and open it again")
        before = self.rows, self._content
        content = csv_text([COLUMNS, *map(msgspec.structs.astuple, rows)]).encode()
        write_whole(self._path, content)
        self.rows, self._content = rows, content
        try:
            sync_folder(self._path.parent)
        except OSError:
            # If even this fails, the new rows stay on the disk, and they are whole too.
            write_whole(self._path, before[1])
            self.rows, self._content = before
            raise
