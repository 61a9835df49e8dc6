"""HATS, the histogram-based adaptive thresholding scheme (Ghosh et al. 2016, sections 2.1.1 and 2.1.2).

Light that reached the camera directly piles up in a peak at the bright end of the histogram, whatever the water;
lights seen at an angle pile up a little lower. So the local peaks, from bright to dark, are candidates, and they vote
on how many lights there are.
"""

from __future__ import annotations

import numpy as np

from pipeline.thresholds.groups import count_groups
from pipeline.thresholds.histogram import LEVELS, Histogram, Peak, Threshold

BACKGROUND_SPREADS = 4.0  # candidates end this many spreads above the background's mode
MOST_LIT = 0.1  # of the picture: lights and their glow never fill more, a bright background does
REAL_SHARE = 0.05  # of the levels above the background: a count that holds for fewer is noise's doing
_SMOOTHING = np.array([1, 4, 6, 4, 1]) / 16


def hats(histogram: Histogram, min_area_px: int) -> Threshold:
    """Choose the level that keeps the most lights apart, by a vote of the histogram's peaks.

    Parameters
    ----------
    histogram : of the picture.
    min_area_px : smaller groups do not count.

    Returns
    -------
    The threshold; its level is 256 (nothing kept) where nothing stands above the background.

    Notes
    -----
    The paper leaves open how votes weigh and where to stop. Here candidates end above the background, and a count of
    groups has as many votes as it holds for grey levels in a row, from the brightest candidate down: fragments and
    noise change the count from level to level, lights do not. The elected count is the largest with a real share
    of the votes, the level the brightest of its run.
    """
    floor = background_limit(histogram.counts) + 1
    peaks = _peak_levels(histogram.counts, floor)
    if not peaks:
        return _threshold(histogram, LEVELS, "Nothing stands out above the background.")
    groups = count_groups(histogram.levels, floor, peaks[0], min_area_px)
    runs = _longest_runs(groups)
    if not runs:
        reason = f"Nothing of at least {min_area_px} pixels stands out above the background."
        return _threshold(histogram, LEVELS, reason, groups)
    span = peaks[0] - floor + 1
    longest = max(length for _, length in runs.values())
    least = min(longest, REAL_SHARE * span)
    elected = max(count for count, (_, length) in runs.items() if length >= least)
    level, length = runs[elected]
    candidates = _candidates(peaks, floor, groups)
    noun = "group" if elected == 1 else "groups"
    reason = (
        f"{elected} {noun} at {length} levels in a row from {level} down, of the {span} above the background: "
        "the largest count with a real share."
    )
    return _threshold(histogram, level, reason, groups, candidates)


def background_limit(counts: np.ndarray) -> int:
    """Level at which the background ends: the mode of the histogram and four times its spread below the mode.

    The spread is measured on the dark side, where no light reaches: what lies above the mode may be glow. Where more
    than a tenth of the picture would be left above it, the background ends higher, at that tenth.
    """
    mode = int(counts.argmax())
    below = np.arange(mode + 1)
    weights = counts[: mode + 1]
    spread = float(np.sqrt((weights * (mode - below) ** 2).sum() / weights.sum()))
    above_mode = int(np.ceil(mode + BACKGROUND_SPREADS * max(spread, 1.0)))
    darkest_tenth = int(np.searchsorted(np.cumsum(counts), (1 - MOST_LIT) * counts.sum()))
    return min(LEVELS - 1, max(above_mode, darkest_tenth))


def _peak_levels(counts: np.ndarray, floor: int) -> list[int]:
    """Local peaks of the lightly smoothed histogram at or above ``floor``, bright to dark."""
    padded = np.concatenate([np.zeros(2), counts, np.zeros(2)])
    smooth = np.convolve(padded, _SMOOTHING, mode="valid")
    higher_than_next = np.append(smooth[:-1] > smooth[1:], smooth[-1] > 0)
    not_lower_than_last = np.insert(smooth[1:] >= smooth[:-1], 0, True)
    levels = np.flatnonzero(higher_than_next & not_lower_than_last)
    return [int(level) for level in levels[levels >= floor][::-1]]


def _longest_runs(groups: np.ndarray) -> dict[int, tuple[int, int]]:
    """Brightest level and length of the longest unbroken run of levels, for each count of groups above 0."""
    runs: dict[int, tuple[int, int]] = {}
    length = 0
    for level in range(LEVELS - 1, -1, -1):
        count = int(groups[level])
        same = level < LEVELS - 1 and count == groups[level + 1]
        length = length + 1 if same else 1
        if count > 0 and length > runs.get(count, (0, 0))[1]:
            runs[count] = (level + length - 1, length)
    return runs


def _candidates(peaks: list[int], floor: int, groups: np.ndarray) -> tuple[Peak, ...]:
    ends = [level + 1 for level in peaks[1:]] + [floor]
    found = []
    for level, down_to in zip(peaks, ends, strict=True):
        counts = np.bincount(groups[down_to : level + 1])
        found.append(Peak(level, down_to, int(counts.argmax()), int(counts.max())))
    return tuple(found)


def _threshold(
    histogram: Histogram,
    level: int,
    reason: str,
    groups: np.ndarray | None = None,
    peaks: tuple[Peak, ...] = (),
) -> Threshold:
    return Threshold(
        method="hats",
        level=level,
        native_level=level * histogram.native_step,
        histogram=histogram.counts,
        reason=reason,
        groups_at_level=np.full(LEVELS, -1) if groups is None else groups,
        peaks=peaks,
    )
