"""HATS, the histogram-based adaptive thresholding scheme (Ghosh et al. 2016, sections 2.1.1 and 2.1.2).

Light that reached the camera directly piles up in a peak at the bright end of the histogram, whatever the water;
lights seen at an angle pile up a little lower. So the local peaks, from bright to dark, are candidates, and they vote
on how many lights there are.
"""

from __future__ import annotations

import math
from itertools import groupby

import numpy as np
from dockpose.thresholds.flood import LEVELS
from dockpose.thresholds.histogram import SMOOTHING, Histogram, Threshold

# The background ends where fewer than this share of all pixels have a level; two in ten thousand are 60 of 640 x 480.
BACKGROUND_SHARE = 2e-4
# Lights never fill more of a picture than a tenth; what does is background. Where that is not settled by saturated
# lights, the brightest two per cent, or 8000 pixels, are more than enough to look at.
MOST_LIT, ENOUGH_LIT, ENOUGH_LIT_PX = 0.1, 0.02, 8000
# A count of groups is real if it holds over this share of the brightness above the background, and three levels.
REAL_SHARE, REAL_LEVELS = 0.2, 3
# Brightness so near the background's mode counts by its levels, above that by its ratios.
DIM_LEVELS = 10.0
# Noise begins where one level down there are so many times as many groups, and so many more.
NOISE_FACTOR, NOISE_MORE = 1.3, 2


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
    counts = histogram.sketch
    mode = int(counts.argmax())
    floor = background_limit(counts)
    if floor >= LEVELS or (pixels := histogram.bright(floor)).is_empty:
        return _threshold(histogram, LEVELS, floor, "Nothing stands out above the background.")
    top = int(pixels.level.max())
    groups = pixels.groups_at_every_level(min_area_px)
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
    return _threshold(histogram, level, floor, reason, groups)


def background_limit(counts: np.ndarray) -> int:
    """The first level above the background; 256 where everything is background.

    From the mode upwards the background ends where a level has too few pixels to be water. Where what is left would
    be too much to be lights, it ends higher.
    """
    smooth = np.convolve(counts, SMOOTHING, mode="same")
    mode = int(counts.argmax())
    total = int(counts.sum())
    few = np.flatnonzero(smooth[mode:] <= BACKGROUND_SHARE * total)
    ends = mode + int(few[0]) if len(few) else LEVELS
    left = counts[::-1].cumsum()[::-1]
    saturated = 1.5 * left[np.flatnonzero(counts)[-1]]
    too_much = left > min(MOST_LIT * total, max(ENOUGH_LIT * total, ENOUGH_LIT_PX, saturated))
    return max(ends, int(np.count_nonzero(too_much)))


def _above_noise(groups: np.ndarray, floor: int, top: int) -> int:
    """Climb from the floor as long as the level above has far fewer groups: what dissolves so fast is noise."""
    while floor < top and groups[floor] > NOISE_FACTOR * groups[floor + 1] + NOISE_MORE:
        floor += 1
    return floor


def _longest_runs(groups: np.ndarray, floor: int, top: int) -> dict[int, tuple[int, int]]:
    """Brightest level and length of the longest unbroken run of levels, for each count of groups above 0."""
    runs: dict[int, tuple[int, int]] = {}
    brightest = top
    for count, levels in groupby(groups[floor : top + 1][::-1].tolist()):
        length = len(list(levels))
        if count > 0 and length > runs.get(count, (0, 0))[1]:
            runs[count] = (brightest, length)
        brightest -= length
    return runs


def _elect(runs: dict[int, tuple[int, int]], floor: int, top: int, mode: int) -> int:
    """The largest count with a real share of the votes; where none has, the one with the most."""

    def votes(level: int, length: int) -> float:
        return math.log((level - mode + DIM_LEVELS) / (level - length - mode + DIM_LEVELS))

    weights = {count: votes(*run) for count, run in runs.items()}
    share = min(max(weights.values()), REAL_SHARE * votes(top, top - floor + 1))
    least = min(REAL_LEVELS, max(length for _, length in runs.values()))
    real = [count for count, (_, length) in runs.items() if weights[count] >= share and length >= least]
    return max(real) if real else max(weights, key=lambda count: weights[count])


def _threshold(
    histogram: Histogram,
    level: int,
    floor: int,
    reason: str,
    groups: np.ndarray | None = None,
) -> Threshold:
    return Threshold(
        method="hats",
        level=level,
        native_level=level * histogram.native_step,
        histogram=counts_with_exact_top(histogram, floor),
        reason=reason,
        groups_at_level=np.full(LEVELS, -1) if groups is None else groups,
        floor=floor,
    )


def counts_with_exact_top(histogram: Histogram, floor: int) -> np.ndarray:
    """Pixels of each level (256,): the bright ones counted, those below ``floor`` as the sketch has them."""
    counts = histogram.sketch.copy()
    if floor < LEVELS:
        counts[floor:] = np.bincount(histogram.bright(floor).level, minlength=LEVELS)[floor:]
    return counts
