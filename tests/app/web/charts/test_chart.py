import numpy as np
import pytest
from dockpose.app.web.charts.chart import fitting_ends, round_above, without_gaps


@pytest.mark.parametrize("numbers", [[0.0], [1.0, 2.0], [-0.3, 4.0], [np.nan, 12.0, 1900.0]])
def test_axis_holds_all_numbers_with_room(numbers):
    low, high = fitting_ends(np.array(numbers), 0.1)
    assert low < np.nanmin(numbers) <= np.nanmax(numbers) < high
    assert high - low < 4 * max(np.nanmax(numbers) - np.nanmin(numbers), 0.1)


def test_axis_of_nothing():
    assert fitting_ends(np.array([np.nan]), 1.0) == (0.0, 1.0)


def test_gaps_are_hidden_below_the_axis():
    assert without_gaps(np.array([1.0, np.nan]), (-1.0, 3.0)).tolist() == [1.0, -5.0]


@pytest.mark.parametrize(("number", "above"), [(0, 1), (1, 1), (1.1, 2), (2, 2), (3, 5), (7, 10), (10, 10), (450, 500)])
def test_axis_ends_at_a_round_number(number, above):
    assert round_above(number) == above
