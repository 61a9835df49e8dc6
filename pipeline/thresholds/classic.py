"""Methods by the histogram: Otsu, Kapur, Kittler and Illingworth, Li, Yen, triangle, Sezan, and a fixed level."""

import functools
import math
from collections.abc import Callable
from itertools import pairwise

import numpy as np
from dockpose.pixels.flood import LEVELS
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at
from skimage import filters

_ONE_LEVEL = "The whole picture has one grey level, so there is nothing to tell apart."


def _split(reason: str) -> Callable[[Callable[[Histogram], int]], Callable[[Histogram], Threshold]]:
    """Make a method of a function that finds the level of a picture of several levels."""

    def method_of(level_of: Callable[[Histogram], int]) -> Callable[[Histogram], Threshold]:
        @functools.wraps(level_of)
        def method(histogram: Histogram) -> Threshold:
            if np.count_nonzero(histogram.counts) < 2:
                return threshold_at(level_of.__name__, histogram, LEVELS, _ONE_LEVEL)
            return threshold_at(level_of.__name__, histogram, level_of(histogram), reason)

        return method

    return method_of


@_split("It makes the variance between the two classes largest (Otsu 1979).")
def otsu(histogram: Histogram) -> int:
    """Maximise the variance between the two classes (Otsu 1979), by scikit-image.

    Parameters
    ----------
    histogram : Histogram
        Histogram of the grey picture.

    Returns
    -------
    Threshold
        The level and why.

    Examples
    --------
    >>> import numpy as np
    >>> from dockpose.thresholds import histogram_of
    >>> grey = np.full((8, 8), 20, np.uint8)
    >>> grey[3:5, 3:5] = 200
    >>> threshold = otsu(histogram_of(grey))
    >>> int((grey >= threshold.level).sum())
    4
    """
    return int(filters.threshold_otsu(hist=(histogram.counts, np.arange(LEVELS)))) + 1


@_split("The cross entropy of picture and classes is least (Li and Tam 1998).")
def li(histogram: Histogram) -> int:
    """Minimum cross entropy (Li and Tam 1998), by scikit-image."""
    return math.floor(filters.threshold_li(_pixels(histogram))) + 1


@_split("It makes Yen's correlation criterion largest (Yen 1995).")
def yen(histogram: Histogram) -> int:
    """Maximum correlation criterion (Yen, Chang and Chang 1995), by scikit-image."""
    return int(filters.threshold_yen(hist=(histogram.counts, np.arange(LEVELS)))) + 1


@_split("The histogram lies farthest below its chord (Zack 1977).")
def triangle(histogram: Histogram) -> int:
    """Level farthest from the line between the histogram's peak and its far end (Zack 1977), by scikit-image."""
    return math.floor(filters.threshold_triangle(_pixels(histogram))) + 1


def _pixels(histogram: Histogram) -> np.ndarray:
    """Levels of the pixels that count, sorted."""
    return np.repeat(np.arange(LEVELS, dtype=np.uint8), histogram.counts)


@_split("The two classes' entropies add up to the most (Kapur 1985).")
def kapur(histogram: Histogram) -> int:
    """Maximum entropy: argmax of H_background + H_foreground (Kapur, Sahoo and Wong 1985)."""
    share = histogram.counts / histogram.counts.sum()
    information = np.where(share > 0, share * np.log(np.where(share > 0, share, 1)), 0)
    below, below_information = np.cumsum(share)[:-1], np.cumsum(information)[:-1]
    above, above_information = 1 - below, information.sum() - below_information
    # The entropy of a class of share P is ln P - (sum p ln p) / P.
    usable = (below > 0) & (np.cumsum(histogram.counts[::-1])[::-1][1:] > 0)
    entropy = np.full(LEVELS - 1, -np.inf)
    b, a = below[usable], above[usable]
    entropy[usable] = np.log(b) - below_information[usable] / b + np.log(a) - above_information[usable] / a
    return int(entropy.argmax()) + 1


@_split("Two normal distributions overlap the least there (Kittler and Illingworth 1986).")
def kittler(histogram: Histogram) -> int:
    """Minimum error, by exhaustive search (Kittler and Illingworth 1986)."""
    criterion = kittler_criterion(histogram.counts)
    if not np.isfinite(criterion).any():
        # No split leaves two classes with a variance: take the middle between the outermost levels.
        present = np.flatnonzero(histogram.counts)
        return int(present[0] + present[-1]) // 2 + 1
    return int(np.argmin(criterion))


