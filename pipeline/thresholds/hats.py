"""HATS, histogram-based adaptive thresholding (Ghosh et al. 2016, sections 2.1.1 and 2.1.2): levels vote on a count."""

import math
from dataclasses import dataclass, field
from itertools import groupby

import numpy as np
from dockpose.pixels.bright import SATURATED
from dockpose.pixels.flood import LEVELS
from dockpose.thresholds.histogram import MOST_SHARE, SMOOTHING, Histogram, Threshold

# The background ends where fewer than this share of all pixels have a level; two in ten thousand are 60 of 640 x 480.
BACKGROUND_SHARE = 2e-4
# Lights never fill more of a picture than a tenth; what does is background. Where that is not settled by saturated
# lights, the brightest two per cent, or 8000 pixels, are more than enough to look at.
MOST_LIT, ENOUGH_LIT, ENOUGH_LIT_PX = 0.1, 0.02, 8000
# Where halos or close lights fill the histogram the background so seen ends above the lights. Then these shares of the
# picture are looked at, or twice what is saturated.
LIT_SHARES, SATURATED_TIMES = (0.05, 0.4), 2.0
# There a light rises by so many standard deviations of the noise above where it meets a brighter one.
RISE_NOISE = 5.0
# Fewer groups than a ring has, or a count with less than this share of all votes, ask for another look.
FEWEST, SURE_SHARE = 4, 0.1
# More pixels than these are looked at in a smaller picture; as such another look begins in a small one, sooner.
MANY_PIXELS, MOST_PIXELS = 15_000, 6_000
ENOUGH_PX = 80_000  # of the picture, for another look
# With a larger share of bright pixels, all are counted sooner than those alone.
MANY_SHARE = 0.1
# A count of groups is real if it holds over this share of the brightness above the background, and three levels.
REAL_SHARE, REAL_LEVELS = 0.2, 3
# Brightness so near the background's mode counts by its levels, above that by its ratios.
DIM_LEVELS = 10.0
# Noise begins where one level down there are so many times as many groups, and so many more.
NOISE_FACTOR, NOISE_MORE = 1.3, 2


def hats(histogram: Histogram, min_area_px: int) -> Threshold:
    """Choose the level that keeps the most lights apart, by a vote of its levels.

    Parameters
    ----------
    histogram : Histogram
        Of the picture.
    min_area_px : int
        Smaller groups do not count.

    Returns
    -------
    Threshold
        Its level is 256, which keeps nothing, where nothing stands above the background.

    Notes
    -----
    The paper leaves open how votes weigh and where to stop. Here candidates end above the background. A count of groups
    has as many votes as it holds for brightness in a row: the logarithm of how far its brightest level stands above
    the background's mode, over its darkest. Noise and fragments change the count from level to level, lights do not.
    The elected count is the largest with a real share of the votes; the level is the brightest of its run, less noise.
    """
    whole, histogram = histogram, histogram.without_glare
    counts = histogram.sketch
    mode, floor = background_mode(counts), background_limit(counts)
    found = _vote(histogram, floor, mode, min_area_px, 0.0)
    if not found.is_sure:
        smaller, side = histogram.in_squares(ENOUGH_PX)
        least_px, rise = math.ceil(min_area_px / side**2), RISE_NOISE * histogram.noise
        for share in LIT_SHARES:
            lower = lit_limit(smaller.sketch, share)
            if found.is_sure or lower >= floor:
                continue
            floor = lower
            other = _vote(smaller, floor, background_mode(smaller.sketch), least_px, rise)
            found = max(found, other, key=lambda vote: (vote.is_sure, vote.share))
    if found.count > 0:
        reason = (
            f"{found.count} group{'' if found.count == 1 else 's'} at {found.length} "
            f"level{'' if found.length == 1 else 's'} in a row from {found.level} down, of the "
            f"{found.top - found.floor + 1} above the background: the largest count with a real share."
        )
    elif found.floor >= LEVELS:
        glare = "" if whole is histogram else " but saturated glare, too wide for a light"
        reason = f"Nothing stands out above the background{glare}."
    else:
        reason = f"Nothing of at least {min_area_px} pixels stands out above the background."
    return Threshold(
        method="hats",
        level=found.level,
        native_level=found.level * whole.native_step,
        histogram=counts_with_exact_top(whole, found.floor),
        reason=reason,
        groups_at_level=found.groups,
        floor=found.floor,
        leaves_glare=True,
    )


