"""HATS light by light: each peak that rises enough is a light, cut half way up (Ghosh et al. 2016, section 2.1.2)."""

import math

import cv2
import numpy as np
from dockpose.pixels.bright import SATURATED, BrightPixels, PixelGroups, SquareGroups, coarsen, pixels_at
from dockpose.pixels.flood import LEVELS
from dockpose.pixels.peaks import deepen, peaks_by_persistence
from dockpose.thresholds.hats import LIT_SHARES, MOST_PIXELS, background_limit, background_mode, lit_limit
from dockpose.thresholds.histogram import MOST_SHARE, Histogram, Threshold

RISE_SHARE = 0.25  # of a peak's height above the water: what it must rise above its saddle to count by itself
RISE_NOISE = 5.0  # standard deviations of the noise: the same
# Within what is saturated a pixel of depth counts as so many steps; a light must rise by so much, and such a share.
DEPTH_STEPS, RISE_DEPTH_PX, RISE_DEPTH_SHARE = 8, 1.0, 0.15
_HOLES_PX = 5  # the widest hole that noise makes
CLEAR_NOISE = 8.0  # of these as well: what is so far above the water is not water
_MOST_LIGHTS = 150  # as many as the search for a ring looks at
ENOUGH_PX = 310_000  # of the picture: 640 x 480
# The background is looked for in the picture shrunk to so many pixels, over so many of them: a fifth of its width.
_NEIGHBOURHOOD_PX, _SMALL_PX = 15, 80
_PEDESTAL = 16  # levels that keep the noise on both sides of the background above 0


def hats_local(histogram: Histogram, min_area_px: int) -> Threshold:
    """Find a level for each light.

    Parameters
    ----------
    histogram : Histogram
        Of the picture.
    min_area_px : int
        Smaller lights do not count.

    Returns
    -------
    Threshold
        It lists the pixels that it keeps; its level is that of its dimmest light, 256 where there is none.
    """
    whole = histogram.without_glare
    histogram, side = whole.in_squares(ENOUGH_PX)
    min_area_px = math.ceil(min_area_px / side**2)
    flat = Histogram(_flattened(histogram), histogram.native_step, histogram.counted)
    mode, noise = background_mode(flat.sketch), whole.noise
    # The dark side of the background is its own; what halos add is on the other.
    dark = flat.sketch[:mode].astype(float)
    squares = float(dark @ (mode - np.arange(mode)) ** 2)
    dark_side = math.sqrt(squares / max(dark.sum() + 0.5 * flat.sketch[mode], 1))
    clear = mode + math.ceil(CLEAR_NOISE * max(noise, dark_side))
    floor = min(background_limit(flat.sketch), max(lit_limit(flat.sketch, LIT_SHARES[-1]), clear))
    if floor >= LEVELS or (pixels := flat.bright(floor)).is_empty:
        return _nothing(whole, "Nothing stands out above the background.")
    value = continued(histogram.levels, pixels)
    peaks, saddles, ends, member_of = _peaks(value, pixels, mode, RISE_NOISE * noise)
    tops = np.minimum(peaks, LEVELS - 1)
    base = np.maximum(saddles, mode)
    # What is saturated is kept whole, wherever it parts.
    cut = np.where(saddles >= LEVELS, LEVELS - 1, np.maximum(saddles + 1, np.ceil((base + tops) / 2))).astype(int)
    stands_out = (ends >= 0) | (tops - mode >= RISE_NOISE * noise)
    kept = (value >= cut[member_of]) & stands_out[member_of]
    area = np.bincount(member_of[kept], minlength=len(peaks))
    lights = np.flatnonzero((area >= min_area_px) & (area <= MOST_SHARE * histogram.levels.size))
    height = tops - np.minimum(base, tops) + (peaks - tops)
    lights = np.sort(lights[np.argsort(-height[lights], kind="stable")][:_MOST_LIGHTS])
    if len(lights) == 0:
        return _nothing(whole, "No peak of the picture stands out of the noise.")
    number = np.full(len(peaks), -1)
    number[lights] = np.arange(len(lights))
    kept &= number[member_of] >= 0
    return _threshold(whole, histogram.levels, side, pixels.index[kept], number[member_of[kept]])


def _nothing(histogram: Histogram, reason: str) -> Threshold:
    return Threshold("hats_local", LEVELS, LEVELS * histogram.native_step, histogram.sketch, reason)


