"""Lights by their size: peaks of the picture at one scale after another, in units of the noise there."""

import math
from collections.abc import Iterator

import cv2
import numpy as np
from dockpose.pixels.bright import BrightPixels, PixelGroups
from dockpose.thresholds.histogram import Histogram, Threshold

_MOST_PX = 2_100_000  # of the picture, for time: of a larger one the finest scales are left out
# Standard deviations of the finest blur, and by how much each next is wider: a lamp is within half a step of one.
FINEST_PX, _STEP = 0.8, 2.0
_WIDEST_SHARE = 1 / 24  # of the picture's shorter side: three lights of such a width beside each other fill it
_SURROUND = 1.6  # width of what is taken off, relative to the blur (Marr and Hildreth 1980: near a Laplacian)
# A peak of so many standard deviations of the noise is less than one in a picture of a million pixels.
_CLEAR_NOISE = 6.0
_QUANTISED = 0.29  # standard deviation of the rounding to whole levels, which noise can hide no less than
_MOST_LIGHTS = 60  # of one scale: the clearest
_HALF = 0.5  # of a peak, above which its pixels are its own
_REACH = 3.0  # of the blur, within which they lie


def at_scales(histogram: Histogram, min_area_px: int) -> Iterator[Threshold]:
    """Find the lights of each size, from small to large; scales without any are passed over."""
    grey, shrink, sigma_px = histogram.levels, 1, FINEST_PX
    if histogram.counted is not None:
        counted = histogram.counted > 0
        grey = np.where(counted, grey, np.uint8(np.median(grey[counted])))
    while grey.size > _MOST_PX:
        grey, shrink = _halved(grey), 2 * shrink
    levels = grey.astype(np.float32)
    widest_px = _WIDEST_SHARE * min(histogram.levels.shape)
    while sigma_px == FINEST_PX or sigma_px * shrink <= widest_px:
        blurred = cv2.GaussianBlur(levels, (0, 0), sigma_px)
        response = blurred - cv2.GaussianBlur(levels, (0, 0), _SURROUND * sigma_px)
        places = _peaks(blurred, response, sigma_px)
        found = _groups(histogram, response, places, sigma_px, shrink, min_area_px) if len(places) else None
        if found is not None:
            yield found
        if sigma_px > FINEST_PX:  # fine enough for half the pixels
            levels, shrink, sigma_px = _halved(levels), 2 * shrink, sigma_px / 2
        sigma_px *= _STEP


def _halved(levels: np.ndarray) -> np.ndarray:
    """A picture of half as many columns and rows, each pixel the mean of four."""
    height, width = levels.shape
    return cv2.resize(levels[: height // 2 * 2, : width // 2 * 2], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)


def _groups(
    histogram: Histogram, response: np.ndarray, places: np.ndarray, sigma_px: float, shrink: int, min_area_px: int
) -> Threshold | None:
    """Threshold by peaks (N, 2) of one scale's response (h, w) and the pixels around each; None of none."""
    height, width = histogram.levels.shape
    index, light = [], []
    reach = math.ceil(_REACH * sigma_px)
    for number, (y, x) in enumerate(places.tolist()):
        top, left = max(0, y - reach), max(0, x - reach)
        window = response[top : y + reach + 1, left : x + reach + 1]
        mask = (window >= _HALF * response[y, x]).astype(np.uint8)
        _, labels = cv2.connectedComponents(mask, connectivity=8)
        rows, columns = np.nonzero(labels == labels[y - top, x - left])
        rows, columns = rows + top, columns + left
        if shrink > 1:
            off = np.arange(shrink)
            rows = (rows[:, None, None] * shrink + off[:, None] + 0 * off).ravel()
            columns = (columns[:, None, None] * shrink + off + 0 * off[:, None]).ravel()
            inside = (rows < height) & (columns < width)
            rows, columns = rows[inside], columns[inside]
        index.append(rows * width + columns)
        light.append(np.full(len(rows), number))
    # A pixel that two lights reach belongs to the clearer.
    all_index, first = np.unique(np.concatenate(index), return_index=True)
    group_of = np.concatenate(light)[first]
    areas = np.bincount(group_of, minlength=len(places))
    kept = areas[group_of] >= min_area_px
    all_index, group_of = all_index[kept], group_of[kept]
    if len(all_index) == 0:
        return None
    _, group_of = np.unique(group_of, return_inverse=True)
    count = int(group_of.max()) + 1
    own = histogram.levels.ravel()[all_index].astype(np.int32)
    level = int(own.min())
    pixels = BrightPixels(level, width, all_index.astype(np.int32), own)
    scale_px = sigma_px * shrink
    reason = f"{count} peaks {2 * scale_px:.3g} pixels wide stand out of the noise."
    return Threshold(
        "hats_local",
        level,
        level * histogram.native_step,
        histogram.counts,
        reason,
        groups=PixelGroups(pixels, group_of.astype(np.int64), count),
    )


def _peaks(blurred: np.ndarray, response: np.ndarray, sigma_px: float) -> np.ndarray:
    """Rows and columns (N, 2) of the clearest peaks of a response; its noise is that of its median absolute value."""
    step = max(1, round(math.sqrt(response.size / 80_000)))
    spread = float(np.median(np.abs(response[::step, ::step]))) / 0.6745
    # What rounding leaves of a blurred difference of blurs, at least.
    noise = max(spread, _QUANTISED * 0.3 / sigma_px)
    size = 2 * math.ceil(sigma_px) + 1
    near = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    # Along an edge, as the rim of a larger light, the response has peaks where the picture has none.
    tops = cv2.dilate((blurred >= cv2.dilate(blurred, np.ones((3, 3)))).astype(np.uint8), near) > 0
    rows, columns = np.nonzero((response >= cv2.dilate(response, near)) & (response > _CLEAR_NOISE * noise) & tops)
    order = np.argsort(-response[rows, columns], kind="stable")[:_MOST_LIGHTS]
    return np.column_stack([rows[order], columns[order]])
