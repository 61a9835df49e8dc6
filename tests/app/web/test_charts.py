from types import SimpleNamespace
from typing import Any

import numpy as np
from dockpose.app.processing.comparison import LevelSweep
from dockpose.app.web.charts import Chart, SweepChart, error_points, sweep_sentence, sweep_top_px

from tests.support.rows import changed

FOUND = LevelSweep(np.array([100, 120]), np.array([[3.0, 1.0, 0.1], [3.0, 1.0, 0.1]]), "the true centre")
NOTHING = LevelSweep(np.array([100, 120, 255]), np.full((3, 3), np.nan), "the true centre")


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


def test_a_sweep_grows_and_one_that_found_nothing_is_drawn_without_gaps():
    chart = SweepChart(GUI)
    chart.grow(NOTHING)
    assert np.isfinite(chart._chart.handle.data).all()
    assert "Levels up to 255 of 255 are drawn. No level" in chart._sentence.content
    chart.show(FOUND)
    assert "true centre" in sweep_sentence(FOUND)
    assert ">A dock at 2 of 2 levels" in chart._sentence.content
    assert sweep_top_px(NOTHING) == 1
