import math

import numpy as np
import pytest
from dockpose.study.statistics import median, paired_difference, quantile, share_of, wilson


@pytest.mark.parametrize(
    ("hits", "count", "low", "high"),
    [
        # Newcombe 1998, "Two-sided confidence intervals for the single proportion", method 3.
        (81, 263, 0.2553, 0.3662),
        (15, 148, 0.0624, 0.1605),
        (0, 20, 0.0, 0.1611),
        (20, 20, 0.8389, 1.0),
        (1, 29, 0.0061, 0.1718),
    ],
)
def test_wilsons_interval_as_published(hits, count, low, high):
    share = wilson(hits, count)
    assert (share.value, share.low, share.high) == pytest.approx((hits / count, low, high), abs=5e-5)
    assert share == share_of(np.arange(2 * count) < hits, np.arange(2 * count) < count)


def pairs(both, one, other, neither):
    first = np.repeat([True, True, False, False], [both, one, other, neither])
    second = np.repeat([True, False, True, False], [both, one, other, neither])
    return paired_difference(first, second)


@pytest.mark.parametrize(
    ("counts", "value", "low", "high", "p_value"),
    [
        # Newcombe 1998, "Improved confidence intervals ... based on paired data", method 10; McNemar's by hand: where
        # n scenes differ, all for the first, 2 * (1/2)^n.
        ((36, 12, 2, 0), 0.20, 0.0569, 0.3404, 2 * (1 + 14 + 91) / 2**14),
        ((36, 14, 0, 0), 0.28, 0.1528, 0.4167, 2 / 2**14),
        ((18, 14, 0, 18), 0.28, 0.1441, 0.3963, 2 / 2**14),
    ],
)
def test_newcombes_interval_as_published_and_mcnemars_test(counts, value, low, high, p_value):
    difference = pairs(*counts)
    assert (difference.value, difference.low, difference.high) == pytest.approx((value, low, high), abs=5e-5)
    assert (difference.first_only, difference.second_only, difference.count) == (*counts[1:3], sum(counts))
    assert difference.p_value == pytest.approx(p_value)
    both, one, other, neither = counts
    turned = pairs(both, other, one, neither)
    assert (turned.low, turned.high) == pytest.approx((-difference.high, -difference.low))


def test_interval_of_a_median_is_of_order_statistics():
    # Of ten numbers the second and the ninth hold the median in 97.9 % of samples, the third and the eighth in 89 %.
    found = median(np.arange(1.0, 11.0))
    assert (found.value, found.low, found.high, found.count) == (5.5, 2.0, 9.0, 10)
    few = median(np.arange(5.0))
    assert (few.value, math.isnan(few.low)) == (2.0, True)
    rng = np.random.default_rng(0)
    found = [median(rng.exponential(size=25)) for _ in range(2000)]
    assert 0.95 <= np.mean([one.low <= np.log(2) <= one.high for one in found]) < 0.975


def test_of_nothing_nothing_is_known():
    assert pairs(10, 0, 0, 10).p_value == 1.0
    assert quantile(np.array([1.0, np.nan, 3.0]), 0.5) == 2.0
    nothing = np.array([np.nan])
    unknown = wilson(0, 0).value, wilson(0, 0).low, pairs(0, 0, 0, 0).value, median(nothing).value
    assert np.isnan([*unknown, quantile(nothing, 0.5)]).all()
