"""The registry of threshold methods: the library's, those registered in Python, those of installed packages."""

import contextlib
import inspect
import logging
import math
import numbers
import re
import threading
import traceback
from collections.abc import Callable, Iterator, Mapping
from importlib.metadata import EntryPoint, entry_points
from pathlib import PurePath
from typing import Any, NamedTuple, TypeVar

import numpy as np
from dockpose.palette import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from dockpose.pixels.bright import PixelGroups, pixels_at
from dockpose.pixels.flood import LEVELS
from dockpose.text import InputError, one_line
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at

GROUP = "dockpose.thresholds"  # of the entry points
# From the histogram, the minimum area of a group and the level set by hand; most need only the first.
Method = Callable[[Histogram, int, int | None], Threshold]
Function = TypeVar("Function", bound=Callable[..., Any])
_LOG = logging.getLogger(__name__)
_MOST_LETTERS = 40  # as many as fit a dropdown
# Colours and marks of registered methods, in turn; with marks that the library does not use.
_LOOKS = tuple(zip((BLUE, ORANGE, GREEN, VERMILLION, PURPLE, SKY_BLUE), ("d", "p", "h", "*", "H", "8"), strict=True))


class MethodError(InputError):
    """A threshold method that somebody registered raised an error, or returned neither a level nor a mask."""


class Entry(NamedTuple):
    """A threshold method, and how people see it."""

    title: str
    method: Callable[..., Threshold]  # of a histogram, and ``min_area_px`` and ``level`` where it has them
    colour: str  # as in HTML
    mark: str  # of Matplotlib
    short: str = ""  # the title where space is scarce
    function: Callable[..., Any] | None = None  # that was registered; None for the library's own


class Methods(Mapping[str, Method]):
    """Each threshold method by its name, in the order in which people see them; a fixed level comes last."""

    def __init__(self, **built_in: Entry) -> None:
        self._entries = {name: one._replace(method=_called_alike(one.method)) for name, one in built_in.items()}
        self._is_loaded, self._lock = False, threading.RLock()
        self._tell: Callable[[str], object] = _LOG.warning

    def __getitem__(self, name: str) -> Method:
        if name not in self._entries:
            self._load()
        return self._entries[name].method

    def __iter__(self) -> Iterator[str]:
        self._load()
        return iter(sorted(self._entries, key="fixed".__eq__))

    def __len__(self) -> int:
        self._load()
        return len(self._entries)

    def title(self, name: str) -> str:
        """What a method is called where people choose one; the name itself of a method that is not there."""
        return self._entries[name].title if name in self else name

    def short(self, name: str) -> str:
        """The same where space is scarce."""
        return (name in self and self._entries[name].short) or self.title(name).partition(" (")[0]

    def look(self, name: str) -> tuple[str, str]:
        """Colour, as in HTML, and mark, of Matplotlib, by which drawings distinguish a method from the others."""
        entry = self._entries[name]
        return entry.colour, entry.mark

    def is_own(self, name: str) -> bool:
        """Whether somebody registered the method, rather than that it is the library's."""
        return name in self and self._entries[name].function is not None

    def add(self, name: Any, title: Any, function: Any) -> None:
        """Register a function, see :func:`register_threshold`."""
        if not isinstance(name, str) or not re.fullmatch(r"[a-z][a-z0-9_]{,39}", name):
            raise ValueError(
                f"name is {name!r}; a threshold method is called by up to {_MOST_LETTERS} small letters, digits and _, "
                'as in @register_threshold("bright_tenth")'
            )
        title = name if title is None else title
        if not isinstance(title, str) or not title.strip() or len(title) > _MOST_LETTERS or not title.isprintable():
            raise ValueError(f"title of {name!r} is {title!r}; it must be a line of 1 to {_MOST_LETTERS} characters")
        if not callable(function):
            raise ValueError(f"threshold method {name!r} is {function!r}; it must be a function")
        with self._lock:
            for known, entry in self._entries.items():
                if known == name and (entry.function is None or _origin(entry.function) != _origin(function)):
                    whose = ".".join(map(str, _origin(entry.function))) if entry.function else "dockpose's own"
                    raise ValueError(f"there is a threshold method {name!r} already, {whose}")
                if known != name and entry.title == title:
                    raise ValueError(f"title of {name!r} is {title!r}, as that of the threshold method {known!r}")
            registered = [known for known, entry in self._entries.items() if entry.function and known != name]
            look = _LOOKS[len(registered) % len(_LOOKS)]
            self._entries[name] = Entry(title, own_threshold(name, title, function), *look, title, function)

    @contextlib.contextmanager
    def telling(self, tell: Callable[[str], object]) -> Iterator[None]:
        """Report meanwhile by a function why a package's method is left out, which else is logged."""
        before, self._tell = self._tell, tell
        try:
            yield
        finally:
            self._tell = before

    def _load(self) -> None:
        """Load the methods of installed packages, once; one that cannot be is left out, and reported."""
        with self._lock:
            if self._is_loaded:
                return
            self._is_loaded = True
            for point in sorted(entry_points(group=GROUP), key=lambda one: one.name):
                try:
                    self._add_point(point)
                except (Exception, SystemExit) as error:  # whatever somebody's package does, the others are there
                    why = str(error) if type(error) is ValueError else f"{type(error).__name__}: {error}"
                    package = point.dist.name if point.dist else point.value
                    self._tell(one_line(f"the threshold method {point.name!r} of {package} is left out: {why}"))

    def _add_point(self, point: EntryPoint) -> None:
        loaded = point.load()
        known = self._entries.get(point.name)
        if inspect.ismodule(loaded) or (known is not None and known.function is loaded):
            return  # it registered what it has when it was imported
        self.add(point.name, None, loaded)


def _called_alike(method: Callable[..., Threshold]) -> Method:
    """A method that takes histogram, least area and level, of one that may need fewer of them."""
    wanted = [*inspect.signature(method).parameters][1:]

    def called(histogram: Histogram, min_area_px: int, level: int | None) -> Threshold:
        given = {"min_area_px": min_area_px, "level": level}
        return method(histogram, *(given[name] for name in wanted))

    return called


def _origin(function: Any) -> tuple[Any, Any]:
    return getattr(function, "__module__", None), getattr(function, "__qualname__", function)


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
