import numpy as np
import pytest
from dockpose.paper.lights.proportions import paired_difference, wilson


def test_wilson_s_interval_by_hand():
    # Without a success its upper end is z^2 / (n + z^2) = 3.8415 / 13.8415.
    assert wilson(0, 10) == pytest.approx((0.0, 0.27753), abs=1e-5)
    assert wilson(10, 10) == pytest.approx((0.72247, 1.0), abs=1e-5)
    # Half of four: 0.5 -+ z / (1 + z^2 / 4) * sqrt(1/16 + z^2 / 64) = 0.5 -+ 0.35.
    assert wilson(2, 4) == pytest.approx((0.15004, 0.84996), abs=1e-4)


@pytest.mark.parametrize(("successes", "cases"), [(1, 0), (0, 0), (3, 2), (-1, 2)])
def test_no_share_without_cases(successes, cases):
    with pytest.raises(ValueError, match="successes is"):
        wilson(successes, cases)


def test_a_paired_difference_by_hand():
    # Of 100 cases 40 succeed by the first alone and 10 by the second alone; with half a case more in each cell
    # (40.5 - 10.5) / 102 -+ 1.96 sqrt(51 - 30^2 / 102) / 102.
    first = np.repeat([True, False, True, False], [40, 10, 30, 20])
    second = np.repeat([False, True, True, False], [40, 10, 30, 20])
    difference, low, high = paired_difference(first, second)
    assert difference == pytest.approx(0.30)
    assert (low, high) == pytest.approx((0.16933, 0.41891), abs=1e-4)
    assert paired_difference(second, first) == pytest.approx((-difference, -high, -low))


def test_methods_that_always_agree_differ_by_0_with_an_interval():
    difference, low, high = paired_difference(np.ones(20, bool), np.ones(20, bool))
    assert difference == 0
    assert low == -high < 0


def test_a_paired_difference_needs_the_same_cases():
    with pytest.raises(ValueError, match="first has 2 cases and second 3"):
        paired_difference(np.ones(2, bool), np.ones(3, bool))
