"""Methods judged over pictures with known lights: every result as CSV, the table as LaTeX, and a plot."""

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE
from dockpose.app.drawing.figures import new_figure, to_png, to_svg
from dockpose.app.experiment.record import csv_text
from dockpose.app.export.bundle import Files
from dockpose.app.export.data import latex_line, no_formula
from dockpose.app.processing.judged import HEAD, Judged, summary

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_CSV = ["picture", "method", "level", "lights", "missed", "run_together", "strays"]
_CSV += ["status", "right", "off_m", "off_deg"]
_BARS: tuple[tuple[str, str, Callable[[Judged], int]], ...] = (
    ("found alone", GREEN, lambda row: row.lost.lights - row.lost.missed - row.lost.joined),
    ("run together", ORANGE, lambda row: row.lost.joined),
)
_DOCKS: tuple[tuple[str, str, Callable[[Judged], bool]], ...] = (
    ("a dock", BLUE, lambda row: row.status == "ok"),
    ("a pose that is right", GREEN, lambda row: row.error is not None and row.error.agrees),
)


def judged_files(rows: Sequence[Judged]) -> Files:
    """Return what can be taken away of methods that were judged."""
    return {
        "methods.csv": lambda: _csv(rows).encode(),
        "methods.tex": lambda: _latex(rows).encode(),
        "methods.svg": lambda: to_svg(_figure(rows)),
        "methods.png": lambda: to_png(_figure(rows)),
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


def _figure(rows: Sequence[Judged]) -> "Figure":
    """Bars of the lights that each method found alone or run together, and of its docks, in per cent."""
    table = {row[0]: row for row in summary(rows)}
    figure = new_figure(7.0, 1.2 + 0.35 * len(table), layout="constrained")
    axes, places = figure.subplots(1, 2, sharey=True), range(len(table))
    of = {method: [row for row in rows if row.method == method] for method in dict.fromkeys(row.method for row in rows)}
    left = [0.0] * len(of)
    for label, colour, counted in _BARS:
        shares = [100 * sum(map(counted, mine)) / sum(row.lost.lights for row in mine) for mine in of.values()]
        axes[0].barh(places, shares, left=left, color=colour, label=label)
        left = [one + share for one, share in zip(left, shares, strict=True)]
    for label, colour, came in _DOCKS:
        axes[1].barh(
            places, [100 * sum(map(came, mine)) / len(mine) for mine in of.values()], color=colour, label=label
        )
    for one, title in zip(axes, ("lights (%)", "pictures (%)"), strict=True):
        one.set(xlim=(0, 100), xlabel=title)
        one.legend(loc="upper center", bbox_to_anchor=(0.5, 1.12), ncols=2, frameon=False, fontsize=8)
    axes[0].set_yticks(places, table)
    axes[0].invert_yaxis()
    return figure
