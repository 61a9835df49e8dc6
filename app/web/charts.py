"""Charts of the page, drawn by uPlot: an experiment's errors against range, and a sweep over the level."""

import math
import time
from collections.abc import Sequence
from html import escape
from typing import Any

import numpy as np
import viser
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, VERMILLION
from dockpose.app.experiment import Row
from dockpose.app.processing.comparison import CENTRES, SWEPT_LEVELS, LevelSweep
from dockpose.app.web.html import small
from dockpose.thresholds import LEVELS
from viser import uplot

Ends = tuple[float, float]
_FONT = "11px sans-serif"
_ERRORS_PX = 150
_LEAST = 0.1  # cm or degrees
_SIZES_PX = (4.0, 7.0, 10.0)  # so that points at the same place are all seen
_LOOKS = ((VERMILLION, 6.0), (ORANGE, 4.0), (BLUE, 2.0))  # no lines, which would fall to 0 where nothing was found
_SWEEP_PX = 190
_EVERY_S = 0.2


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


def sweep_top_px(sweep: LevelSweep) -> float:
    """Return the end of the vertical axis: 1, 2 or 5 times a power of ten, with nearly all errors below."""
    known = sweep.errors_px[~np.isnan(sweep.errors_px)]
    most = max(1.0, 1.1 * float(np.quantile(known, 0.97)) if len(known) else 1.0)
    power = 10.0 ** math.floor(math.log10(most))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= most)


def sweep_sentence(sweep: LevelSweep) -> str:
    """Say over which levels a dock was found, and the median error of each guess."""
    found = ~np.isnan(sweep.errors_px[:, 0])
    if not found.any():
        return f"No level shows a dock (measured against {sweep.reference})."
    medians = np.median(sweep.errors_px[found], axis=0)
    guesses = "; ".join(f"{name} {error:.2f} px" for name, error in zip(CENTRES, medians, strict=True))
    levels = sweep.levels[found]
    return (
        f"A dock at {len(levels)} of {len(sweep.levels)} levels, from {levels[0]} to {levels[-1]}. Median distance "
        f"from {sweep.reference}: {guesses}."
    )


class SweepChart:
    """Draws a sweep; hidden until the first."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._drawn_s = -math.inf
        curves = [rings(name, colour, size) for name, (colour, size) in zip(CENTRES, _LOOKS, strict=True)]
        axes = axis("fixed level (0-255)", 26, 16), axis("centre off by (px)", 34, 16)
        self._chart = Chart(gui, "level", curves, axes, _SWEEP_PX)
        self._sentence = gui.add_html("")

    def grow(self, sweep: LevelSweep) -> None:
        """Draw what was swept so far, a few times a second."""
        if time.monotonic() - self._drawn_s >= _EVERY_S or len(sweep.levels) == 1:
            self.show(sweep, f"Levels up to {sweep.levels[-1]} of {SWEPT_LEVELS[-1]} are drawn. ")
            self._drawn_s = time.monotonic()

    def show(self, sweep: LevelSweep, before: str = "") -> None:
        """Draw a sweep, and describe it after the words ``before``."""
        data = (sweep.levels.astype(float), *sweep.errors_px.T)  # NaN where a level shows no dock
        self._chart.show(data, x=(0.0, LEVELS - 1.0), y=(0.0, sweep_top_px(sweep)))
        self._sentence.content = small(escape(before + sweep_sentence(sweep)), 'id="sweep"')
