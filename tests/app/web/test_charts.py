from types import SimpleNamespace
from typing import Any

import numpy as np
from dockpose.app.web.charts import Chart, error_points

from tests.support.rows import changed


class _Gui:
    """Stands for viser's controls: what is added has the looks that it was given."""

    def __getattr__(self, name):
        return lambda *content, **look: SimpleNamespace(content=content, **look)


GUI: Any = _Gui()


def test_gaps_are_hidden_below_the_axis():
    chart = Chart(GUI, "x", [], (), 100)
    chart.show((np.array([0.0, 1.0]), np.array([1.0, np.nan])), x=(0.0, 1.0), y=(-1.0, 3.0))
    assert chart.handle.data[1].tolist() == [1.0, -5.0]


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
