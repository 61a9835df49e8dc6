import numpy as np
import pytest
from dockpose.app.processing.trajectory import COLUMNS, Trajectory
from dockpose.app.web.charts.chart import without_gaps
from dockpose.app.web.charts.trajectory import CHARTS, Lines, chart_data, fitting_bounds

from tests.app.processing.test_trajectory import LOST, frame, seen


def test_chart_has_no_nan_and_hides_below_what_is_not_known():
    trajectory = Trajectory()
    trajectory.note(frame(0), seen(0.1))
    trajectory.note(frame(1), LOST)
    table = trajectory.table(10)
    bounds = fitting_bounds(table, CHARTS[0])
    times, x, _, _, lost = (without_gaps(line, bounds) for line in chart_data(table, CHARTS[0], bounds))
    assert times.tolist() == [0, 0.1]
    assert x[0] == pytest.approx(10)  # cm
    assert x[1] < bounds[0]
    assert lost[0] < bounds[0] <= lost[1] <= bounds[1]


@pytest.mark.parametrize(("low", "high"), [(0.0, 0.0), (-3.0, 4.0), (48.8, 400.0), (-0.4, 0.3)])
def test_bounds_hold_all_numbers(low, high):
    table = np.full((2, len(COLUMNS)), np.nan)
    table[:, COLUMNS.index("x_m")] = low, high
    bottom, top = fitting_bounds(table, Lines("x", ("x_m",), ("x",), ("#000",)))
    assert bottom < low <= high < top
    assert top - bottom < 30 * max(high - low, 1)


def test_bounds_of_nothing_are_an_axis():
    assert fitting_bounds(np.full((2, len(COLUMNS)), np.nan), CHARTS[1]) == (0.0, 1.0)