def _threshold(histogram: Histogram, levels: np.ndarray, side: int, index: np.ndarray, light: np.ndarray) -> Threshold:
    """Threshold of squares ``index``, each of that light; of these, pixels as bright as the dimmest square."""
    pixels = pixels_at(levels, index)
    dimmest = np.full(int(light.max()) + 1, LEVELS)
    np.minimum.at(dimmest, light, pixels.level)
    level = pixels.floor
    groups: PixelGroups | SquareGroups
    if side > 1:
        light_at = np.full(levels.shape, -1, np.int32)
        light_at.ravel()[index] = light
        groups = SquareGroups(histogram.levels, side, light_at, dimmest)
        if not histogram.is_lit(level):
            groups = PixelGroups(*groups.listed(), len(dimmest))
    else:
        groups = PixelGroups(pixels, light, len(dimmest))
    reason = f"{len(dimmest)} peaks, each cut half way up, at levels from {level} to {int(dimmest.max())}."
    return Threshold("hats_local", level, level * histogram.native_step, histogram.sketch, reason, groups=groups)


def _flattened(histogram: Histogram) -> np.ndarray:
    """The picture less its background, (H, W) uint8: the dark of a wide neighbourhood, and its changes."""
    levels = histogram.levels
    mode = np.uint8(background_mode(histogram.sketch))
    if histogram.counted is not None:
        levels = np.where(histogram.counted > 0, levels, mode)
    height, width = levels.shape
    shrink = max(height, width) / _SMALL_PX
    if min(height, width) / max(shrink, 1) < _NEIGHBOURHOOD_PX:
        return levels
    saturated = cv2.threshold(levels, SATURATED - 1, 255, cv2.THRESH_BINARY)[1] * np.uint8(mode < SATURATED)
    # What is saturated is light, however much of a neighbourhood it fills.
    water = np.where(saturated > 0, mode, levels)
    small = cv2.resize(water, None, fx=1 / shrink, fy=1 / shrink, interpolation=cv2.INTER_AREA)
    background = cv2.resize(cv2.medianBlur(small, _NEIGHBOURHOOD_PX), (width, height))
    # What is at the background's level stays above 0, so that noise on both sides of it is seen as such.
    flat = cv2.max(cv2.subtract(cv2.convertScaleAbs(levels, beta=_PEDESTAL), background), saturated)
    return flat if histogram.counted is None else np.where(histogram.counted > 0, flat, 0).astype(np.uint8)


def continued(levels: np.ndarray, pixels: BrightPixels) -> np.ndarray:
    """Levels (n,) of bright pixels, beyond 255 where the picture saturates: by their depth in what is saturated."""
    value = pixels.level.copy()
    saturated = np.flatnonzero(levels.ravel()[pixels.index] >= SATURATED)
    if len(saturated) == 0:
        return value
    width = pixels.width
    top = max(0, int(pixels.index[saturated[0]]) // width - _HOLES_PX)
    bottom = min(len(levels), int(pixels.index[saturated[-1]]) // width + 1 + _HOLES_PX)
    mask = cv2.threshold(levels[top:bottom], SATURATED - 1, 1, cv2.THRESH_BINARY)[1]
    # Noise makes holes in what just saturates.
    mask = cv2.max(mask, cv2.medianBlur(mask, _HOLES_PX))
    # Within 2 % of the true distance (Borgefors 1986), where lights that are parted differ by far more.
    depth = cv2.distanceTransform(mask, cv2.DIST_L2, cv2.DIST_MASK_5)
    first, last = np.searchsorted(pixels.index, [top * width, bottom * width])
    deepen(value[first:last], pixels.index[first:last] - top * width, depth.ravel(), DEPTH_STEPS)
    return value


def split_by_peaks(pixels: BrightPixels, histogram: Histogram) -> np.ndarray:
    """Number (n,) of the peak that each of some bright pixels belongs to."""
    rise = RISE_NOISE * histogram.noise
    return _peaks(continued(histogram.levels, pixels), pixels, background_mode(histogram.sketch), rise)[3]


def _peaks(
    value: np.ndarray, pixels: BrightPixels, mode: int, rise: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    index, width, square_of = pixels.index, pixels.width, None
    side = math.ceil(math.sqrt(len(pixels) / MOST_PIXELS))
    if side > 1:
        index, value, square_of, width = coarsen(index, value, width, side)
    *peaks, member_of = peaks_by_persistence(
        value,
        index,
        width,
        float(mode),
        LEVELS - 1,
        (float(rise), RISE_SHARE),
        (DEPTH_STEPS * RISE_DEPTH_PX, RISE_DEPTH_SHARE),
    )
    return *peaks, member_of if square_of is None else member_of[square_of]
