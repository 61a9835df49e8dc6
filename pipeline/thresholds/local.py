"""HATS light by light: a level for each light from its own part of the histogram (Ghosh et al. 2016, section 2.1.2).

Where the lights' brightness, or the water's, differs so much that no one level shows them all, each peak of the picture
that rises enough above the saddle to its brighter neighbour is a light of its own, cut half way up. The water's own
changes are taken out first.
"""

from __future__ import annotations

import cv2
import numpy as np
from dockpose.thresholds.bright import BrightPixels
from dockpose.thresholds.flood import LEVELS, peaks_by_persistence
from dockpose.thresholds.hats import background_limit, counts_with_exact_top
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at

RISE_SHARE = 0.25  # of a peak's height above the water: what it must rise above its saddle to count by itself
RISE_NOISE = 5.0  # standard deviations of the noise: the same
_MOST_LIGHTS = 150
# The background is the median over so many pixels of the picture shrunk to so many: a fifth of its width.
_NEIGHBOURHOOD_PX, _SMALL_PX = 15, 80
_PEDESTAL = 16


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
    flat = Histogram(_flattened(histogram), histogram.native_step, histogram.counted)
    floor = background_limit(flat.sketch)
    if floor >= LEVELS or (pixels := flat.bright(floor)).is_empty:
        return threshold_at("hats_local", histogram, LEVELS, "Nothing stands out above the background.")
    mode = int(flat.sketch.argmax())
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
    return _threshold(histogram, pixels.index[kept], number[member_of[kept]])


def _threshold(histogram: Histogram, index: np.ndarray, light: np.ndarray) -> Threshold:
    """Threshold that keeps the pixels ``index``, each of the light of that number, at the picture's own levels."""
    own = histogram.levels.ravel()[index].astype(np.int32)
    dimmest = np.full(int(light.max()) + 1, LEVELS)
    np.minimum.at(dimmest, light, own)
    level = int(dimmest.min())
    return Threshold(
        method="hats_local",
        level=level,
        native_level=level * histogram.native_step,
        histogram=counts_with_exact_top(histogram, LEVELS),
        reason=f"{len(dimmest)} peaks, each cut half way up, at levels from {level} to {int(dimmest.max())}.",
        kept=(BrightPixels(level, histogram.levels.shape[1], index, own), light),
    )


def _flattened(histogram: Histogram) -> np.ndarray:
    """The picture less its background, (H, W) uint8: what is brighter than the median of a wide neighbourhood."""
    levels = histogram.levels
    if histogram.counted is not None:
        levels = np.where(histogram.counted > 0, levels, np.uint8(histogram.sketch.argmax()))
    height, width = levels.shape
    shrink = max(height, width) / _SMALL_PX
    if min(height, width) / max(shrink, 1) < _NEIGHBOURHOOD_PX:
        return levels
    small = cv2.resize(levels, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    background = cv2.resize(cv2.medianBlur(small, _NEIGHBOURHOOD_PX), (width, height))
    # What is at the background's level stays above 0, so that noise on both sides of it is seen as such.
    lifted = np.minimum(levels, np.uint8(255 - _PEDESTAL)) + np.uint8(_PEDESTAL)
    flat = cv2.subtract(lifted, background)
    return flat if histogram.counted is None else np.where(histogram.counted > 0, flat, 0).astype(np.uint8)


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
    return peaks_by_persistence(pixels.level, *pixels.touching, mode, float(rise), RISE_SHARE)
