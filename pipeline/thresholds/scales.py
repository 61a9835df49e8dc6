"""Lights by their size: peaks of the picture at one scale after another, in units of the noise there."""

import itertools
import math
from collections.abc import Iterator

import cv2
import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.pixels.bright import PixelGroups, pixels_at
from dockpose.pixels.flood import joined
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at

_MOST_PX = 2_100_000  # of the picture, for time: of a larger one the finest scales are left out
# Standard deviations of the blur, each twice the one before, so that a lamp is within half a step of one. From scale to
# scale the picture is halved; from the third on its pixels stay finer than for the first two, which take the most time.
FINEST_PX, _FINE_PX, _FINER_FROM = 0.8, 1.6, 2
_WIDEST_SHARE = 1 / 24  # of the picture's shorter side: three lights of such a width beside each other fill it
_SURROUND = 1.6  # width of what is taken off, relative to the blur (Marr and Hildreth 1980: near a Laplacian)
# A peak of so many standard deviations of the noise is less than one in a picture of a million pixels; of so many only,
# a few hundred are, and a light is what forms a ring with others.
_CLEAR_NOISE, _FAINT_NOISE = 6.0, 3.5
_QUANTISED = 0.29  # standard deviation of the rounding to whole levels, which noise can hide no less than
_STEPS = 64  # of a level, as 16-bit integers, which are blurred in two thirds of the time
_MOST_OBLONG = 10.0  # larger to smaller curvature of a peak, as of Lowe's key points
_MOST_LIGHTS = 60  # of one scale: the clearest
_HALF = 0.5  # of a peak, above which its pixels are its own
_REACH = 3.0  # of the blur, within which they lie


def at_scales(histogram: Histogram, min_area_px: int, *, faint: bool = False) -> Iterator[Threshold]:
    """Find the lights of each size, from small to large, or with faint ones; scales without any are passed over."""
    grey, shrink = grey_of(histogram)
    if grey.min() == grey.max():  # as behind a lens cap
        return
    steps, widest_px = np.multiply(grey, _STEPS, dtype=np.int16), _WIDEST_SHARE * min(histogram.levels.shape)
    for number in itertools.count():
        sigma_px = FINEST_PX if number < _FINER_FROM else _FINE_PX
        is_halved = number not in (0, _FINER_FROM)
        shrink *= 2 if is_halved else 1
        if number > 0 and sigma_px * shrink > widest_px:
            return
        steps = halved(steps) if is_halved else steps
        blurred = cv2.GaussianBlur(steps, (0, 0), sigma_px)
        response = cv2.GaussianBlur(steps, (0, 0), _SURROUND * sigma_px)
        np.subtract(blurred, response, out=response)
        places = _peaks(blurred, response, sigma_px, shrink, faint)
        found = _groups(histogram, response, places, sigma_px, shrink, min_area_px) if len(places) else None
        if found is not None:
            yield found


def grey_of(histogram: Histogram) -> tuple[np.ndarray, int]:
    """The picture (h, w), of its median level where it is masked, and how many times smaller than it is."""
    grey, shrink = histogram.levels, 1
    if histogram.counted is not None:
        counted = histogram.counted > 0
        grey = np.where(counted, grey, np.uint8(np.median(grey[counted]) if counted.any() else 0))
    while grey.size > _MOST_PX:
        grey, shrink = halved(grey), 2 * shrink
    return grey, shrink


