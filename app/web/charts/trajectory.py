"""The charts of a sequence over time: place, attitude, and how sure it is; frames without the dock are marked."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import viser
from dockpose.app.processing.trajectory import COLUMNS, Trajectory
from viser import uplot

MOST_POINTS = 400  # a chart is as wide as that on the screen
_HEIGHT_PX = 135
_LOST_COLOUR = "#D55E00"


@dataclass(frozen=True)
class Lines:
    """What one chart shows.

    Attributes
    ----------
    title : of its vertical axis, with the unit.
    columns : of a course, see :data:`dockpose.app.processing.trajectory.COLUMNS`.
    names : of the lines.
    colours : of the lines, Okabe and Ito's; they differ in their dashes too.
    factor : from the column's unit to the axis's.
    bounds : of the axis; None to fit the numbers.
    """

    title: str
    columns: tuple[str, ...]
    names: tuple[str, ...]
    colours: tuple[str, ...]
    factor: float = 1.0
    bounds: tuple[float, float] | None = None


CHARTS = (
    Lines("place (cm)", ("x_m", "y_m", "z_m"), ("x", "y", "z"), ("#E69F00", "#009E73", "#0072B2"), factor=100.0),
    Lines("angle (°)", ("theta_x_deg", "theta_y_deg"), ("θx", "θy"), ("#E69F00", "#0072B2")),
    Lines(
        "0 to 1",
        ("eccentricity", "probability"),
        ("eccentricity", "probability"),
        ("#CC79A7", "#0072B2"),
        bounds=(0.0, 1.05),
    ),
)
_DASHES = ((), (6.0, 3.0), (2.0, 2.0))


def chart_data(table: np.ndarray, lines: Lines, bounds: tuple[float, float]) -> tuple[np.ndarray, ...]:
    """Times, the lines, and the marks of frames without the dock at the bottom; hidden below it where there is nothing.

    A gap would need NaN, which blanks the whole chart.
    """
    low, high = bounds
    hidden = low - (high - low)
    numbers = [lines.factor * table[:, COLUMNS.index(column)] for column in lines.columns]
    lost = np.where(table[:, COLUMNS.index("lost")] > 0, low + 0.03 * (high - low), hidden)
    return (table[:, 0], *(np.where(np.isnan(line), hidden, line) for line in numbers), lost)


def fitting_bounds(table: np.ndarray, lines: Lines) -> tuple[float, float]:
    """Ends of the vertical axis around all numbers, in whole steps, so that they seldom move."""
    if lines.bounds is not None:
        return lines.bounds
    numbers = lines.factor * table[:, [COLUMNS.index(column) for column in lines.columns]]
    known = numbers[~np.isnan(numbers)]
    if len(known) == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    step = 10.0 ** math.floor(math.log10(max(high - low, 1.0)))
    return step * math.floor(low / step - 0.1), step * math.ceil(high / step + 0.1)


class TrajectoryCharts:
    """Draws a course; not there before the first frame."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._charts = [_Chart(gui, lines) for lines in CHARTS]

    def show(self, trajectory: Trajectory) -> None:
        """Draw what was found so far."""
        table = trajectory.table(MOST_POINTS)
        for chart in self._charts:
            chart.show(table)

    def hide(self) -> None:
        """Take the charts away."""
        for chart in self._charts:
            chart.hide()


class _Chart:
    def __init__(self, gui: viser.GuiApi, lines: Lines) -> None:
        self._lines, self._bounds, self._times = lines, (0.0, 1.0), (0.0, 1.0)
        flat, font = np.zeros(2), "11px sans-serif"
        no_points = uplot.Series_Points(show=False)
        self._chart = gui.add_uplot(
            data=(np.array([0.0, 1.0]), *([flat] * (len(lines.names) + 1))),
            series=(
                uplot.Series(label="time (s)"),
                *(
                    uplot.Series(label=name, stroke=colour, dash=dash, width=2, points=no_points)
                    for name, colour, dash in zip(lines.names, lines.colours, _DASHES, strict=False)
                ),
                uplot.Series(
                    label="no dock",
                    stroke="transparent",
                    width=0,
                    points=uplot.Series_Points(show=True, size=5, fill=_LOST_COLOUR, stroke=_LOST_COLOUR),
                ),
            ),
            scales=self._scales(),
            axes=(
                uplot.Axis(size=32, font=font),  # what it counts stands in the legend below
                uplot.Axis(label=lines.title, labelSize=14, size=40, font=font, labelFont=font, space=20),
            ),
            legend=uplot.Legend(show=True),
            height=_HEIGHT_PX,
            padding=(10, 8, 0, 0),
            visible=False,
        )

    def show(self, table: np.ndarray) -> None:
        if len(table) < 2:
            return
        bounds = fitting_bounds(table, self._lines)
        times = (float(table[0, 0]), _next_step(float(table[-1, 0])))
        if (bounds, times) != (self._bounds, self._times):  # with other scales the browser builds the chart anew
            self._bounds, self._times = bounds, times
            self._chart.scales = self._scales()
        self._chart.data = chart_data(table, self._lines, bounds)
        self._chart.visible = True

    def hide(self) -> None:
        self._chart.visible = False

    def _scales(self) -> dict[str, uplot.Scale]:
        return {"x": uplot.Scale(time=False, range=self._times), "y": uplot.Scale(range=self._bounds)}


def _next_step(time_s: float) -> float:
    """The end of the time axis: 1, 2 or 5 times a power of ten, so that it seldom moves while a sequence plays."""
    power = 10.0 ** math.floor(math.log10(max(time_s, 1.0)))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= time_s)
