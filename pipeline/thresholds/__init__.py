"""Threshold methods, one function each, behind the registry `METHODS`.

May import `dockpose.camera`.
"""

from __future__ import annotations

from collections.abc import Callable

from dockpose.thresholds.bright import BrightPixels
from dockpose.thresholds.classic import kapur, kittler, li, otsu, triangle, yen
from dockpose.thresholds.fixed import fixed
from dockpose.thresholds.flood import LEVELS
from dockpose.thresholds.hats import hats
from dockpose.thresholds.histogram import Histogram, Peak, Threshold, histogram_of
from dockpose.thresholds.local import hats_local
from dockpose.thresholds.sezan import sezan

# Each method by its name, as a function of the histogram, the minimum area of a group and the level set by hand; most
# need only the first, and only "fixed" needs the last.
METHODS: dict[str, Callable[[Histogram, int, int | None], Threshold]] = {
    "hats": lambda histogram, min_area_px, level: hats(histogram, min_area_px),
    "hats_local": lambda histogram, min_area_px, level: hats_local(histogram, min_area_px),
    "otsu": lambda histogram, min_area_px, level: otsu(histogram),
    "kapur": lambda histogram, min_area_px, level: kapur(histogram),
    "kittler": lambda histogram, min_area_px, level: kittler(histogram),
    "sezan": lambda histogram, min_area_px, level: sezan(histogram),
    "li": lambda histogram, min_area_px, level: li(histogram),
    "yen": lambda histogram, min_area_px, level: yen(histogram),
    "triangle": lambda histogram, min_area_px, level: triangle(histogram),
    "fixed": lambda histogram, min_area_px, level: fixed(histogram, level),
}

__all__ = [
    "LEVELS",
    "METHODS",
    "BrightPixels",
    "Histogram",
    "Peak",
    "Threshold",
    "fixed",
    "hats",
    "hats_local",
    "histogram_of",
    "kapur",
    "kittler",
    "li",
    "otsu",
    "sezan",
    "triangle",
    "yen",
]
