"""Charts of the page, drawn by uPlot: an experiment's errors against range."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import viser
from dockpose.app.drawing.colours import BLUE, GREEN, VERMILLION
from dockpose.app.experiment import Row
from viser import uplot

Ends = tuple[float, float]
_FONT = "12px sans-serif"
_ERRORS_PX = 150
_LEAST = 0.1  # cm or degrees
_SIZES_PX = (4.0, 7.0, 10.0)  # so that points at the same place are all seen
# Of each chart its title, and of its errors the index into :attr:`dockpose.app.experiment.Row.errors`, name and colour.
CHARTS = {
    "off by (cm)": ((0, "x", VERMILLION), (1, "y", GREEN), (2, "z", BLUE)),
    "off by (°)": ((3, "θx", VERMILLION), (4, "θy", BLUE)),
}


def rings(label: str, colour: str, size_px: float) -> uplot.Series:
    """A row of rings, which are drawn in place of a line."""
    look: Any = {"size": size_px, "stroke": colour, "width": 1.5, "fill": "transparent"}
    points = uplot.Series_Points(show=True, **look)
    return uplot.Series(label=label, stroke="transparent", width=0, points=points, scale="y")


class Chart:
    """A chart of errors over the range; ``marks`` are those of ``CHARTS``."""

    def __init__(self, gui: viser.GuiApi, title: str, marks: Sequence[tuple[int, str, str]]) -> None:
        self.which = [index for index, _, _ in marks]
        self._ends: dict[str, Ends] = {"x": (0.0, 1.0), "y": (0.0, 1.0)}
        label: Any = {"label": title, "labelSize": 14, "labelFont": _FONT, "space": 20}
        curves = [rings(name, colour, size) for (_, name, colour), size in zip(marks, _SIZES_PX, strict=False)]
        self.handle = gui.add_uplot(
            data=(np.array([0.0, 1.0]), *([np.zeros(2)] * len(curves))),
            series=(uplot.Series(label="range (m)"), *curves),
            scales=_scales(self._ends),
            axes=(uplot.Axis(font=_FONT, size=32), uplot.Axis(font=_FONT, size=40, **label)),
            legend=uplot.Legend(show=True),
            height=_ERRORS_PX,
            padding=(10, 8, 0, 0),
            visible=False,  # until its first data
        )

    def show(self, points: np.ndarray) -> None:
        """Draw points (n, 1 + errors), see :func:`error_points`."""
        self.handle.visible = len(points) > 0
        if len(points) == 0:
            return
        ends = {"x": fitting_ends(points[:, 0], _LEAST), "y": fitting_ends(np.append(points[:, 1:], 0.0), _LEAST)}
        if ends != self._ends:  # with other scales the browser rebuilds the chart
            self._ends = ends
            self.handle.scales = _scales(ends)
        twice = 2 if len(points) == 1 else 1  # the browser draws nothing of a single point
        low, high = ends["y"]  # NaN, which would blank the whole chart, is drawn out of sight below the axis
        gapless = np.where(np.isnan(points), low - (high - low), points)
        self.handle.data = tuple(np.repeat(one, twice) for one in gapless.T)


def fitting_ends(numbers: np.ndarray, least: float) -> Ends:
    """Return ends of an axis around all numbers but NaN, in whole steps, so that they seldom move."""
    known = numbers[~np.isnan(numbers)]
    low, high = float(known.min()), float(known.max())
    step = 10.0 ** math.floor(math.log10(max(high - low, least)))
    return step * math.floor(low / step - 0.1), step * math.ceil(high / step + 0.1)


def _scales(ends: dict[str, Ends]) -> dict[str, uplot.Scale]:
    return {name: uplot.Scale(time=False, range=pair) for name, pair in ends.items()}


def error_points(rows: Sequence[Row], which: Sequence[int]) -> np.ndarray:
    """Return range in metres and errors, (n, 1 + quantities), nearest first; NaN for what is unknown."""
    numbers = [(row.range_cm, *(row.errors[index] for index in which)) for row in rows]
    table = np.array(numbers, dtype=float).reshape(-1, 1 + len(which))  # None becomes NaN
    table[:, 0] /= 100
    known = ~np.isnan(table[:, 0]) & ~np.isnan(table[:, 1:]).all(axis=1)
    return table[known][np.argsort(table[known, 0], kind="stable")]
