"""The charts of an experiment: errors of the estimates against range."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import viser
from dockpose.app.drawing.colours import BLUE, GREEN, VERMILLION
from dockpose.app.experiment import Row
from dockpose.app.web.charts.chart import Chart, Curve, axis, fitting_ends

_HEIGHT_PX = 150
_LEAST = 0.1  # cm or degrees
_SIZES_PX = (4.0, 7.0, 10.0)  # so that points at the same place are all seen


@dataclass(frozen=True)
class Marks:
    """What one chart shows; ``which`` are indices into :attr:`dockpose.app.experiment.Row.errors`."""

    title: str
    which: tuple[int, ...]
    names: tuple[str, ...]
    colours: tuple[str, ...]


CHARTS = (
    Marks("off by (cm)", (0, 1, 2), ("x", "y", "z"), (VERMILLION, GREEN, BLUE)),
    Marks("off by (°)", (3, 4), ("θx", "θy"), (VERMILLION, BLUE)),
)


def error_points(rows: Sequence[Row], marks: Marks) -> np.ndarray:
    """Return range in metres and errors, (n, 1 + quantities), nearest first; NaN for what is unknown."""
    numbers = [(row.range_cm, *(row.errors[index] for index in marks.which)) for row in rows]
    table = np.array(numbers, dtype=float).reshape(-1, 1 + len(marks.which))  # None becomes NaN
    table[:, 0] /= 100
    known = ~np.isnan(table[:, 0]) & ~np.isnan(table[:, 1:]).all(axis=1)
    return table[known][np.argsort(table[known, 0], kind="stable")]


class ErrorCharts:
    """Draws the errors of a session; hidden until one is known."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._charts = [(marks, _chart(gui, marks)) for marks in CHARTS]

    def show(self, rows: Sequence[Row]) -> None:
        """Draw the errors of all rows that have some."""
        for marks, chart in self._charts:
            points = error_points(rows, marks)
            if len(points):
                ends = fitting_ends(np.append(points[:, 1:], 0.0), _LEAST)
                chart.show(tuple(points.T), x=fitting_ends(points[:, 0], _LEAST), y=ends)
            else:
                chart.hide()


def _chart(gui: viser.GuiApi, marks: Marks) -> Chart:
    curves = [
        Curve(name, colour, marks_px=size)
        for name, colour, size in zip(marks.names, marks.colours, _SIZES_PX, strict=False)
    ]
    return Chart(gui, "range (m)", curves, (axis(), axis(marks.title, 40, space=20)), _HEIGHT_PX)
