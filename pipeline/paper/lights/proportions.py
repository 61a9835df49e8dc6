"""Confidence intervals of shares, and of the difference of two shares of the same cases."""

from __future__ import annotations

import math

import numpy as np

Z_95 = 1.959963984540054  # of the normal distribution, for intervals of 95 %


def wilson(successes: int, cases: int) -> tuple[float, float]:
    """Return the score interval of a share, of 95 % (Wilson 1927).

    Parameters
    ----------
    successes, cases : int
        How many of how many.

    Returns
    -------
    tuple of 2 float
        Its ends, within 0 to 1.

    Raises
    ------
    ValueError
        If there are no cases, or fewer than there are successes.

    Examples
    --------
    >>> low, high = wilson(81, 263)
    >>> round(low, 4), round(high, 4)
    (0.2553, 0.3662)
    """
    if not 0 <= successes <= cases or cases == 0:
        raise ValueError(f"successes is {successes} of {cases} cases")
    share, square = successes / cases, Z_95**2
    middle = (share + square / (2 * cases)) / (1 + square / cases)
    half = Z_95 / (1 + square / cases) * math.sqrt(share * (1 - share) / cases + square / (4 * cases**2))
    return max(0.0, middle - half), min(1.0, middle + half)


def paired_difference(first: np.ndarray, second: np.ndarray) -> tuple[float, float, float]:
    """Return the difference of two shares of the same cases, and its interval of 95 %.

    Parameters
    ----------
    first, second : (N,) bool array
        Whether each case was a success, by the one method and by the other.

    Returns
    -------
    tuple of 3 float
        The share of the first less that of the second, and the interval's ends.

    Notes
    -----
    Agresti and Min 2005, "Simple improved confidence intervals for comparing matched proportions": Wald's interval
    after half a case was added to each of the four combinations.
    """
    if len(first) != len(second) or len(first) == 0:
        raise ValueError(f"first has {len(first)} cases and second {len(second)}; they must be the same, and some")
    only_first, only_second = float((first & ~second).sum()), float((second & ~first).sum())
    cases, one, two = len(first) + 2, only_first + 0.5, only_second + 0.5
    middle = (one - two) / cases
    half = Z_95 * math.sqrt(one + two - (one - two) ** 2 / cases) / cases
    return (only_first - only_second) / len(first), max(-1.0, middle - half), min(1.0, middle + half)
