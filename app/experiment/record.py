"""A session's folder: reading it, without locking it, and the rows of ``results.csv`` as it grows."""

import csv
import io
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.numbers import POSE_COLUMNS, pose_sigmas, pose_values
from dockpose.camera.image import read
from dockpose.checks import check_number
from dockpose.files import FileError, read_yaml, sync_folder, write_whole

SCHEMA = 1
INFO, RESULTS, FRAMES = "session.yaml", "results.csv", "frames"
LONGEST_TEXT = 10_000
_DECIMALS = 6  # of a centimetre or a degree; the frame's JSON has every digit
# Neither CSV nor HTML can hold these; a line break in a cell is fine.
_FILE = re.compile(r"frames/\d+\.png")
_CONTROL = re.compile("[\x00-\x08\x0b-\x1f\x7f-\x9f\ud800-\udfff\ufffe\uffff]")
_TEXTS = ("source", "notes")  # blank means empty here, not unknown
MEASURED_COLUMNS = (*(f"measured_{name}" for name in POSE_COLUMNS), "distance_cm")
EDITABLE = (*MEASURED_COLUMNS, "notes")


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """One row of ``results.csv``; a blank there is None here."""

    number: int  # of the frame, from 1
    time: str  # when it was taken, ISO 8601 with the offset from UTC
    source: str  # name of the picture
    file: str  # the stored picture, relative to the session's folder
    sha256: str  # of the stored picture
    source_sha256: str | None = None  # of the file that the picture came from, where known
    status: str  # of the estimate
    method: str | None = None  # of the threshold
    level: int | None = None
    lights: int | None = None  # on the ring
    pose: str | None = None  # the chosen candidate, A or B
    probability: float | None = None
    x_cm: float | None = None
    y_cm: float | None = None
    z_cm: float | None = None
    theta_x_deg: float | None = None
    theta_y_deg: float | None = None
    sigma_x_cm: float | None = None
    sigma_y_cm: float | None = None
    sigma_z_cm: float | None = None
    sigma_theta_x_deg: float | None = None
    sigma_theta_y_deg: float | None = None
    sigma_total_x_cm: float | None = None
    sigma_total_y_cm: float | None = None
    sigma_total_z_cm: float | None = None
    sigma_total_theta_x_deg: float | None = None
    sigma_total_theta_y_deg: float | None = None
    measured_x_cm: float | None = None
    measured_y_cm: float | None = None
    measured_z_cm: float | None = None
    measured_theta_x_deg: float | None = None
    measured_theta_y_deg: float | None = None
    distance_cm: float | None = None
    notes: str = ""
    found_by: str | None = None  # search or following

    def __post_init__(self) -> None:
        if not _FILE.fullmatch(self.file):  # a results.csv from elsewhere must not lead out of its folder
            raise ValueError(f"file is {self.file!r}; it must be frames/0001.png or the like")

    @property
    def estimated(self) -> tuple[float | None, ...]:
        """The five numbers of the chosen pose, in the order of ``POSE_COLUMNS``."""
        return tuple(getattr(self, name) for name in POSE_COLUMNS)

    @property
    def measured(self) -> tuple[float | None, ...]:
        """The same five numbers, measured by hand."""
        return tuple(getattr(self, f"measured_{name}") for name in POSE_COLUMNS)

    @property
    def errors(self) -> tuple[float | None, ...]:
        """Estimated minus measured; angles by the shorter way round."""
        errors = []
        for name, found, true in zip(POSE_COLUMNS, self.estimated, self.measured, strict=True):
            error = None if found is None or true is None else found - true
            errors.append((error + 180) % 360 - 180 if error is not None and name.endswith("_deg") else error)
        return tuple(errors)

    @property
    def range_cm(self) -> float | None:
        """Range of the dock: by tape, else from the measured position, else as estimated."""
        if self.distance_cm is not None:
            return self.distance_cm
        for x, y, z in (self.measured[:3], self.estimated[:3]):
            if z is not None:
                return math.hypot(x or 0.0, y or 0.0, z)
        return None


