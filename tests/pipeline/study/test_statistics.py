import math

import numpy as np
import pytest
from dockpose.study.statistics import median, paired_difference, quantile, wilson


@pytest.mark.parametrize(
    ("hits", "count", "low", "high"),
    [
        # Newcombe 1998, "Two-sided confidence intervals for the single proportion", method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilsons_interval_as_published(hits, count, low, high):
    share = wilson(hits, count)
    assert share.value == hits / count
    assert (share.low, share.high) == pytest.approx((low, high), abs=5e-5)


def test_all_hits_mirror_no_hits_and_a_share_of_nothing_is_unknown():
    none, every, nothing = wilson(0, 20), wilson(20, 20), wilson(0, 0)
    assert (none.low, every.high) == (0.0, 1.0)
    assert every.low == pytest.approx(1 - none.high)
    assert math.isnan(nothing.value)
    assert math.isnan(nothing.low)


def pairs(both, one, other, neither):
    first = np.repeat([True, True, False, False], [both, one, other, neither])
    second = np.repeat([True, False, True, False], [both, one, other, neither])
    return paired_difference(first, second)


@pytest.mark.parametrize(
    ("counts", "value", "low", "high"),
    [
        # Newcombe 1998, "Improved confidence intervals ... based on paired data", method 10.
        ((36, 12, 2, 0), 0.20, 0.0569, 0.3404),
        ((36, 14, 0, 0), 0.28, 0.1528, 0.4167),
        ((18, 14, 0, 18), 0.28, 0.1441, 0.3963),
    ],
)
def test_newcombes_interval_as_published(counts, value, low, high):
    difference = pairs(*counts)
    assert difference.value == pytest.approx(value)
    assert (difference.low, difference.high) == pytest.approx((low, high), abs=5e-5)
    assert (difference.first_only, difference.second_only) == counts[1:3]


def test_exact_mcnemar_by_hand():
    # Five scenes differ, all for the first: 2 * (1/2)^5.
    assert pairs(10, 5, 0, 10).p_value == pytest.approx(2 / 32)
    assert pairs(10, 0, 0, 10).p_value == 1.0
    assert math.isnan(pairs(0, 0, 0, 0).value)


def test_the_other_way_round_changes_the_sign():
    one, other = pairs(20, 9, 4, 7), pairs(20, 4, 9, 7)
    assert (one.low, one.high) == pytest.approx((-other.high, -other.low))


def test_interval_of_a_median_is_of_order_statistics():
    # Of ten numbers the second and the ninth hold the median in 97.9 % of samples, the third and the eighth in 89 %.
    found = median(np.arange(1.0, 11.0))
    assert (found.value, found.low, found.high, found.count) == (5.5, 2.0, 9.0, 10)
    few = median(np.arange(5.0))
    assert few.value == 2.0
    assert math.isnan(few.low)
    assert math.isnan(median(np.array([np.nan])).value)


def test_the_interval_of_a_median_covers_it():
    rng = np.random.default_rng(0)
    found = [median(rng.exponential(size=25)) for _ in range(2000)]
    covered = np.mean([one.low <= np.log(2) <= one.high for one in found])
    assert 0.95 <= covered < 0.975


def test_quantile_leaves_out_what_is_unknown():
    assert quantile(np.array([1.0, np.nan, 3.0]), 0.5) == 2.0
    assert math.isnan(quantile(np.array([np.nan]), 0.5))
