"""A picture's results as JSON, row and YAML; a session's table "estimated (measured)" as CSV and LaTeX."""

import csv
import io
import json
import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TYPE_CHECKING, Any

import cv2
import msgspec
import numpy as np
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
from dockpose.app.resources import with_versions
from dockpose.files import to_yaml

if TYPE_CHECKING:
    from dockpose.app.processing.analysis import Analysis


_TURN = ("qx", "qy", "qz", "qw")


def _keys(before: str, path: str, *keys: str) -> dict[str, str]:
    """Columns for values below a path, called as they are there."""
    return {f"{before}{key}": f"{path}{key}" for key in keys}


def _list(before: str, path: str, columns: Sequence[str]) -> dict[str, str]:
    """Columns for the numbers of a list."""
    return {f"{before}{column}": f"{path}/{place}" for place, column in enumerate(columns)}


def _pose(name: str, path: str) -> dict[str, str]:
    return _list(f"{name}_", f"{path}/position_m", SI_COLUMNS[:3]) | _keys(f"{name}_", f"{path}/", *SI_COLUMNS[3:])


def _whole_pose(name: str) -> dict[str, str]:
    return _pose(name, name) | _list(f"{name}_", f"{name}/quaternion_xyzw", _TURN)


def _sigmas(name: str, sigma: str, columns: Sequence[str]) -> dict[str, str]:
    lengths = _list(f"{name}_", f"{name}/{sigma}_position_m", columns[:3])
    return lengths | _list(f"{name}_", f"{name}/{sigma}_theta_deg", columns[3:])


# One pose of the frame, as other programs take it: the chosen candidate; as the frames before predict it, and filtered
# over the frames up to this one.
_POSES = ("chosen", "predicted", "filtered")
# Each column of a row, and the keys and places that lead to its value in a line of schema 1.
_COLUMNS = {
    **_keys("", "", "source", "frame", "time_s", "time_unix_s", "status"),
    **_keys("", "threshold/", "method", "level", "groups"),
    **{"lights_on_ring": "markers", "selected": "selected", "selected_by": "selected_by"},
    **_pose("a", "candidates/0"),
    **_keys("a_", "candidates/0/", "probability", "rms_px"),
    **_pose("b", "candidates/1"),
    **_keys("b_", "candidates/1/", "probability", "rms_px"),
    **_keys("track_", "track/", "probability", "age", "predicted", "lost"),
    "elapsed_ms": "elapsed_ms",
    **dict(chain(*((_whole_pose(name) | _sigmas(name, "sigma", SIGMA_COLUMNS)).items() for name in _POSES))),
    **dict(chain(*(_sigmas(name, "sigma_total", TOTAL_COLUMNS).items() for name in _POSES))),
    "vehicle_frame": "vehicle/frame",
    **_list("vehicle_", "vehicle/position_m", SI_COLUMNS[:3]),
    **_list("vehicle_", "vehicle/quaternion_xyzw", _TURN),
    **_list("vehicle_", "vehicle/sigma_total_position_m", TOTAL_COLUMNS[:3]),
    **_keys("guidance_", "guidance/", "along_m", "across_m", "above_m", "yaw_off_deg", "pitch_off_deg"),
    **_keys("guidance_", "guidance/", "off_axis_deg", "inside_cone", "target"),
    **_list("guidance_target_", "guidance/target_m", SI_COLUMNS[:3]),
    **{"track_number": "track/number", "found_by": "found_by", "message": "message"},
}
CSV_COLUMNS = tuple(_COLUMNS)
CSV_HEAD = (
    *("number", "time", "source", "status", "probability", "range_cm"),
    *(f"{kind}{name}" for name in POSE_COLUMNS for kind in ("", "measured_", "error_")),
    "notes",
)
_FORMULA = re.compile(r"^[=+\-@\t]")
# What commands are made of, and signs that the usual fonts lack.
_IN_LATEX = str.maketrans(
    {sign: rf"\{sign}" for sign in "{}$&#_%"}
    | {"\\": r"\textbackslash{}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}", "\n": " ", "\t": " "}
    | {"<": "$<$", ">": "$>$", "|": "$|$", "°": r"$^\circ$", "±": r"$\pm$", "×": r"$\times$", "µ": r"$\mu$"}
)


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
    """Return the row of one JSON object; what is not known is None."""
    row = {column: _value(line, path) for column, path in _COLUMNS.items()}
    row["lights_on_ring"] = sum(marker["on_ring"] is True for marker in row["lights_on_ring"])
    row["selected"] = None if row["selected"] is None else POSE_NAMES[row["selected"]]
    return row


