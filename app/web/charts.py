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
_FONT = "11px sans-serif"
_ERRORS_PX = 150
_LEAST = 0.1  # cm or degrees
_SIZES_PX = (4.0, 7.0, 10.0)  # so that points at the same place are all seen


def rings(label: str, colour: str, size_px: float) -> uplot.Series:
    """A row of rings, which are drawn in place of a line."""
    look: Any = {"size": size_px, "stroke": colour, "width": 1.5, "fill": "transparent"}
    points = uplot.Series_Points(show=True, **look)
    return uplot.Series(label=label, stroke="transparent", width=0, points=points, scale="y")


def axis(label: str = "", size: int = 32, label_size: int = 14, **more: Any) -> uplot.Axis:
    """Return an axis ``size`` pixels wide with a label; ``more`` are uPlot's own options."""
    named: Any = {"label": label, "labelSize": label_size, "labelFont": _FONT} if label else {}
    return uplot.Axis(font=_FONT, size=size, **named, **more)


class Chart:
    """A chart of curves over one axis."""

    def __init__(
        self, gui: viser.GuiApi, across: str, curves: Sequence[uplot.Series], axes: tuple[uplot.Axis, ...], height: int
    ) -> None:
        self._ends: dict[str, Ends] = {"x": (0.0, 1.0), "y": (0.0, 1.0)}
        self.handle = gui.add_uplot(
            data=(np.array([0.0, 1.0]), *([np.zeros(2)] * len(curves))),
            series=(uplot.Series(label=across), *curves),
            scales=_scales(self._ends),
            axes=axes,
            legend=uplot.Legend(show=True),
            height=height,
            padding=(10, 8, 0, 0),
            visible=False,  # until its first data
        )

    def show(self, data: Sequence[np.ndarray], **ends: Ends) -> None:
        """Draw the curves."""
        if ends != self._ends:  # with other scales the browser rebuilds the chart
            self._ends = ends
            self.handle.scales = _scales(ends)
        across, *values = data
        twice = 2 if len(across) == 1 else 1  # the browser draws nothing of a single point
        low, high = ends["y"]  # NaN, which would blank the whole chart, is drawn out of sight below the axis
        gapless = [np.where(np.isnan(one), low - (high - low), one) for one in values]
        self.handle.data = tuple(np.repeat(one, twice) for one in (across, *gapless))
        self.handle.visible = True


def fitting_ends(numbers: np.ndarray, least: float) -> Ends:
    """Return ends of an axis around all numbers but NaN, in whole steps, so that they seldom move."""
    known = numbers[~np.isnan(numbers)]
    if len(known) == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    step = 10.0 ** math.floor(math.log10(max(high - low, least)))
    return step * math.floor(low / step - 0.1), step * math.ceil(high / step + 0.1)


def _scales(ends: dict[str, Ends]) -> dict[str, uplot.Scale]:
    return {name: uplot.Scale(time=False, range=pair) for name, pair in ends.items()}


# Of each chart its title, and of its errors the index into :attr:`dockpose.app.experiment.Row.errors`, name and colour.
CHARTS = {
    "off by (cm)": ((0, "x", VERMILLION), (1, "y", GREEN), (2, "z", BLUE)),
    "off by (°)": ((3, "θx", VERMILLION), (4, "θy", BLUE)),
}


def error_points(rows: Sequence[Row], which: Sequence[int]) -> np.ndarray:
    """Return range in metres and errors, (n, 1 + quantities), nearest first; NaN for what is unknown."""
    numbers = [(row.range_cm, *(row.errors[index] for index in which)) for row in rows]
    table = np.array(numbers, dtype=float).reshape(-1, 1 + len(which))  # None becomes NaN
    table[:, 0] /= 100
    known = ~np.isnan(table[:, 0]) & ~np.isnan(table[:, 1:]).all(axis=1)
    return table[known][np.argsort(table[known, 0], kind="stable")]


class ErrorCharts:
    """Draws the errors of a session; hidden until one is known."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._charts: list[tuple[list[int], Chart]] = []
        for title, marks in CHARTS.items():
            curves = [rings(name, colour, size) for (_, name, colour), size in zip(marks, _SIZES_PX, strict=False)]
            chart = Chart(gui, "range (m)", curves, (axis(), axis(title, 40, space=20)), _ERRORS_PX)
            self._charts.append(([index for index, _, _ in marks], chart))

    def show(self, rows: Sequence[Row]) -> None:
        """Draw the errors of all rows that have some."""
        for which, chart in self._charts:
            points = error_points(rows, which)
            if len(points):
                ends = fitting_ends(np.append(points[:, 1:], 0.0), _LEAST)
                chart.show(tuple(points.T), x=fitting_ends(points[:, 0], _LEAST), y=ends)
            else:
                chart.handle.visible = False
