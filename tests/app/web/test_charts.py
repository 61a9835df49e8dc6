from types import SimpleNamespace
from typing import Any

import numpy as np
from dockpose.app.web.charts import CHARTS, Chart, error_points

from tests.support.rows import changed


class _Gui:
    """Stands for viser's controls: what is added has the looks that it was given."""

    def __getattr__(self, name):
        return lambda *content, **look: SimpleNamespace(content=content, **look)


GUI: Any = _Gui()


def test_gaps_are_hidden_below_the_axis_and_a_single_point_is_drawn_twice():
    chart = Chart(GUI, "off by (cm)", CHARTS["off by (°)"])
    chart.show(np.array([[1.0, 0.5, np.nan], [2.0, -0.5, 0.25]]))
    low, high = chart._ends["y"]
    assert [one.tolist() for one in chart.handle.data] == [[1, 2], [0.5, -0.5], [low - (high - low), 0.25]]
    chart.show(np.array([[1.0, 0.5, np.nan]]))
    assert [len(one) for one in chart.handle.data] == [2, 2, 2]
    assert chart.handle.visible
    chart.show(np.zeros((0, 3)))
    assert not chart.handle.visible


def test_points_of_the_chart():
    rows = [
        changed(measured_z_cm=98.0, distance_cm=200.0),
        changed(measured_x_cm=0.0, distance_cm=100.0),
        changed(distance_cm=150.0),  # nothing to be off from
    ]
    place, angle = error_points(rows, (0, 1, 2)), error_points(rows, (3, 4))
    np.testing.assert_allclose(place, [[1, 1, np.nan, np.nan], [2, np.nan, np.nan, 2]])
    assert angle.shape == (0, 3)
    assert error_points([], (0, 1, 2)).shape == (0, 4)
