"""HATS light by light: a level for each light from its own part of the histogram (Ghosh et al. 2016, section 2.1.2).

Where the lights' brightness differs so much that no one level shows them all, each peak of the picture that rises
enough above the saddle to its brighter neighbour is a light of its own, cut half way up.
"""

from __future__ import annotations

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import minimum_spanning_tree

from pipeline.thresholds.bright import LEVELS, BrightPixels
from pipeline.thresholds.hats import background_limit
from pipeline.thresholds.histogram import Histogram, Threshold, threshold_at

RISE_SHARE = 0.25  # of a peak's height above the water: what it must rise above its saddle to count by itself
RISE_NOISE = 5.0  # standard deviations of the noise: the same
_MOST_LIGHTS = 150


def hats_local(histogram: Histogram, min_area_px: int) -> Threshold:
    """Find a level for each light.

    Parameters
    ----------
    histogram : of the picture.
    min_area_px : smaller lights do not count.

    Returns
    -------
    A threshold that lists the pixels it keeps; its level is that of its dimmest light, 256 where there is none.
    """
    floor = background_limit(histogram.counts)
    if floor >= LEVELS or (pixels := histogram.bright(floor)).is_empty:
        return threshold_at("hats_local", histogram, LEVELS, "Nothing stands out above the background.")
    mode = int(histogram.counts.argmax())
    rise = RISE_NOISE * noise_levels(histogram.levels)
    peaks, saddles, member_of = _peaks(pixels, mode, rise)
    base = np.maximum(saddles, mode)
    cut = np.maximum(saddles + 1, np.ceil((base + peaks) / 2)).astype(int)
    stands_out = peaks - base >= np.maximum(rise, RISE_SHARE * (peaks - mode))
    kept = (pixels.level >= cut[member_of]) & stands_out[member_of]
    area = np.bincount(member_of[kept], minlength=len(peaks))
    lights = np.flatnonzero(area >= min_area_px)
    lights = np.sort(lights[np.argsort(base[lights] - peaks[lights], kind="stable")][:_MOST_LIGHTS])
    if len(lights) == 0:
        return threshold_at("hats_local", histogram, LEVELS, "No peak of the picture stands out of the noise.")
    number = np.full(len(peaks), -1)
    number[lights] = np.arange(len(lights))
    kept &= number[member_of] >= 0
    level = int(cut[lights].min())
    chosen = BrightPixels(level, pixels.width, pixels.index[kept], pixels.level[kept])
    return Threshold(
        method="hats_local",
        level=level,
        native_level=level * histogram.native_step,
        histogram=histogram.counts,
        reason=f"{len(lights)} peaks, each cut half way up, at levels from {level} to {int(cut[lights].max())}.",
        floor=floor,
        kept=(chosen, number[member_of[kept]]),
    )


def noise_levels(levels: np.ndarray) -> float:
    """Standard deviation of the noise, from how neighbours differ along every few rows; at least a quarter level."""
    step = max(1, levels.shape[0] // 60)
    rows = levels[::step].astype(np.int16)
    difference = np.abs(np.diff(rows, axis=1))
    if difference.size == 0:
        return 0.25
    # Lights and edges are rare; the mean of what is left of a normal distribution's differences is 1.128 sigma.
    quiet = difference[difference <= np.quantile(difference, 0.98)]
    return max(0.25, float(quiet.mean()) / 1.128)


def split_by_peaks(pixels: BrightPixels) -> np.ndarray:
    """Number (n,) of the peak that each pixel of one group belongs to; all 0 where there is but one."""
    _, _, member_of = _peaks(pixels, pixels.floor - 1, 3.0)
    return member_of


def _peaks(pixels: BrightPixels, mode: int, rise: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Peaks of the picture, by persistence.

    Returns
    -------
    For each peak its level and the level of its highest saddle to another one (-1 where it stands alone), and for each
    pixel the number of its peak.

    Notes
    -----
    Pixels are joined along a maximum spanning forest, brightest edges first. Two parts that meet become one unless both
    rise enough above the place where they meet.
    """
    first, second = pixels.touching
    weight = LEVELS - np.minimum(pixels.level[first], pixels.level[second]).astype(float)
    forest = minimum_spanning_tree(csr_array((weight, (first, second)), shape=(len(pixels), len(pixels)))).tocoo()
    order = np.argsort(forest.data, kind="stable")
    parent = list(range(len(pixels)))
    peak = pixels.level.tolist()
    saddle = [-1] * len(pixels)

    def root(node: int) -> int:
        while parent[node] != node:
            parent[node] = parent[parent[node]]
            node = parent[node]
        return node

    edges = zip(forest.row[order].tolist(), forest.col[order].tolist(), forest.data[order].tolist(), strict=True)
    for one, other, lost in edges:
        level = LEVELS - int(lost)
        high, low = root(one), root(other)
        if peak[high] < peak[low]:
            high, low = low, high
        if peak[low] - level < max(rise, RISE_SHARE * (peak[low] - mode)):
            parent[low] = high
            saddle[high] = max(saddle[high], saddle[low])
        else:
            saddle[high], saddle[low] = max(saddle[high], level), max(saddle[low], level)
    roots = np.array([root(node) for node in range(len(pixels))])
    tops, member_of = np.unique(roots, return_inverse=True)
    return np.array(peak)[tops], np.array(saddle)[tops], member_of
