"""The threshold methods by their names: the library's, and those that somebody registers."""

import functools
import inspect
import math
import numbers
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from dockpose.palette import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from dockpose.pixels.bright import PixelGroups, pixels_at
from dockpose.pixels.flood import LEVELS
from dockpose.text import InputError
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at

Function = TypeVar("Function", bound=Callable[..., Any])
# Colours and marks of registered methods, in turn; with marks that the library does not use.
_LOOKS = tuple(zip((BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY_BLUE), ("d", "p", "h", "*", "H", "8"), strict=True))


class MethodError(InputError):
    """A threshold method that somebody registered raised an error, or returned neither a level nor a mask."""


@dataclass(frozen=True)
class Entry:
    """A threshold method, and how people see it."""

    title: str
    method: Callable[..., Threshold]  # of a histogram, and ``min_area_px`` and ``level`` where it has them
    colour: str  # as in HTML
    mark: str  # of Matplotlib
    short: str = ""  # where space is scarce, if that is not the title up to a bracket
    is_own: bool = False  # registered, rather than the library's

    def __call__(self, histogram: Histogram, min_area_px: int, level: int | None) -> Threshold:
        """The threshold of a picture's histogram."""
        given = {"min_area_px": min_area_px, "level": level}
        return self.method(histogram, *(given[name] for name in _parameters(self.method)))

    @property
    def label(self) -> str:
        """The title where space is scarce."""
        return self.short or self.title.partition(" (")[0]


@functools.cache
def _parameters(method: Callable[..., Threshold]) -> tuple[str, ...]:
    """What a method needs beside the histogram."""
    return (*inspect.signature(method).parameters,)[1:]


def own_entry(known: Mapping[str, Entry], name: Any, title: Any, function: Any) -> Entry:
    """A function as a method beside those that are known, see :func:`register_threshold`."""
    title = name if title is None else title
    if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9_]{,39}", name):
        raise ValueError(f"name is {name!r}; it must be up to 40 small letters, digits and _, as bright_tenth")
    if not isinstance(title, str) or not title.strip() or len(title) > 40 or not title.isprintable():
        raise ValueError(f"title of {name!r} is {title!r}; it must be a line of 1 to 40 characters")
    if not callable(function):
        raise ValueError(f"threshold method {name!r} is {function!r}; it must be a function")
    others = {other: entry for other, entry in known.items() if other != name or not entry.is_own}
    for other, entry in others.items():
        if other == name or entry.title == title:
            raise ValueError(f"threshold method {name!r}, {title!r}: there is {other!r}, {entry.title!r} already")
    look = _LOOKS[sum(entry.is_own for entry in others.values()) % len(_LOOKS)]
    return Entry(title, _own_threshold(name, title, function), *look, title, is_own=True)


def _own_threshold(name: str, title: str, function: Callable[[np.ndarray], Any]) -> Callable[[Histogram], Threshold]:
    """Return a function as a method of the registry."""

    def method(histogram: Histogram) -> Threshold:
        grey = histogram.levels if histogram.native is None else histogram.native
        try:
            found = function(grey.copy())
        except (Exception, SystemExit) as error:
            why = ": ".join(filter(None, (type(error).__name__, str(error))))
            raise MethodError(f"threshold method {name!r} failed: {why}") from error
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
