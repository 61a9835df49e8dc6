"""The charts of an experiment: how far the estimates are off, against range."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from dockpose.app.experiment import Row
from viser import uplot

_HEIGHT_PX = 150


@dataclass(frozen=True)
class Marks:
    """What one chart shows.

    Attributes
    ----------
    title : of its vertical axis, with the unit.
    which : places in :attr:`dockpose.app.experiment.Row.errors`.
    names, colours : of the quantities; Okabe and Ito's colours, and each quantity's points have their own size.
    """

    title: str
    which: tuple[int, ...]
    names: tuple[str, ...]
    colours: tuple[str, ...]


CHARTS = (
    Marks("off by (cm)", (0, 1, 2), ("x", "y", "z"), ("#D55E00", "#009E73", "#0072B2")),
    Marks("off by (°)", (3, 4), ("θx", "θy"), ("#D55E00", "#0072B2")),
)
_SIZES_PX = (4.0, 7.0, 10.0)


def error_points(rows: Sequence[Row], marks: Marks) -> np.ndarray:
    """Range in metres and the errors, (n, 1 + quantities), nearest first; NaN for what is not known.

    Rows without a range, and those without any error, are left out.
    """
    table = np.array(
        [
            [math.nan if number is None else number for number in (row.range_cm, *(row.errors[i] for i in marks.which))]
            for row in rows
        ],
        dtype=float,
    ).reshape(-1, 1 + len(marks.which))
    table[:, 0] /= 100
    known = ~np.isnan(table[:, 0]) & ~np.isnan(table[:, 1:]).all(axis=1)
    return table[known][np.argsort(table[known, 0], kind="stable")]


def chart_ends(numbers: np.ndarray) -> tuple[float, float]:
    """Ends of an axis around all numbers, in whole steps, so that they seldom move."""
    known = numbers[~np.isnan(numbers)]
    low, high = float(known.min()), float(known.max())
    step = 10.0 ** math.floor(math.log10(max(high - low, 0.1)))
    return step * math.floor(low / step - 0.1), step * math.ceil(high / step + 0.1)


class ErrorCharts:
    """Draws the errors of a session; not there before one is known."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._charts = [_Chart(gui, marks) for marks in CHARTS]

    def show(self, rows: Sequence[Row]) -> None:
        """Draw the errors of all rows that have some."""
        for chart in self._charts:
            chart.show(rows)


class _Chart:
    def __init__(self, gui: viser.GuiApi, marks: Marks) -> None:
        self._marks = marks
        font, flat = "11px sans-serif", np.zeros(2)
        self._ends = ((0.0, 1.0), (0.0, 1.0))
        self._chart = gui.add_uplot(
            data=(np.array([0.0, 1.0]), *([flat] * len(marks.names))),
            series=(
                uplot.Series(label="range (m)"),
                *(
                    uplot.Series(
                        label=name,
                        stroke="transparent",
                        width=0,
                        points=uplot.Series_Points(show=True, size=size, stroke=colour, width=1.5, fill="transparent"),
                    )
                    for name, colour, size in zip(marks.names, marks.colours, _SIZES_PX, strict=False)
                ),
            ),
            scales=self._scales(),
            axes=(
                uplot.Axis(size=32, font=font),  # what it counts stands in the legend below
                uplot.Axis(label=marks.title, labelSize=14, size=40, font=font, labelFont=font, space=20),
            ),
            legend=uplot.Legend(show=True),
            height=_HEIGHT_PX,
            padding=(10, 8, 0, 0),
            visible=False,
        )

    def show(self, rows: Sequence[Row]) -> None:
        points = error_points(rows, self._marks)
        self._chart.visible = len(points) > 0
        if len(points) == 0:
            return
        ends = chart_ends(points[:, 0]), chart_ends(np.append(points[:, 1:], 0.0))
        if ends != self._ends:  # with other scales the browser builds the chart anew
            self._ends = ends
            self._chart.scales = self._scales()
        # A gap would need NaN, which blanks the whole chart: what is not known goes below it, out of sight.
        hidden = ends[1][0] - (ends[1][1] - ends[1][0])
        # The browser draws nothing of a single point.
        drawn = np.repeat(points, 2, axis=0) if len(points) == 1 else points
        self._chart.data = (drawn[:, 0], *(np.where(np.isnan(line), hidden, line) for line in drawn[:, 1:].T))

    def _scales(self) -> dict[str, uplot.Scale]:
        return {"x": uplot.Scale(time=False, range=self._ends[0]), "y": uplot.Scale(range=self._ends[1])}
