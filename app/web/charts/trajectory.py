"""The charts of a sequence over time: position, attitude and probability, with frames that show no dock marked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import viser
from dockpose.app.drawing.colours import BLUE, DROPPED_COLOUR, GREEN, ORANGE, PURPLE
from dockpose.app.processing.trajectory import COLUMNS, Trajectory
from dockpose.app.web.charts.chart import Chart, Curve, Ends, axis, fitting_ends, round_above

MOST_POINTS = 400  # about the width of a chart on the screen
_HEIGHT_PX = 135
_DASHES = ((), (6.0, 3.0), (2.0, 2.0))


@dataclass(frozen=True)
class Lines:
    """What one chart shows.

    ``columns`` are among :data:`dockpose.app.processing.trajectory.COLUMNS`; ``factor`` converts their unit to that of
    the axis. With ``bounds`` None, the axis fits the numbers.
    """

    title: str
    columns: tuple[str, ...]
    names: tuple[str, ...]
    colours: tuple[str, ...]
    factor: float = 1.0
    bounds: Ends | None = None

    def values(self, table: np.ndarray) -> np.ndarray:
        """Return the lines' numbers (N, lines) in the axis's unit."""
        return self.factor * table[:, [COLUMNS.index(column) for column in self.columns]]


_SHARES = ("eccentricity", "probability")
CHARTS = (
    Lines("place (cm)", ("x_m", "y_m", "z_m"), ("x", "y", "z"), (ORANGE, GREEN, BLUE), factor=100.0),
    Lines("angle (°)", ("theta_x_deg", "theta_y_deg"), ("θx", "θy"), (ORANGE, BLUE)),
    Lines("0 to 1", _SHARES, _SHARES, (PURPLE, BLUE), bounds=(0.0, 1.05)),
)


def chart_data(table: np.ndarray, lines: Lines, bounds: Ends) -> tuple[np.ndarray, ...]:
    """Return times, the lines, and marks near the bottom for frames without the dock; NaN where there is nothing."""
    low, high = bounds
    lost = np.where(table[:, COLUMNS.index("lost")] > 0, low + 0.03 * (high - low), np.nan)
    return (table[:, 0], *lines.values(table).T, lost)


def fitting_bounds(table: np.ndarray, lines: Lines) -> Ends:
    """Return the ends of the vertical axis."""
    return lines.bounds or fitting_ends(lines.values(table), 1.0)


class TrajectoryCharts:
    """Draws a trajectory; hidden until there are two frames."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._charts = [(lines, _chart(gui, lines)) for lines in CHARTS]

    def show(self, trajectory: Trajectory) -> None:
        """Draw what was found so far."""
        table = trajectory.table(MOST_POINTS)
        if len(table) < 2:
            return
        times = float(table[0, 0]), round_above(float(table[-1, 0]))
        for lines, chart in self._charts:
            bounds = fitting_bounds(table, lines)
            chart.show(chart_data(table, lines, bounds), x=times, y=bounds)

    def hide(self) -> None:
        """Take the charts away."""
        for _, chart in self._charts:
            chart.hide()


def _chart(gui: viser.GuiApi, lines: Lines) -> Chart:
    curves = [Curve(*look) for look in zip(lines.names, lines.colours, _DASHES, strict=False)]
    curves.append(Curve("no dock", DROPPED_COLOUR, marks_px=5))
    return Chart(gui, "time (s)", curves, (axis(), axis(lines.title, 40, space=20)), _HEIGHT_PX)
