"""Shares, differences of paired shares and medians, each with a 95 % confidence interval."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.stats import binom, binomtest

_Z95 = 1.959963984540054  # the normal distribution's 97.5 % quantile


@dataclass(frozen=True)
class Share:
    """A share of a number of cases, or the median of numbers, with its 95 % interval; NaN of no cases."""

    value: float
    low: float
    high: float
    count: int  # of the cases
    hits: int | None = None  # of these; None for a median


@dataclass(frozen=True)
class Difference:
    """How much oftener one method succeeds than another on the same scenes, with its 95 % interval; NaN of none."""

    value: float
    low: float
    high: float
    first_only: int  # scenes on which only the one succeeds
    second_only: int
    count: int  # all scenes
    p_value: float  # of McNemar's exact test that neither is better


def wilson(hits: int, count: int) -> Share:
    """Share of hits with Wilson's score interval (1927)."""
    if count == 0:
        return Share(math.nan, math.nan, math.nan, 0, 0)
    share, square = hits / count, _Z95**2
    middle = (share + square / (2 * count)) / (1 + square / count)
    half = _Z95 * math.sqrt(share * (1 - share) / count + square / (4 * count**2)) / (1 + square / count)
    # At no and at all hits the limit is exactly 0 and 1, which rounding misses.
    return Share(share, 0.0 if hits == 0 else middle - half, 1.0 if hits == count else middle + half, count, hits)


def share_of(came: np.ndarray, among: np.ndarray | None = None) -> Share:
    """In which share of the cases (N,), or of some among them, something came true."""
    among = np.ones_like(came) if among is None else among
    return wilson(int((came & among).sum()), int(among.sum()))


def paired_difference(first: np.ndarray, second: np.ndarray) -> Difference:
    """Difference of two methods' shares of success on the same scenes, ``first`` and ``second`` (N,) of bool."""
    # The interval is the tenth of Newcombe 1998, Statistics in Medicine 17; the test McNemar's, 1947, Psychometrika 12.
    one, other, count = int((first & ~second).sum()), int((~first & second).sum()), len(first)
    if count == 0:
        return Difference(math.nan, math.nan, math.nan, 0, 0, 0, math.nan)
    p1, p2, phi = share_of(first), share_of(second), _correlation(first, second)
    below1, above1, below2, above2 = p1.value - p1.low, p1.high - p1.value, p2.value - p2.low, p2.high - p2.value
    value = p1.value - p2.value
    low = value - math.sqrt(max(0.0, below1**2 - 2 * phi * below1 * above2 + above2**2))
    high = value + math.sqrt(max(0.0, above1**2 - 2 * phi * above1 * below2 + below2**2))
    p_value = float(binomtest(one, one + other).pvalue) if one + other else 1.0
    return Difference(value, low, high, one, other, count, p_value)


def _correlation(first: np.ndarray, second: np.ndarray) -> float:
    """Correlation of two paired binary results, with Newcombe's correction for continuity."""
    hits, others, count = int(first.sum()), int(second.sum()), len(first)
    margins = hits * (count - hits) * others * (count - others)
    product = int((first & second).sum()) * count - hits * others  # both * neither - one * other
    corrected = product - count / 2 if product > count / 2 else min(product, 0)
    return corrected / math.sqrt(margins) if margins else 0.0


def median(values: np.ndarray) -> Share:
    """Median of numbers, with the interval of order statistics that holds it in 95 % or more; NaN of fewer than six."""
    ordered = np.sort(values[np.isfinite(values)])
    count = len(ordered)
    if count == 0:
        return Share(math.nan, math.nan, math.nan, 0)
    rank = int(binom.ppf(0.025, count, 0.5))  # of the smallest and the largest that bound the median
    low, high = (ordered[rank - 1], ordered[count - rank]) if rank >= 1 else (math.nan, math.nan)
    return Share(float(np.median(ordered)), float(low), float(high), count)


def quantile(values: np.ndarray, share: float) -> float:
    """Quantile of those numbers that are finite; NaN of none."""
    finite = values[np.isfinite(values)]
    return float(np.quantile(finite, share)) if len(finite) else math.nan
