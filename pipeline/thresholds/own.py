"""A function of somebody's own as a threshold method: from the grey picture to a level or a mask."""

import math
import numbers
import traceback
from collections.abc import Callable
from pathlib import PurePath
from typing import Any

import numpy as np
from dockpose.pixels.bright import PixelGroups, pixels_at
from dockpose.pixels.flood import LEVELS
from dockpose.text import InputError
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at


class MethodError(InputError):
    """A threshold method that somebody registered raised an error, or returned neither a level nor a mask."""


def own_threshold(
    name: str, title: str, function: Callable[[np.ndarray], Any]
) -> Callable[[Histogram, int, int | None], Threshold]:
    """Return a function as a method of the registry."""

    def method(histogram: Histogram, min_area_px: int, level: int | None) -> Threshold:
        grey = histogram.levels if histogram.native is None else histogram.native
        try:
            found = function(grey.copy())
        except (Exception, SystemExit) as error:
            raise MethodError(f"threshold method {name!r} failed: {_in_words(error, function)}") from error
        if isinstance(found, np.ndarray) and found.ndim == 0:
            found = found[()]
        if isinstance(found, np.ndarray):
            return _threshold_by_mask(name, title, histogram, found)
        return _threshold_by_level(name, title, histogram, found, 1 << 8 * grey.itemsize)

    return method


def _threshold_by_level(name: str, title: str, histogram: Histogram, found: Any, top: int) -> Threshold:
    """A level on the picture's own scale; between two of the 256 levels, the upper one."""
    if isinstance(found, (bool, np.bool_)) or not isinstance(found, numbers.Real):
        what = "None" if found is None else f"a {type(found).__name__}"
        wanted = f"a level or a mask {histogram.levels.shape} of bool"
        raise MethodError(f"threshold method {name!r} returned {what}; it must return {wanted}")
    value = float(found)
    if not 0 <= value <= top:
        raise MethodError(
            f"threshold method {name!r} returned {value:g}; a level of this picture is from 0 to {top}, "
            f"where {top} keeps nothing"
        )
    native = math.ceil(value)
    level = min(LEVELS, math.ceil(native / histogram.native_step))
    return threshold_at(name, histogram, level, f"{title} returned level {native}.")


def _threshold_by_mask(name: str, title: str, histogram: Histogram, mask: np.ndarray) -> Threshold:
    """Keep what the mask keeps and no masked pixel; its groups are the lights, none of them parted."""
    shape = histogram.levels.shape
    if mask.dtype != np.bool_ or mask.shape != shape:
        raise MethodError(
            f"threshold method {name!r} returned an array {mask.shape} of {mask.dtype}; a mask of this picture is "
            f"{shape} of bool"
        )
    if histogram.counted is not None:
        mask = mask & (histogram.counted > 0)
    index = np.flatnonzero(mask)
    if len(index) == 0:
        return threshold_at(name, histogram, LEVELS, f"The mask of {title} keeps no pixel.")
    pixels = pixels_at(histogram.levels, index)
    reason = f"The mask of {title} keeps {len(index)} pixel{'s' if len(index) > 1 else ''}, the darkest at this level."
    count, group_of = pixels.groups()
    return threshold_at(name, histogram, pixels.floor, reason, PixelGroups(pixels, group_of, count))


def _in_words(error: BaseException, function: Any) -> str:
    """The error, and the line of the function's file at which it came."""
    words = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
    file = getattr(getattr(function, "__code__", None), "co_filename", None)
    lines = [step for step in traceback.extract_tb(error.__traceback__) if step.filename == file]
    return f"{words} ({PurePath(lines[-1].filename).name}, line {lines[-1].lineno})" if lines else words
