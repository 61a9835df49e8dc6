"""Sezan's peaks of the histogram."""

from itertools import pairwise

import numpy as np
from dockpose.pixels.flood import LEVELS
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at


def sezan(histogram: Histogram) -> Threshold:
    """Put the level between the background's peak and the next one, as a growing window finds two (Sezan 1990)."""
    if np.count_nonzero(histogram.counts) < 2:
        reason = "The whole picture has one grey level, so there is nothing to tell apart."
        return threshold_at("sezan", histogram, LEVELS, reason)
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
        peaks = sorted(sorted(crowded, key=lambda peak: -_share(cumulative, peak))[:2])
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


def _share(cumulative: np.ndarray, peak: tuple[int, int]) -> float:
    start, end = peak
    return float(cumulative[end] - (cumulative[start - 1] if start else 0))