def halved(levels: np.ndarray) -> np.ndarray:
    """A picture of half as many columns and rows, each pixel the mean of four."""
    height, width = levels.shape
    return cv2.resize(levels[: height // 2 * 2, : width // 2 * 2], None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)


def _groups(
    histogram: Histogram, response: np.ndarray, places: np.ndarray, sigma_px: float, shrink: int, min_area_px: int
) -> Threshold | None:
    """Threshold by peaks (N, 2) of one scale's response (h, w) and the pixels around each; None of none."""
    owner = np.full(response.shape, -1, np.int32)
    areas = _own(response, places, math.ceil(_REACH * sigma_px), owner)
    index, light = _enlarged(owner, areas, histogram.levels.shape, shrink)
    listed = pixels_of(histogram, index, light, min_area_px)
    if listed is None:
        return None
    groups, numbers = listed
    reason = f"{len(numbers)} peaks {2 * sigma_px * shrink:.3g} pixels wide stand out of the noise."
    return threshold_at("hats_local", histogram, groups.pixels.floor, reason, groups)


def pixels_of(
    histogram: Histogram, index: np.ndarray, light: np.ndarray, min_area_px: int
) -> tuple[PixelGroups, np.ndarray] | None:
    """Groups of pixels (n,), row by row, by the light (n,) of each, and which of these are large enough."""
    kept = np.bincount(light)[light] >= min_area_px if len(light) else np.zeros(0, dtype=bool)
    if histogram.counted is not None:
        kept &= histogram.counted.ravel()[index] > 0
    if not kept.any():
        return None
    is_seen = np.bincount(light[kept]) > 0
    group_of = (np.cumsum(is_seen) - 1)[light[kept]]
    return PixelGroups(pixels_at(histogram.levels, index[kept]), group_of, int(is_seen.sum())), np.flatnonzero(is_seen)


@compiled
def _own(response: np.ndarray, places: np.ndarray, reach: int, owner: np.ndarray) -> int:
    """Give pixels of a response (h, w) that are joined to a peak, of (N, 2), above half its height; how many are.

    A pixel that two lights reach belongs to the clearer, which comes first.
    """
    height, width = response.shape
    total = 0
    for light in range(len(places)):
        row, column = places[light]
        rows = max(0, row - reach), min(height - 1, row + reach)
        columns = max(0, column - reach), min(width - 1, column + reach)
        for y, x in joined(response, row, column, _HALF * response[row, column], rows, columns):
            if owner[y, x] < 0:
                owner[y, x] = light
                total += 1
    return total


@compiled
def _enlarged(owner: np.ndarray, count: int, shape: tuple[int, int], shrink: int) -> tuple[np.ndarray, np.ndarray]:
    """The pixels (n,) of a picture, and their lights (n,), which so many of a smaller one (h, w) stand for."""
    index, light, found = np.empty(count * shrink**2, np.int64), np.empty(count * shrink**2, np.int64), 0
    for row in range(len(owner)):
        columns = np.flatnonzero(owner[row] >= 0)
        for y in range(row * shrink, min((row + 1) * shrink, shape[0]) if len(columns) else 0):
            for column in columns:
                for x in range(column * shrink, min((column + 1) * shrink, shape[1])):
                    index[found], light[found] = y * shape[1] + x, owner[row, column]
                    found += 1
    return index[:found], light[:found]


def _peaks(blurred: np.ndarray, response: np.ndarray, sigma_px: float, shrink: int, faint: bool) -> np.ndarray:
    """Rows and columns (N, 2) of the clearest peaks of a response; its noise is that of its median absolute value.

    With faint ones, none where those that are clear are enough.
    """
    step = max(1, round(math.sqrt(response.size / 20_000)))
    spread = float(np.median(np.abs(response[::step, ::step]))) / 0.6745
    # What rounding leaves of a blurred difference of blurs, and that of each blur to a step, at least.
    noise = max(spread, _QUANTISED * math.hypot(_STEPS * 0.3 / (sigma_px * shrink), 1))
    floor = (_FAINT_NOISE if faint else _CLEAR_NOISE) * noise
    if response.max() <= floor:
        return np.empty((0, 2), np.intp)
    size = 2 * math.ceil(sigma_px) + 1
    near = np.argwhere(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))) - size // 2
    clear = np.flatnonzero(response > floor)
    rows, columns = np.divmod(clear[_are_tops(clear, blurred, response, near)], response.shape[1])
    kept = _are_round(response, rows, columns)
    rows, columns = rows[kept], columns[kept]
    order = np.argsort(-response[rows, columns], kind="stable")[:_MOST_LIGHTS]
    if faint and (response[rows[order], columns[order]] > _CLEAR_NOISE * noise).all():
        return np.empty((0, 2), np.intp)
    return np.column_stack([rows[order], columns[order]])


@compiled
def _are_tops(index: np.ndarray, blurred: np.ndarray, response: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Which pixels (n,) of a response (h, w) are the highest of those ``near``, offsets (M, 2), with a peak there.

    Along an edge, as the rim of a larger light, the response has peaks where the picture has none.
    """
    width, square = response.shape[1], np.array([(y, x) for y in range(-1, 2) for x in range(-1, 2)])
    are_tops = np.zeros(len(index), np.bool_)
    for number in range(len(index)):
        row, column = index[number] // width, index[number] % width
        if _is_highest(response, row, column, near):
            for k in range(len(near)):
                if _is_highest(blurred, row + near[k, 0], column + near[k, 1], square):
                    are_tops[number] = True
                    break
    return are_tops


@compiled
def are_highest(values: np.ndarray, index: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Which pixels (n,) within the edge of a picture (h, w) are the highest of those ``near``, offsets (M, 2)."""
    height, width = values.shape
    highest = np.zeros(len(index), np.bool_)
    for number in range(len(index)):
        row, column = index[number] // width, index[number] % width
        inside = 0 < row < height - 1 and 0 < column < width - 1
        highest[number] = inside and _is_highest(values, row, column, near)
    return highest


@compiled_bare
def _is_highest(values: np.ndarray, row: int, column: int, near: np.ndarray) -> bool:
    """Whether a pixel is within the picture, and none near it, at offsets (M, 2), is higher."""
    height, width = values.shape
    if not (0 <= row < height and 0 <= column < width):
        return False
    for k in range(len(near)):
        y, x = row + near[k, 0], column + near[k, 1]
        if 0 <= y < height and 0 <= x < width and values[y, x] > values[row, column]:
            return False
    return True


def _are_round(response: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Which peaks (N,) are no ridges, as the strokes of letters are, by their curvatures (Lowe 2004, section 4.1)."""
    height, width = response.shape
    if min(height, width) < 3:
        return np.ones(len(rows), dtype=bool)
    y, x = np.clip(rows, 1, height - 2), np.clip(columns, 1, width - 2)
    near = {(down, right): response[y + down, x + right].astype(float) for down in (-1, 0, 1) for right in (-1, 0, 1)}
    xx = near[0, -1] + near[0, 1] - 2 * near[0, 0]
    yy = near[-1, 0] + near[1, 0] - 2 * near[0, 0]
    xy = (near[1, 1] + near[-1, -1] - near[1, -1] - near[-1, 1]) / 4
    return (xx + yy) ** 2 < (_MOST_OBLONG + 1) ** 2 / _MOST_OBLONG * (xx * yy - xy * xy)