def kittler_criterion(counts: np.ndarray) -> np.ndarray:
    """1 + 2 (P1 ln s1 + P2 ln s2) - 2 (P1 ln P1 + P2 ln P2) for every first level; infinite where a class has none."""
    levels = np.arange(LEVELS)
    total = counts.sum()

    def moments(order: int) -> tuple[np.ndarray, np.ndarray]:
        sums = np.concatenate([[0], np.cumsum(counts * levels**order)])[:-1].astype(float)
        return sums, (counts * levels**order).sum() - sums

    (n1, n2), (s1, s2), (q1, q2) = moments(0), moments(1), moments(2)
    criterion = np.full(LEVELS, np.inf)
    filled = (n1 > 0) & (n2 > 0)
    n1, n2, s1, s2, q1, q2 = (value[filled] for value in (n1, n2, s1, s2, q1, q2))
    variance1, variance2 = q1 / n1 - (s1 / n1) ** 2, q2 / n2 - (s2 / n2) ** 2
    p1, p2 = n1 / total, n2 / total
    varies = (variance1 > 1e-9) & (variance2 > 1e-9)
    safe1, safe2 = np.where(varies, variance1, 1), np.where(varies, variance2, 1)
    value = 1 + p1 * np.log(safe1) + p2 * np.log(safe2) - 2 * (p1 * np.log(p1) + p2 * np.log(p2))
    criterion[filled] = np.where(varies, value, np.inf)
    return criterion


def sezan(histogram: Histogram) -> Threshold:
    """Put the level between the background's peak and the next one, as a growing window finds two (Sezan 1990)."""
    if np.count_nonzero(histogram.counts) < 2:
        return threshold_at("sezan", histogram, LEVELS, _ONE_LEVEL)
    cumulative = np.cumsum(histogram.counts) / histogram.counts.sum()
    peaks: list[tuple[int, int]] = []
    last = peaks
    for half in range(1, LEVELS):
        last = peaks
        peaks = find_peaks(cumulative, half)
        if len(peaks) <= 2:
            break
    crowded = peaks if len(peaks) > 2 else last
    if len(peaks) != 2 and len(crowded) > 2:
        # Growing the window removed more than one peak at once, or left more of levels that are spread evenly: keep the
        # two that hold the most pixels.
        below = np.insert(cumulative, 0, 0.0)  # of each level
        peaks = sorted(sorted(crowded, key=lambda peak: below[peak[0]] - below[peak[1] + 1])[:2])
    if len(peaks) < 2:
        level = peaks[0][1] + 1 if peaks else LEVELS
        return threshold_at("sezan", histogram, min(level, LEVELS), "One peak is left; the level is where it ends.")
    (_, end), (start, _) = peaks
    level = (end + start + 1) // 2 if start > end else start
    reason = f"It lies between the end of the background's peak ({end}) and the start of the next ({start})."
    return threshold_at("sezan", histogram, max(1, level), reason)


def find_peaks(cumulative: np.ndarray, half: int) -> list[tuple[int, int]]:
    """Start and end of each peak of a cumulative histogram (256,), with a window of ``2 half + 1`` levels."""
    window = 2 * half + 1
    padded = np.concatenate([np.zeros(half), cumulative, np.ones(half)])
    signal = cumulative - np.convolve(padded, np.full(window, 1 / window), mode="valid")
    sign = np.sign(np.where(np.abs(signal) < 1e-12, 0, signal)).astype(int)
    # A zero keeps the sign before it; before the first peak that is plus.
    for level in range(LEVELS):
        if sign[level] == 0:
            sign[level] = sign[level - 1] if level else 1
    starts = [level for level in range(LEVELS) if sign[level] < 0 and (level == 0 or sign[level - 1] > 0)]
    if sign[0] > 0 and cumulative[0] > 0:
        starts.insert(0, 0)
    return [(start, start + int(np.argmax(signal[start:until]))) for start, until in pairwise([*starts, LEVELS])]


def fixed(histogram: Histogram, level: int | None) -> Threshold:
    """Keep pixels at or above a given level.

    Parameters
    ----------
    histogram : Histogram
        Histogram of the grey picture.
    level : int or None
        Grey level, 0..255.

    Returns
    -------
    Threshold
        That level.

    Raises
    ------
    ValueError
        If the level is None.
    """
    if level is None:
        raise ValueError("level is None; the method 'fixed' needs one")
    return threshold_at("fixed", histogram, level, f"Level {level} was set by hand.")
