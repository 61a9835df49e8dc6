"""A picture's results as JSON, row and YAML; a session's table "estimated (measured)" as CSV, Markdown, LaTeX, HTML."""

import csv
import io
import json
import math
import re
import unicodedata
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import cv2
import msgspec
import numpy as np
import yaml
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.drawing.numbers import (
    LATEX,
    MISSING,
    POSE_COLUMNS,
    QUANTITIES,
    SI_COLUMNS,
    SIGMA_COLUMNS,
    TOTAL_COLUMNS,
    number,
)
from dockpose.app.experiment.record import Row, csv_text
from dockpose.app.resources import read_toml, with_versions
from markupsafe import escape

if TYPE_CHECKING:
    from dockpose.app.processing.analysis import Analysis

_CANDIDATE_COLUMNS = (*SI_COLUMNS, "probability", "rms_px")
_TRACK_KEYS = ("probability", "age", "predicted", "lost")
# One pose of the frame, as other programs take it: the chosen candidate; as the frames before predict it, filtered over
# the frames up to this one, and smoothed over all frames of the recording.
_POSES = ("chosen", "predicted", "filtered", "smoothed")
_VEHICLE = (
    *("frame", "x_m", "y_m", "z_m", "qx", "qy", "qz", "qw"),
    *("sigma_total_x_m", "sigma_total_y_m", "sigma_total_z_m"),
)
_GUIDANCE = (
    *("along_m", "across_m", "above_m", "yaw_off_deg", "pitch_off_deg", "off_axis_deg", "inside_cone", "target"),
    *("target_x_m", "target_y_m", "target_z_m"),
)
_COLUMNS_OF = {
    **{name.lower(): _CANDIDATE_COLUMNS for name in POSE_NAMES},
    **{name: (*SI_COLUMNS, *SIGMA_COLUMNS, *TOTAL_COLUMNS) for name in _POSES},
    **{"vehicle": _VEHICLE, "guidance": _GUIDANCE},
}
CSV_COLUMNS = (
    *("source", "frame", "time_s", "time_unix_s", "status", "method", "level", "groups", "lights_on_ring"),
    *("selected", "selected_by"),
    *(f"{name.lower()}_{column}" for name in POSE_NAMES for column in _CANDIDATE_COLUMNS),
    *(f"track_{key}" for key in _TRACK_KEYS),
    *("elapsed_ms", "message"),
    *(f"{name}_{column}" for name in _POSES for column in (*SI_COLUMNS, *SIGMA_COLUMNS)),
    "smoothed_probability",
    *(f"{name}_{column}" for name in _POSES for column in TOTAL_COLUMNS),
    *(f"vehicle_{column}" for column in _VEHICLE),
    *(f"guidance_{column}" for column in _GUIDANCE),
    *("track_number", "found_by"),
)
CSV_HEAD = (
    *("number", "time", "source", "status", "probability", "range_cm"),
    *(f"{kind}{name}" for name in POSE_COLUMNS for kind in ("", "measured_", "error_")),
    "notes",
)
_FORMULA = re.compile(r"^[=+\-@\t]")
_GREEK = re.compile(r"GREEK (SMALL|CAPITAL) LETTER (\w+)$")


def result_line(analysis: "Analysis", sha256: str | None = None) -> dict[str, Any]:
    """Return the JSON object of schema 1, with version numbers; ``sha256`` is the checksum of the picture's file."""
    return with_versions(analysis.estimate.to_dict(analysis.view.source, frame=0, sha256=sha256))


def to_json(line: dict[str, Any]) -> bytes:
    """Return a JSON object as an indented file."""
    return (json.dumps(line, allow_nan=False, indent=2) + "\n").encode()


