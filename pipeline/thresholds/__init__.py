"""Threshold methods, one function each, behind the registry `METHODS`, where users' own functions register too."""

from collections.abc import Callable

from dockpose.palette import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from dockpose.pixels.bright import BrightPixels
from dockpose.pixels.flood import LEVELS
from dockpose.thresholds.classic import fixed, kapur, kittler, li, otsu, sezan, triangle, yen
from dockpose.thresholds.hats import hats
from dockpose.thresholds.histogram import Histogram, Peak, Threshold, histogram_of
from dockpose.thresholds.local import hats_local
from dockpose.thresholds.methods import Entry, Function, MethodError, own_entry

# Each by its name, in the order in which people see them: title, function, colour and mark, and a short name.
METHODS = dict(
    hats=Entry("HATS (adaptive)", hats, BLUE, "o"),
    hats_local=Entry("HATS light by light", hats_local, SKY_BLUE, "P", "HATS local"),
    otsu=Entry("Otsu", otsu, VERMILLION, "s"),
    kapur=Entry("Kapur (entropy)", kapur, GREEN, "^"),
    kittler=Entry("Kittler-Illingworth (minimum error)", kittler, PURPLE, "D", "Kittler"),
    sezan=Entry("Sezan", sezan, ORANGE, "v"),
    li=Entry("Li", li, GREY, "<"),
    yen=Entry("Yen", yen, PURPLE, "X"),
    triangle=Entry("Triangle", triangle, ORANGE, ">"),
    fixed=Entry("Fixed level", fixed, GREY, "_", "Fixed"),
)


def register_threshold(name: str, *, title: str | None = None) -> Callable[[Function], Function]:
    """Register a function as a threshold method.

    ``Settings(method=...)``, and what the same program starts of commands and pages, have it from then on.

    Parameters
    ----------
    name : str
        What the method is called in commands and files: up to 40 small letters, digits and underscores.
    title : str, optional
        What it is called on the page, up to 40 characters; the name where it is left out.

    Returns
    -------
    callable
        The decorator, which returns the function as it is. The function takes the grey picture, an array (H, W) of
        uint8 or uint16 that it may change, masked pixels black, and of a tracked dock only the part that is searched.
        It returns either a level on the picture's own scale, so that pixels at or above it are kept (of 16 bits rounded
        up to one of 256 levels), or a mask (H, W) of bool, whose 8-connected groups are the lights. What else it
        returns, and any error of it, makes the estimate's status "method_failed", and the message says what was wrong.

    Raises
    ------
    ValueError
        If the name or the title is no such text, or is that of another method. One's own may be registered again, as a
        notebook does.

    Examples
    --------
    >>> import numpy as np
    >>> from dockpose import Settings
    >>> @register_threshold("half_way", title="Half way up")
    ... def half_way(grey):
    ...     return (float(np.median(grey)) + grey.max()) / 2
    >>> Settings(method="half_way").method
    'half_way'
    """
    if callable(name):
        raise ValueError('a threshold method needs a name, as in @register_threshold("half_way")')

    def register(function: Function) -> Function:
        METHODS[name] = own_entry(METHODS, name, title, function)
        METHODS["fixed"] = METHODS.pop("fixed")  # stays the last
        return function

    return register


__all__ = [
    "LEVELS",
    "METHODS",
    "BrightPixels",
    "Histogram",
    "MethodError",
    "Peak",
    "Threshold",
    "fixed",
    "hats",
    "hats_local",
    "histogram_of",
    "otsu",
    "register_threshold",
]
