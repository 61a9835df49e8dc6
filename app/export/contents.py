"""What can be taken away of a session and of a sequence: names of files, and what makes each."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import Any

import msgspec
from dockpose.app.drawing.figures import to_pdf, to_png, to_svg
from dockpose.app.experiment import SessionRecord
from dockpose.app.export.bundle import Files
from dockpose.app.export.data import to_csv
from dockpose.app.export.plots import error_figure, sequence_figure
from dockpose.app.export.report import sequence_report, session_report
from dockpose.app.export.tables import csv_table, html_table, latex_table, markdown_table
from dockpose.camera.files import FileError
from dockpose.estimate import SCHEMA


def session_files(record: SessionRecord) -> Files:
    """Report, table and plot of a session; its frames lie in its folder as they are."""
    figure = functools.partial(error_figure, record.rows)
    return {
        "report.html": lambda: session_report(record).encode(),
        "table.csv": lambda: csv_table(record.rows).encode(),
        "table.md": lambda: markdown_table(record.rows).encode(),
        "table.tex": lambda: latex_table(record.rows).encode(),
        "table.html": lambda: html_table(record.rows).encode(),
        "errors.svg": lambda: to_svg(figure(), "errors"),
        "errors.png": lambda: to_png(figure()),
        "errors.pdf": lambda: to_pdf(figure()),
    }


def sequence_files(path: Path) -> Files:
    """Report, table and plot of a file of JSON lines. Raises FileError that names the line which is none."""
    lines = read_lines(path)
    figure = functools.partial(sequence_figure, lines)
    return {
        "report.html": lambda: sequence_report(path, lines).encode(),
        "results.csv": lambda: to_csv(lines),
        "poses.svg": lambda: to_svg(figure(), "poses"),
        "poses.png": lambda: to_png(figure()),
        "poses.pdf": lambda: to_pdf(figure()),
    }


class _Candidate(msgspec.Struct):
    position_m: tuple[float, float, float]
    theta_x_deg: float
    theta_y_deg: float
    probability: float | None
    rms_px: float | None


class _Track(msgspec.Struct):
    probability: float | None = None
    age: int | None = None
    predicted: bool | None = None
    lost: bool | None = None


class _Threshold(msgspec.Struct):
    method: str
    level: int
    groups: int | None


class _Marker(msgspec.Struct):
    on_ring: bool | None


class _Line(msgspec.Struct):
    """What reports and tables read of a line; it has more."""

    schema: int
    source: str | None
    frame: int | None
    time_s: float | None
    sha256: str | None
    status: str
    message: str
    threshold: _Threshold | None
    markers: list[_Marker]
    candidates: list[_Candidate]
    selected: int | None
    selected_by: str | None
    elapsed_ms: float | None
    track: _Track | None = None

    def __post_init__(self) -> None:
        if self.schema != SCHEMA:
            raise ValueError(f"schema is {self.schema}; it must be {SCHEMA}")
        if self.selected is not None and not 0 <= self.selected < len(self.candidates):
            raise ValueError(f"selected is {self.selected}, of {len(self.candidates)} candidates")


def read_lines(path: Path) -> list[dict[str, Any]]:
    """Lines of schema 1 as ``dockpose estimate --json`` writes them.

    Raises
    ------
    FileError
        if the file cannot be read, or a line is not one; it is named by its number. A last line that was cut short, as
        a run that was stopped may leave, is left out where others are whole.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})") from error
    pieces = content.splitlines()
    lines = []
    for number, piece in enumerate(pieces, start=1):
        if not piece.strip():
            continue
        try:
            line = msgspec.json.decode(piece)
            msgspec.convert(line, _Line)
        except (ValueError, UnicodeDecodeError) as error:
            if number == len(pieces) > 1 and not content.endswith(b"\n"):
                break
            raise FileError(f"{path}: line {number} is none of schema {SCHEMA} ({error})") from error
        lines.append(line)
    if not lines:
        raise FileError(f"{path}: has no lines")
    return lines
