"""HATS, the histogram-based adaptive thresholding scheme (Ghosh et al. 2016, sections 2.1.1 and 2.1.2).

Light that reached the camera directly piles up in a peak at the bright end of the histogram, whatever the water;
lights seen at an angle pile up a little lower. So the local peaks, from bright to dark, are candidates, and they vote
on how many lights there are.
"""

from __future__ import annotations

import numpy as np

from pipeline.thresholds.bright import LEVELS
from pipeline.thresholds.histogram import Histogram, Peak, Threshold

# The background ends where fewer than this share of all pixels have a level; two in ten thousand are 60 of 640 x 480.
BACKGROUND_SHARE = 2e-4
# Lights never fill more of a picture than a tenth; what does is background. Where that is not settled by saturated
# lights, the brightest half per cent, or 8000 pixels, are more than enough to look at.
MOST_LIT, ENOUGH_LIT, ENOUGH_LIT_PX = 0.1, 0.005, 8000
# A count of groups is real if it holds over this share of the brightness above the background, and three levels.
REAL_SHARE, REAL_LEVELS = 0.2, 3
# Brightness so near the background's mode counts by its levels, above that by its ratios.
DIM_LEVELS = 10.0
# Noise begins where one level down there are so many times as many groups, and so many more.
NOISE_FACTOR, NOISE_MORE = 1.3, 2
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
    The paper leaves open how votes weigh and where to stop. Here candidates end above the background. A count of groups
    has as many votes as it holds for brightness in a row: the logarithm of how far its brightest level stands above
    the background's mode, over its darkest. Noise and fragments change the count from level to level, lights do not.
    The elected count is the largest with a real share of the votes; the level is the brightest of its run.
    """
    top = int(np.flatnonzero(histogram.counts)[-1])
    mode = int(histogram.counts.argmax())
    floor = background_limit(histogram.counts)
    if floor > top:
        return _threshold(histogram, LEVELS, floor, "Nothing stands out above the background.")
    groups = histogram.bright(floor).groups_at_every_level(min_area_px)
    floor = _above_noise(groups, floor, top)
    runs = _longest_runs(groups, floor, top)
    if not runs:
        reason = f"Nothing of at least {min_area_px} pixels stands out above the background."
        return _threshold(histogram, LEVELS, floor, reason, groups)
    elected = _elect(runs, floor, top, mode)
    level, length = runs[elected]
    reason = (
        f"{elected} group{'' if elected == 1 else 's'} at {length} level{'' if length == 1 else 's'} in a row from "
        f"{level} down, of the {top - floor + 1} above the background: the largest count with a real share."
    )
    peaks = _candidates(histogram.counts, groups, floor)
    return _threshold(histogram, level, floor, reason, groups, peaks)


def background_limit(counts: np.ndarray) -> int:
    """The first level above the background; 256 where everything is background.

    From the mode upwards the background ends where a level has too few pixels to be water. Where what is left would
    be too much to be lights, it ends higher.
    """
    smooth = np.convolve(counts, _SMOOTHING, mode="same")
    mode = int(counts.argmax())
    total = int(counts.sum())
    few = np.flatnonzero(smooth[mode:] <= BACKGROUND_SHARE * total)
    if len(few) == 0:
        return LEVELS
    left = counts[::-1].cumsum()[::-1]
    saturated = 1.5 * left[np.flatnonzero(counts)[-1]]
    too_much = left > min(MOST_LIT * total, max(ENOUGH_LIT * total, ENOUGH_LIT_PX, saturated))
    return max(mode + int(few[0]), int(np.count_nonzero(too_much)))


def _above_noise(groups: np.ndarray, floor: int, top: int) -> int:
    """Climb from the floor as long as the level above has far fewer groups: what dissolves so fast is noise."""
    while floor < top and groups[floor] > NOISE_FACTOR * groups[floor + 1] + NOISE_MORE:
        floor += 1
    return floor


def _longest_runs(groups: np.ndarray, floor: int, top: int) -> dict[int, tuple[int, int]]:
    """Brightest level and length of the longest unbroken run of levels, for each count of groups above 0."""
    span = groups[floor : top + 1][::-1]
    starts = np.flatnonzero(np.diff(span, prepend=-2))
    lengths = np.diff(np.append(starts, len(span)))
    runs: dict[int, tuple[int, int]] = {}
    for start, length in zip(starts.tolist(), lengths.tolist(), strict=True):
        count = int(span[start])
        if count > 0 and length > runs.get(count, (0, 0))[1]:
            runs[count] = (top - start, length)
    return runs


def _elect(runs: dict[int, tuple[int, int]], floor: int, top: int, mode: int) -> int:
    """The largest count with a real share of the votes; where none has, the one with the most."""

    def votes(level: int, length: int) -> float:
        return float(np.log((level - mode + DIM_LEVELS) / (level - length - mode + DIM_LEVELS)))

    counts = np.array(list(runs))
    weights = np.array([votes(*run) for run in runs.values()])
    lengths = np.array([length for _, length in runs.values()])
    share = min(float(weights.max()), REAL_SHARE * votes(top, top - floor + 1))
    real = (weights >= share) & (lengths >= min(REAL_LEVELS, int(lengths.max())))
    return int(counts[real].max()) if real.any() else int(counts[weights.argmax()])


def _candidates(counts: np.ndarray, groups: np.ndarray, floor: int) -> tuple[Peak, ...]:
    """Local peaks of the lightly smoothed histogram, bright to dark, and what each votes for."""
    padded = np.concatenate([np.zeros(2), counts, np.zeros(2)])
    smooth = np.convolve(padded, _SMOOTHING, mode="valid")
    higher_than_next = np.append(smooth[:-1] > smooth[1:], smooth[-1] > 0)
    not_lower_than_last = np.insert(smooth[1:] >= smooth[:-1], 0, True)
    levels = np.flatnonzero(higher_than_next & not_lower_than_last)
    peaks = levels[levels >= floor][::-1].tolist()
    ends = [peak + 1 for peak in peaks[1:]] + [floor]
    found = []
    for level, down_to in zip(peaks, ends, strict=False):
        holds = np.bincount(groups[down_to : level + 1])
        found.append(Peak(level, down_to, int(holds.argmax()), int(holds.max())))
    return tuple(found)


def _threshold(
    histogram: Histogram,
    level: int,
    floor: int,
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
        floor=floor,
        peaks=peaks,
    )
