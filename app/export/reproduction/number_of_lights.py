"""Figure 17 of the paper: the pose's error against the number of lights."""

from collections.abc import Callable

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from dockpose.app.export.parts import Cell, Part, Rows
from dockpose.app.export.reproduction.pictures import canvas, legend_above
from dockpose.paper import light_numbers
from dockpose.paper.light_numbers import RING_OF, WHO, Errors, errors_with
from dockpose.pose.pnp import NAMES
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

COUNTS = (4, 5, 6, 7, 8, 10, 12, 16, 20, 24)
_WORDS = {"ellipse": "ellipse only", **NAMES, "ours": "ours, with spacing"}
_STYLES = {
    "ellipse": (ORANGE, "^", "--"),
    "epnp": (VERMILLION, "s", "-"),
    "ippe": (PURPLE, "D", ":"),
    "sqpnp": (GREEN, "x", "-"),
    "iterative": (SKY_BLUE, "+", "--"),
    "ours": (BLUE, "o", "-"),
}
_SHARES = {"median": 0.5, "90 %": 0.9}
_ERRORS = {"position": ("position (%)", "position (% of range)"), "angle_deg": ("angle (deg)", "normal (°)")}
Results = dict[tuple[int, int], Errors]


def figure_17(seed: int) -> Part:
    """Make Figure 17."""
    cells = [(count, count) for count in COUNTS] + [(count, RING_OF) for count in COUNTS if count < RING_OF]
    return part_of({(seen, lights): errors_with(seen, lights, seed) for seen, lights in cells})


def part_of(results: Results) -> Part:
    """The part for errors by the number of lights that are seen, and that the ring has."""
    return Part.of(
        "figure_17",
        {"main": _figure(results)},
        {
            "position": _table(results, lambda errors, who: errors.quantile("position", who)),
            "angle": _table(results, lambda errors, who: errors.quantile("angle_deg", who)),
            "wrong": _table(results, lambda errors, who: 100 * errors.wrong(who)),
            "curves": _curves(results),
        },
        set_up=light_numbers,
        results=results,
        first=COUNTS[0],
        last=COUNTS[-1],
        trials=len(results[10, 10].position["ours"]),
    )


def _table(results: Results, cell: Callable[[Errors, str], float]) -> Rows:
    rows: list[list[Cell]] = [["lights seen", *_WORDS.values()]]
    for (seen, lights), errors in results.items():
        cells = [None if np.isinf(errors.position[who]).all() else cell(errors, who) for who in WHO]
        rows.append([f"{seen} of {lights}", *cells])
    return rows


def _curves(results: Results) -> Rows:
    rows: list[list[Cell]] = []
    for (seen, lights), errors in results.items():
        for who in WHO:
            for what, (name, _) in _ERRORS.items():
                both = [errors.quantile(what, who, share) for share in _SHARES.values()]
                finite = [value if np.isfinite(value) else None for value in both]
                rows.append([seen, lights, _WORDS[who], name, *finite])
    return rows


def _figure(results: Results) -> Figure:
    figure = canvas(8.0, 9.0)
    grid = figure.subplots(4, 2, sharex="col", sharey="row")
    rings = {
        "complete ring": [cell for cell in results if cell[0] == cell[1]],
        f"some lights of a ring of {RING_OF}": sorted(cell for cell in results if cell[1] == RING_OF),
    }
    for column, (title, cells) in enumerate(rings.items()):
        grid[0, column].set_title(title, fontsize=9)
        grid[3, column].set_xlabel("number of lights seen")
        for row, (what, share) in enumerate((what, share) for what in _ERRORS for share in _SHARES):
            _draw(grid[row, column], results, cells, what, _SHARES[share])
            grid[row, 0].set_ylabel(f"{_ERRORS[what][1]}\n{share}")
    legend_above(figure, grid[0, 0], ncols=6, fontsize=8)
    return figure


def _draw(axes: Axes, results: Results, cells: list[tuple[int, int]], what: str, share: float) -> None:
    for who in WHO:
        values = np.array([results[cell].quantile(what, who, share) for cell in cells])
        values[~np.isfinite(values)] = np.nan
        colour, mark, dash = _STYLES[who]
        axes.plot([seen for seen, _ in cells], values, dash, marker=mark, color=colour, ms=4, lw=1, label=_WORDS[who])
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.grid(lw=0.4, color="0.85")
    axes.set_xticks([seen for seen, _ in cells])