def _value(line: Any, path: str) -> Any:
    """What stands in a line; None for what does not, as in one of an older version."""
    for key in path.split("/"):
        try:
            line = line[key if isinstance(line, dict) else int(key)]
        except (LookupError, TypeError, ValueError):
            return None
    return line


def settings_yaml(analysis: "Analysis") -> str:
    """Return the settings, dock and camera that were used, and of the picture a measured pose and lights set by hand.

    As NAME.yaml beside NAME.png it tells all of this of that picture.
    """
    view, found = analysis.view, analysis.estimate
    content: dict[str, Any] = {
        "source": view.source,
        "settings": msgspec.to_builtins(found.settings),
        "dock": msgspec.to_builtins(found.dock),
        "camera": msgspec.to_builtins(found.camera),
    }
    if view.measured is not None:
        content["measured"] = msgspec.to_builtins(view.measured)
    if found.by_hand is not None:
        content |= msgspec.to_builtins(found.by_hand)
    return to_yaml(content)


def to_png(picture: np.ndarray) -> bytes:
    """Encode a picture as PNG, losslessly."""
    return cv2.imencode(".png", picture)[1].tobytes()


def csv_table(rows: Sequence[Row]) -> str:
    """Return a line per row, unknown values blank; what a spreadsheet would take for a formula gets an apostrophe."""
    lines: list[Sequence[object]] = [CSV_HEAD]
    for row in rows:
        triples = zip(row.estimated, row.measured, row.errors, strict=True)
        lines.append(
            [row.number, row.time, no_formula(row.source), row.status, row.probability, _rounded(row.range_cm)]
            + [_rounded(value) for triple in triples for value in triple]
            + [no_formula(row.notes)]
        )
    return csv_text(lines)


def latex_table(rows: Sequence[Row]) -> str:
    """Return a ``longtable`` without the error columns; the document must load the package of that name."""
    content = table(rows, with_errors=False)
    head = " & ".join(rf"\textbf{{{name}}}" for name in ("No.", *LATEX, "Notes"))
    lines = [
        "% estimated (measured); needs \\usepackage{longtable}, and XeLaTeX or LuaLaTeX where notes have Greek",
        r"\begin{longtable}{rrrrrrp{0.2\textwidth}}",
        rf"\hline {head} \\ \hline \endhead",
        *(latex_line(cells) for cells in content.body),
        r"\hline",
        *(latex_line(cells) for cells in content.foot),
        r"\hline",
        r"\end{longtable}",
    ]
    return "\n".join(lines) + "\n"


def _rounded(value: float | None) -> float | None:
    return None if value is None else round(value, 6)


def no_formula(text: str) -> str:
    """Return text that no spreadsheet takes for a formula."""
    return f"'{text}" if _FORMULA.match(text) else text


def latex_line(cells: Sequence[str]) -> str:
    """Return a row of a table, its cells printed as they are."""
    return " & ".join(to_latex(cell) for cell in cells) + r" \\"


def to_latex(text: str) -> str:
    """Return LaTeX that prints the text and does nothing else; letters stand as they are, in UTF-8 as LaTeX reads."""
    return text.translate(_IN_LATEX)


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
