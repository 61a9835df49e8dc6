"""Rows of a session's results, and their table "estimated (measured)" as in the paper's Tables 2 and 3."""

import csv
import io
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec
from dockpose import Estimate
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.numbers import MISSING, QUANTITIES, number, pose_sigmas, pose_values
from dockpose.checks import check_number

LONGEST_TEXT = 10_000
POSE_COLUMNS = ("x_cm", "y_cm", "z_cm", "theta_x_deg", "theta_y_deg")
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
    file: str  # the stored picture, relative to the session's folder, and its checksum
    sha256: str  # the stored picture, relative to the session's folder, and its checksum
    source_sha256: str | None = None  # of the file that the picture came from, where known
    status: str  # of the estimate
    method: str | None = None  # of the threshold, and the number of lights on the ring
    level: int | None = None  # of the threshold, and the number of lights on the ring
    lights: int | None = None  # of the threshold, and the number of lights on the ring
    pose: str | None = None  # the chosen candidate, and how likely it is
    probability: float | None = None  # the chosen candidate, and how likely it is
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
    values: dict[str, Any] = {"status": found.status, "lights": found.lights_on_ring}
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


def row_to_csv(row: Row) -> str:
    """The line of ``results.csv`` of a row."""
    return csv_text([msgspec.structs.astuple(row)])


def rows_from_csv(text: str) -> list[Row]:
    """Rows of ``results.csv``. Raises ValueError that names the row and the column that cannot be read."""
    lines = csv.DictReader(io.StringIO(text, newline=""))
    rows = []
    for line in lines:
        number = line.get("number")
        if None in line:
            raise ValueError(f"row {number} has more cells than columns")
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


@dataclass(frozen=True)
class Table:
    """Text for every cell: ``body`` has one row per frame, its number first and notes last, ``foot`` the summaries."""

    head: tuple[str, ...]
    body: tuple[tuple[str, ...], ...]
    foot: tuple[tuple[str, ...], ...]


def mean_and_rms(errors: Sequence[float]) -> tuple[float | None, float | None]:
    """Mean and root mean square; None of no errors."""
    if not errors:
        return None, None
    return math.fsum(errors) / len(errors), math.sqrt(math.fsum(error * error for error in errors) / len(errors))


def table(rows: Sequence[Row], *, with_errors: bool = True) -> Table:
    """Every number as people read it, with two decimals; ``with_errors`` adds five columns of them."""
    errors = [f"Δ{name}" for name in QUANTITIES] if with_errors else []
    # Summaries of errors stand below the columns of errors, if there are any.
    foot = tuple((name, *[""] * len(errors), *cells, "") for name, cells in summaries(rows).items())
    return Table(("No.", *QUANTITIES, *errors, "Notes"), tuple(_cells(row, with_errors) for row in rows), foot)


def summaries(rows: Sequence[Row]) -> dict[str, tuple[str, ...]]:
    """The cells of each summary, by its name: of how far the estimates are off that were measured too."""
    columns = [[row.errors[index] for row in rows] for index in range(len(QUANTITIES))]
    known = [[error for error in column if error is not None] for column in columns]
    means, rms = zip(*map(mean_and_rms, known), strict=True)
    counts = tuple(str(len(errors)) for errors in known)
    return {"Compared": counts, "Mean error": _texts(means, signed=True), "RMS error": _texts(rms)}


def _cells(row: Row, with_errors: bool) -> tuple[str, ...]:
    pairs = [
        f"{found} ({true})" if true != MISSING else found
        for found, true in zip(_texts(row.estimated), _texts(row.measured), strict=True)
    ]
    return (str(row.number), *pairs, *(_texts(row.errors, signed=True) if with_errors else ()), row.notes)


def _texts(values: Sequence[float | None], *, signed: bool = False) -> tuple[str, ...]:
    return tuple(number(value, 2, signed=signed) for value in values)
