"""The one histogram that all threshold methods share, and what a method returns."""

from __future__ import annotations

from dataclasses import dataclass, field

import cv2
import numpy as np

from pipeline.image import to_levels
from pipeline.thresholds.bright import LEVELS, BrightPixels, bright_pixels


@dataclass(frozen=True)
class Histogram:
    """A grey picture on 256 levels, and how many pixels each level has.

    Attributes
    ----------
    levels : (H, W) uint8.
    counts : (256,) int.
    native_step : native grey steps in one level: 1 for 8-bit pictures, 256 for full 16-bit ones.
    """

    levels: np.ndarray
    counts: np.ndarray
    native_step: int = 1
    _found: dict[str, BrightPixels] = field(default_factory=dict, repr=False, compare=False)

    def bright(self, floor: int) -> BrightPixels:
        """Pixels at or above ``floor``; the picture is searched once, for the lowest floor that is asked for."""
        known = self._found.get("pixels")
        if known is None or floor < known.floor:
            known = self._found["pixels"] = bright_pixels(self.levels, floor)
        return known if floor == known.floor else known.above(floor)


@dataclass(frozen=True)
class Peak:
    """A local peak of the histogram, bright to dark: a candidate for the threshold.

    Attributes
    ----------
    level : where the peak is.
    down_to : the darkest level it stands for.
    groups : the number of groups that holds over most of the levels it stands for.
    votes : over how many of those levels it holds.
    """

    level: int
    down_to: int
    groups: int
    votes: int


@dataclass(frozen=True)
class Threshold:
    """The level that tells lights from water: a pixel at or above it is kept.

    Attributes
    ----------
    method : name of the method in ``METHODS``.
    level : 0..255; 256 keeps nothing.
    native_level : the same on the picture's own scale (16-bit pictures: up to 65536).
    histogram : (256,) pixels of each level.
    reason : one sentence, why this level.
    groups_at_level : (256,) number of groups at every level, -1 where it was not counted.
    floor : where the background ends, as far as the method looks; 0 for methods that do not look for it.
    peaks : the candidates and their votes, bright to dark.
    kept : for methods with a level for each light: the pixels that are kept, and the number of the light of each.
    """

    method: str
    level: int
    native_level: int
    histogram: np.ndarray
    reason: str
    groups_at_level: np.ndarray = field(default_factory=lambda: np.full(LEVELS, -1))
    floor: int = 0
    peaks: tuple[Peak, ...] = ()
    kept: tuple[BrightPixels, np.ndarray] | None = field(default=None, repr=False)


def histogram_of(grey: np.ndarray, counted: np.ndarray | None = None) -> Histogram:
    """Histogram of a grey (H, W) uint8 or uint16 picture over 256 equal levels.

    ``counted`` (H, W) uint8 is 0 where a pixel is masked and does not count; None where all do.
    """
    levels, native_step = to_levels(grey)
    counts = cv2.calcHist([levels], [0], counted, [LEVELS], [0, LEVELS]).ravel().astype(np.int64)
    return Histogram(levels, counts, native_step)


def threshold_at(method: str, histogram: Histogram, level: int, reason: str) -> Threshold:
    """Return a threshold without more to tell than its level and its reason."""
    return Threshold(method, level, level * histogram.native_step, histogram.counts, reason)