@dataclass(frozen=True)
class _Vote:
    """What the levels from ``floor`` to ``top`` elect, and its ``share`` in all votes down to the background."""

    floor: int
    top: int = LEVELS
    count: int = 0
    level: int = LEVELS
    length: int = 0
    share: float = 0.0
    groups: np.ndarray = field(default_factory=lambda: np.full(LEVELS, -1))

    @property
    def is_sure(self) -> bool:
        return self.count >= FEWEST and self.share >= SURE_SHARE


def _vote(histogram: Histogram, floor: int, mode: int, min_area_px: int, rise: float) -> _Vote:
    """Count groups from ``floor`` up, and elect a count; where ``rise`` is given, of those alone that rise so far."""
    if floor >= LEVELS:
        return _Vote(LEVELS)
    pixels, side = histogram.bright_squares(floor, MOST_PIXELS if rise else MANY_PIXELS)
    if pixels.is_empty:
        return _Vote(LEVELS)
    # Which of the saturated is brighter is noise.
    top = max(floor, min(int(pixels.level.max()), SATURATED))
    most_area_px = int(MOST_SHARE * histogram.levels.size / side**2)
    groups, real = pixels.count_groups(math.ceil(min_area_px / side**2), most_area_px, rise)
    if rise == 0:
        real, floor = groups, above_noise(groups, floor, top)
    runs = _longest_runs(real, floor, top)
    if not runs:
        return _Vote(floor, groups=groups)
    elected = _elect(runs, floor, top, mode)
    level, length = runs[elected]
    share = _votes(level, length, mode) / _votes(top, top - mode + 1, mode)
    # Lights come to pieces by noise so near the level at which they become one.
    down = max(0, min(math.floor(RISE_NOISE * histogram.noise) - 1, (length - 1) // 2))
    level, length = level - down, length - down
    return _Vote(floor, top, elected, level, length, share, groups)


def _votes(level: int, length: int, mode: int) -> float:
    """How much brightness a run of levels holds, from its brightest level down."""
    return math.log((level - mode + DIM_LEVELS) / (level - length - mode + DIM_LEVELS))


def background_mode(counts: np.ndarray) -> int:
    """The level that most of the background has: of the darkest part of the picture, as large as lights leave it."""
    so_far = counts.cumsum()
    ends = int(np.searchsorted(so_far, (1 - LIT_SHARES[-1]) * so_far[-1]))
    return int(counts[: ends + 1].argmax())


def background_limit(counts: np.ndarray) -> int:
    """The first level above the background; 256 where everything is background."""
    total = int(counts.sum())
    if total == 0:
        return LEVELS
    mode = background_mode(counts)
    smooth = np.convolve(counts, SMOOTHING, "same")
    beyond = np.flatnonzero(smooth[mode:] <= BACKGROUND_SHARE * total)
    ends = mode + int(beyond[0]) if len(beyond) else LEVELS
    saturated = 1.5 * int(counts[np.flatnonzero(counts)[-1]])
    most = min(MOST_LIT * total, max(ENOUGH_LIT * total, ENOUGH_LIT_PX, saturated))
    lit = np.searchsorted(counts[::-1].cumsum(), most, side="right")  # levels, from the brightest down
    return max(ends, LEVELS - int(lit))


def lit_limit(counts: np.ndarray, share: float) -> int:
    """The level from which up this share of a picture is lit, or twice what is saturated; it is above the mode."""
    left = counts[::-1].cumsum()[::-1]
    saturated = left[SATURATED]
    enough = np.flatnonzero(left <= max(share * left[0], SATURATED_TIMES * saturated))
    return max(background_mode(counts) + 1, int(enough[0]) if len(enough) else LEVELS)


def above_noise(groups: np.ndarray, floor: int, top: int) -> int:
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
    weights = {count: _votes(*run, mode) for count, run in runs.items()}
    share = min(max(weights.values()), REAL_SHARE * _votes(top, top - floor + 1, mode))
    least = min(REAL_LEVELS, max(length for _, length in runs.values()))
    real = [count for count, (_, length) in runs.items() if weights[count] >= share and length >= least]
    return max(real) if real else max(weights, key=lambda count: weights[count])


def counts_with_exact_top(histogram: Histogram, floor: int) -> np.ndarray:
    """Pixels of each level (256,): the bright ones counted, those below ``floor`` as the sketch has them."""
    counts = histogram.sketch
    if floor >= LEVELS:
        return counts
    if counts[floor:].sum() > MANY_SHARE * histogram.levels.size or histogram.is_lit(floor):
        return histogram.counts
    return np.append(counts[:floor], np.bincount(histogram.bright(floor).level, minlength=LEVELS)[floor:])
