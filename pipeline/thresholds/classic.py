"""Methods that split the histogram into two classes: Otsu, Kapur, Kittler and Illingworth, Li, Yen, triangle."""

import math

import numpy as np
from dockpose.pixels.flood import LEVELS
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at
from skimage import filters

_ONE_LEVEL = "The whole picture has one grey level, so there is nothing to tell apart."


def otsu(histogram: Histogram) -> Threshold:
    """Maximise the variance between the two classes, by scikit-image.

    Parameters
    ----------
    histogram : Histogram
        Histogram of the grey picture.

    Returns
    -------
    Threshold
        The level and why.

    References
    ----------
    Otsu 1979, "A threshold selection method from gray-level histograms".

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
    return _split("otsu", histogram, _otsu_level, "It makes the variance between the two classes largest (Otsu 1979).")


def kapur(histogram: Histogram) -> Threshold:
    """Maximum entropy: argmax of H_background + H_foreground (Kapur, Sahoo and Wong 1985)."""
    return _split("kapur", histogram, _kapur_level, "The two classes' entropies add up to the most (Kapur 1985).")


def kittler(histogram: Histogram) -> Threshold:
    """Minimum error, by exhaustive search (Kittler and Illingworth 1986)."""
    reason = "Two normal distributions overlap the least there (Kittler and Illingworth 1986)."
    return _split("kittler", histogram, _kittler_level, reason)


def li(histogram: Histogram) -> Threshold:
    """Minimum cross entropy (Li and Tam 1998), by scikit-image."""
    return _split("li", histogram, _li_level, "The cross entropy of picture and classes is least (Li and Tam 1998).")


def yen(histogram: Histogram) -> Threshold:
    """Maximum correlation criterion (Yen, Chang and Chang 1995), by scikit-image."""
    return _split("yen", histogram, _yen_level, "It makes Yen's correlation criterion largest (Yen 1995).")


def triangle(histogram: Histogram) -> Threshold:
    """Level farthest from the line between the histogram's peak and its far end (Zack 1977), by scikit-image."""
    return _split("triangle", histogram, _triangle_level, "The histogram lies farthest below its chord (Zack 1977).")


def _split(method: str, histogram: Histogram, find, reason: str) -> Threshold:
    if np.count_nonzero(histogram.counts) < 2:
        return threshold_at(method, histogram, LEVELS, _ONE_LEVEL)
    return threshold_at(method, histogram, find(histogram), reason)


def _with_centres(histogram: Histogram) -> tuple[np.ndarray, np.ndarray]:
    return histogram.counts, np.arange(LEVELS)


def _pixels(histogram: Histogram) -> np.ndarray:
    """Levels of the pixels that count, sorted."""
    return np.repeat(np.arange(LEVELS, dtype=np.uint8), histogram.counts)


def _otsu_level(histogram: Histogram) -> int:
    return int(filters.threshold_otsu(hist=_with_centres(histogram))) + 1


def _yen_level(histogram: Histogram) -> int:
    return int(filters.threshold_yen(hist=_with_centres(histogram))) + 1


def _li_level(histogram: Histogram) -> int:
    return math.floor(filters.threshold_li(_pixels(histogram))) + 1


def _triangle_level(histogram: Histogram) -> int:
    return math.floor(filters.threshold_triangle(_pixels(histogram))) + 1


def _kapur_level(histogram: Histogram) -> int:
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


def _kittler_level(histogram: Histogram) -> int:
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