def to_csv(lines: Iterable[dict[str, Any]]) -> bytes:
    """Return a table with one row per JSON object and the columns of ``dockpose estimate --csv``."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, CSV_COLUMNS)
    table.writeheader()
    table.writerows(to_row(line) for line in lines)
    return text.getvalue().encode()


def to_row(line: dict[str, Any]) -> dict[str, Any]:
    """Return the row of one JSON object; what is not known is left out."""
    threshold, track = line["threshold"] or {}, line.get("track") or {}
    row: dict[str, Any] = {
        **{key: line[key] for key in ("source", "frame", "time_s", "status", "selected_by", "elapsed_ms", "message")},
        "time_unix_s": line.get("time_unix_s"),  # lines of older versions have none
        **{key: threshold.get(key) for key in ("method", "level", "groups")},
        "lights_on_ring": sum(marker["on_ring"] is True for marker in line["markers"]),
        "selected": None if line["selected"] is None else POSE_NAMES[line["selected"]],
        **{f"track_{key}": track.get(key) for key in _TRACK_KEYS},
        "track_number": track.get("number"),
        "found_by": line.get("found_by"),
        "smoothed_probability": (line.get("smoothed") or {}).get("probability"),
    }
    parts: dict[str, Iterable[Any]] = {}  # values in the order of their columns, by what these begin with
    for name, candidate in zip(POSE_NAMES, line["candidates"], strict=False):
        parts[name.lower()] = (*candidate["position_m"], *(candidate[key] for key in _CANDIDATE_COLUMNS[3:]))
    for name in _POSES:
        if (pose := line.get(name)) is not None:
            parts[name] = _pose_values(pose)
    if (body := line.get("vehicle")) is not None:
        sigmas = body["sigma_total_position_m"] or (None,) * 3
        parts["vehicle"] = (body["frame"], *body["position_m"], *body["quaternion_xyzw"], *sigmas)
    if (guidance := line.get("guidance")) is not None:
        parts["guidance"] = (*(guidance[key] for key in _GUIDANCE[:-3]), *guidance["target_m"])
    for name, values in parts.items():
        row |= {f"{name}_{key}": value for key, value in zip(_COLUMNS_OF[name], values, strict=True)}
    return row


def _pose_values(pose: dict[str, Any]) -> Iterator[Any]:
    yield from (*pose["position_m"], pose["theta_x_deg"], pose["theta_y_deg"])
    for sigma in ("sigma", "sigma_total"):
        yield from pose.get(f"{sigma}_position_m") or (None,) * 3
        yield from pose.get(f"{sigma}_theta_deg") or (None,) * 2


def settings_yaml(analysis: "Analysis") -> str:
    """Return the settings, dock and camera that were used and, where there is one, the measured pose as YAML."""
    view, found = analysis.view, analysis.estimate
    content: dict[str, Any] = {
        "source": view.source,
        "settings": msgspec.to_builtins(found.settings),
        "dock": msgspec.to_builtins(found.dock),
        "camera": msgspec.to_builtins(found.camera),
    }
    if view.measured is not None:
        content["measured"] = msgspec.to_builtins(view.measured)
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def to_png(picture: np.ndarray) -> bytes:
    """Encode a picture as PNG, losslessly."""
    return cv2.imencode(".png", picture)[1].tobytes()


def csv_table(rows: Sequence[Row]) -> str:
    """Return a line per row, unknown values blank; what a spreadsheet would take for a formula gets an apostrophe."""
    lines: list[Sequence[object]] = [CSV_HEAD]
    for row in rows:
        triples = zip(row.estimated, row.measured, row.errors, strict=True)
        lines.append(
            [row.number, row.time, _no_formula(row.source), row.status, row.probability, _rounded(row.range_cm)]
            + [_rounded(value) for triple in triples for value in triple]
            + [_no_formula(row.notes)]
        )
    return csv_text(lines)


def markdown_table(rows: Sequence[Row]) -> str:
    """Return a table in GitHub's Markdown."""
    content = table(rows)
    lines = [content.head, ["---:"] * (len(content.head) - 1) + ["---"]]
    lines += [[_markdown(cell) for cell in cells] for cells in content.body]
    lines += [[f"**{cell}**" if cell else "" for cell in cells] for cells in content.foot]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in lines)


def latex_table(rows: Sequence[Row]) -> str:
    """Return a ``longtable`` without the error columns; the document must load the package of that name."""
    content = table(rows, with_errors=False)
    head = " & ".join(rf"\textbf{{{name}}}" for name in ("No.", *LATEX, "Notes"))
    lines = [
        "% estimated (measured); needs \\usepackage{longtable}",
        r"\begin{longtable}{rrrrrrp{0.2\textwidth}}",
        rf"\hline {head} \\ \hline \endhead",
        *(_latex_line(cells) for cells in content.body),
        r"\hline",
        *(_latex_line(cells) for cells in content.foot),
        r"\hline",
        r"\end{longtable}",
    ]
    return "\n".join(lines) + "\n"


def html_table(rows: Sequence[Row]) -> str:
    """Return a complete page with the table."""
    from dockpose.app.export.parts import page

    return page("table.html", table=table(rows)) + "\n"


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 6)


def _no_formula(text: str) -> str:
    return f"'{text}" if _FORMULA.match(text) else text


def _markdown(text: str) -> str:
    """Escape Markdown and HTML; a line break becomes <br>."""
    is_number = re.fullmatch(rf"[+-]?[\d.]+( \([+-]?[\d.]+\))?|{MISSING}( \([+-]?[\d.]+\))?", text)
    marked = text if is_number else re.sub(r"([\\`*_{}\[\]()#+!|~$-])", r"\\\1", text)
    return str(escape(marked)).replace("\n", "<br>")


def _latex_line(cells: Sequence[str]) -> str:
    return " & ".join(to_latex(cell) for cell in cells) + r" \\"


def to_latex(text: str) -> str:
    """Return LaTeX that prints the text and does nothing else; letters without a font in plain LaTeX become "?"."""
    return "".join(_character(character) for character in unicodedata.normalize("NFC", text))


def _character(character: str) -> str:
    commands = read_toml("latex.toml")
    if character in commands["characters"]:
        return commands["characters"][character]
    if " " <= character <= "~":
        return character
    letter, *marks = unicodedata.normalize("NFD", character)
    if letter.isascii() and letter.isalpha() and len(marks) == 1 and marks[0] in commands["accents"]:
        dotless = rf"\{letter}" if letter in "ij" and marks[0] != "\N{COMBINING CEDILLA}" else letter
        return f"{commands['accents'][marks[0]]}{{{dotless}}}"
    match = _GREEK.match(unicodedata.name(character, ""))
    if match is None:
        return "?"
    name = {"LAMDA": "lambda"}.get(match[2], match[2].lower())
    command = name if match[1] == "SMALL" else name.capitalize()
    return rf"$\{command}$" if name in read_toml("latex.toml")["greek"][match[1]].split() else "?"


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
