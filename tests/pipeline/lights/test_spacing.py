import numpy as np
import pytest
from dockpose.lights.spacing import are_even, phase_of


@pytest.mark.parametrize("sides", [1, 4, 7])
def test_the_phase_is_that_of_the_first_corner_and_errors_both_ways_leave_it(sides):
    angles = 0.1 + 2 * np.pi * np.arange(sides) / sides
    assert phase_of(angles, sides) == pytest.approx(0.1)
    both = np.concatenate([angles - 0.02, angles + 0.02])
    assert phase_of(both, sides) == pytest.approx(0.1)
    assert phase_of(angles + 2 * np.pi / sides, sides) == pytest.approx(0.1)  # of the next corner


def test_corners_of_which_some_are_missing_are_even_and_two_at_one_are_not():
    angles = 2 * np.pi * np.array([0, 1, 3, 4, 6]) / 7
    assert are_even(angles, 7)
    assert not are_even(angles, 6)
    assert not are_even(np.append(angles, 0.05), 7)