COLUMNS = Row.__struct_fields__


def estimate_values(found: Estimate) -> dict[str, Any]:
    """Columns of a row that an estimate fills."""
    values: dict[str, Any] = {"status": found.status, "lights": found.lights_on_ring, "found_by": found.found_by}
    if found.threshold is not None:
        values |= {"method": found.threshold.method, "level": found.threshold.level}
    if found.choice is None or found.selected is None:
        return values
    pose = found.selected
    values |= {"pose": POSE_NAMES[found.choice.selected], "probability": pose.probability}
    groups = {"": pose_values(pose), "sigma_": pose_sigmas(pose, "picture"), "sigma_total_": pose_sigmas(pose)}
    for prefix, numbers in groups.items():
        values |= {f"{prefix}{name}": _rounded(one) for name, one in zip(POSE_COLUMNS, numbers, strict=True)}
    return values


def checked_edit(fields: dict[str, Any]) -> dict[str, Any]:
    """Return edits of a row, checked. Raises ValueError that names the column and its value."""
    for name, value in fields.items():
        if name not in EDITABLE:
            raise ValueError(f"{name} cannot be changed; what can is {', '.join(EDITABLE)}")
        if name != "notes" and value is not None:
            check_number(name, value)
    return fields | ({"notes": clean_text("notes", fields["notes"])} if "notes" in fields else {})


def clean_text(name: str, text: str) -> str:
    """Return text without control characters, for any file format. Raises ValueError where it is too long."""
    if len(text) > LONGEST_TEXT:
        raise ValueError(f"{name} has {len(text)} characters; at most {LONGEST_TEXT} are kept")
    return _CONTROL.sub("\N{REPLACEMENT CHARACTER}", text.replace("\r\n", "\n").replace("\r", "\n"))


def csv_text(rows: Iterable[Sequence[Any]], end: str = "\n") -> str:
    """Lines of a CSV file, each with its end; None is blank."""
    text = io.StringIO(newline="")
    csv.writer(text, lineterminator=end).writerows(rows)
    return text.getvalue()


def rows_from_csv(text: str) -> list[Row]:
    """Rows of ``results.csv``. Raises ValueError that names the row and the column that cannot be read."""
    lines = csv.DictReader(io.StringIO(text, newline=""))
    rows = []
    for line in lines:
        number = line.get("number")
        if None in line:
            raise ValueError(f"row {number} has more cells than columns")
        if None in line.values():
            raise ValueError(f"row {number} has fewer cells than columns; the file is cut short, or was edited")
        try:
            kept = {name: value for name, value in line.items() if value or name in _TEXTS}
            rows.append(msgspec.convert(kept, Row, strict=False))
        except msgspec.ValidationError as error:
            raise ValueError(f"row {number}: {error}") from error
    if len({row.number for row in rows}) < len(rows):
        raise ValueError("two rows have the same number")
    return rows


def _rounded(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else round(value, _DECIMALS)


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


def unlisted(record: SessionRecord) -> Iterator[str]:
    """A sentence on frames that have no row."""
    frames = {f"{FRAMES}/{path.name}" for path in (record.folder / FRAMES).glob("*.png")}
    if alone := sorted(frames - {row.file for row in record.rows}):
        yield f"{record.folder}: {', '.join(alone)}: no row in {RESULTS}; a program was stopped, or the table was cut"


def lacks(record: SessionRecord) -> Iterator[str]:
    """Sentences on all that is missing: rows of frames, pictures and results of rows."""
    yield from unlisted(record)
    for row in record.rows:
        if not (record.folder / row.file).is_file():
            yield f"row {row.number}: {record.folder / row.file}: is not there"
        try:
            record.line(row)
        except FileError as error:
            yield f"row {row.number}: {error}"


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

    def write(self, rows: list[Row]) -> None:
        """Have these rows in place of those that there are."""
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
