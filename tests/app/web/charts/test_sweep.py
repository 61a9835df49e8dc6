import numpy as np
import pytest
from dockpose.app.processing.comparison import LevelSweep
from dockpose.app.web.charts.chart import without_gaps
from dockpose.app.web.charts.sweep import sweep_data, sweep_sentence, sweep_top_px, swept_so_far

FOUND = LevelSweep(np.array([100, 120]), np.array([[3.0, 1.0, 0.1], [3.0, 1.0, 0.1]]), "the true centre")
NOTHING = LevelSweep(np.array([100, 120, 255]), np.full((3, 3), np.nan), "the true centre")


def test_data_are_levels_and_three_errors_without_gaps():
    levels, *errors = sweep_data(NOTHING)
    assert len(errors) == 3
    assert np.isfinite([without_gaps(line, (0.0, sweep_top_px(NOTHING))) for line in errors]).all()
    assert len(levels) == 3


def test_sentences_of_a_sweep():
    assert "true centre" in sweep_sentence(FOUND)
    assert swept_so_far(FOUND).startswith("Levels up to 120 of 255 are drawn. A dock at 2 of 2 levels")
    assert sweep_top_px(NOTHING) == 1
    assert "No level" in sweep_sentence(NOTHING)


@pytest.mark.parametrize(("error_px", "top"), [(0.0, 1), (0.9, 1), (0.95, 2), (4, 5), (4.6, 10), (30, 50), (95, 200)])
def test_axis_of_a_sweep_ends_at_a_round_number(error_px, top):
    assert sweep_top_px(LevelSweep(np.array([9]), np.full((1, 3), error_px), "nothing")) == top
