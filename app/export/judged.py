"""Methods judged over pictures with known lights: every result as CSV, the table as LaTeX."""

import math
from collections.abc import Sequence

from dockpose.app.experiment.record import csv_text
from dockpose.app.export.bundle import Files
from dockpose.app.export.data import latex_line, no_formula
from dockpose.app.processing.judged import HEAD, Judged, summary

_CSV = ["picture", "method", "level", "lights", "missed", "run_together", "strays"]
_CSV += ["status", "right", "off_m", "off_deg"]


def judged_files(rows: Sequence[Judged]) -> Files:
    """Return what can be taken away of methods that were judged."""
    return {
        "methods.csv": lambda: _csv(rows).encode(),
        "methods.tex": lambda: _latex(rows).encode(),
    }


def _csv(rows: Sequence[Judged]) -> str:
    lines: list[Sequence[object]] = [_CSV]
    for row in rows:
        lost, error = row.lost, row.error
        came = (None,) * 3 if error is None else (error.agrees, error.distance_m, math.degrees(error.angle_rad))
        counts = lost.lights, lost.missed, lost.joined, lost.strays
        lines.append((no_formula(row.picture), row.method, row.level, *counts, row.status, *came))
    return csv_text(lines)


def _latex(rows: Sequence[Judged]) -> str:
    head, *body = (latex_line(cells) for cells in (HEAD, *summary(rows)))
    begin = rf"\begin{{tabular}}{{l{'r' * (len(HEAD) - 1)}}}"
    return "\n".join([begin, rf"\hline {head} \hline", *body, r"\hline", r"\end{tabular}"]) + "\n"
