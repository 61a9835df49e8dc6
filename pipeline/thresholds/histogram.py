"""The one histogram that all threshold methods share, and what a method returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
from dockpose.camera.image import to_levels
from dockpose.thresholds.bright import BrightPixels, bright_pixels
from dockpose.thresholds.flood import LEVELS

SKETCH_PX = 80_000
SMOOTHING = np.array([1, 4, 6, 4, 1]) / 16  # of the histogram, so that one odd level is no peak


@dataclass(frozen=True)
class Histogram:
    """A grey picture on 256 levels, and how many pixels each level has.

    Attributes
    ----------
    levels : (H, W) uint8.
    native_step : native grey steps in one level: 1 for 8-bit pictures, 256 for full 16-bit ones.
    counted : (H, W) uint8, 0 where a pixel is masked and does not count; None where all do.
    """

    levels: np.ndarray
    native_step: int = 1
    counted: np.ndarray | None = None
    _found: dict[str, BrightPixels] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def counts(self) -> np.ndarray:
        """Number of pixels of each level (256,)."""
        return _counts(self.levels, self.counted)

    @cached_property
    def sketch(self) -> np.ndarray:
        """About how many pixels each level has (256,), from every few rows of a large picture: enough for the water."""
        step = -(-self.levels.size // SKETCH_PX)
        if step <= 1:
            return self.counts
        rough = _counts(self.levels[::step], None if self.counted is None else self.counted[::step]) * step
        return rough if rough.any() else self.counts  # nothing is left where masks hide all of those rows

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
    histogram : (256,) pixels of each level; for the methods of HATS, which look at bright pixels only, that of a large
        picture is estimated from every few rows below ``floor``.
    reason : one sentence, why this level.
    groups_at_level : (256,) number of groups at every level, -1 where it was not counted.
    floor : where the background ends, as far as the method looks; 0 for methods that do not look for it.
    kept : for methods with a level for each light: the pixels that are kept, and the number of the light of each.
    """

    method: str
    level: int
    native_level: int
    histogram: np.ndarray
    reason: str
    groups_at_level: np.ndarray = field(default_factory=lambda: np.full(LEVELS, -1))
    floor: int = 0
    kept: tuple[BrightPixels, np.ndarray] | None = field(default=None, repr=False)

    @cached_property
    def peaks(self) -> tuple[Peak, ...]:
        """Local peaks of the lightly smoothed histogram, bright to dark, and what each votes for.

        Only people look at them: what the peaks between them vote is decided on the whole curve.
        """
        if self.level >= LEVELS or (self.groups_at_level[self.floor :] < 0).all():
            return ()
        padded = np.concatenate([np.zeros(2), self.histogram, np.zeros(2)])
        smooth = np.convolve(padded, SMOOTHING, mode="valid")
        higher_than_next = np.append(smooth[:-1] > smooth[1:], smooth[-1] > 0)
        not_lower_than_last = np.insert(smooth[1:] >= smooth[:-1], 0, True)
        levels = np.flatnonzero(higher_than_next & not_lower_than_last)
        peaks = levels[levels >= self.floor][::-1].tolist()
        found = []
        for level, down_to in zip(peaks, [peak + 1 for peak in peaks[1:]] + [self.floor], strict=False):
            holds = np.bincount(self.groups_at_level[down_to : level + 1])
            found.append(Peak(level, down_to, int(holds.argmax()), int(holds.max())))
        return tuple(found)


def histogram_of(grey: np.ndarray, counted: np.ndarray | None = None) -> Histogram:
    """Histogram of a grey (H, W) uint8 or uint16 picture over 256 equal levels, of the pixels that count."""
    return Histogram(*to_levels(grey), counted)


def _counts(levels: np.ndarray, counted: np.ndarray | None) -> np.ndarray:
    return cv2.calcHist([levels], [0], counted, [LEVELS], [0, LEVELS]).ravel().astype(np.int64)


def threshold_at(method: str, histogram: Histogram, level: int, reason: str) -> Threshold:
    """Return a threshold without more to tell than its level and its reason."""
    return Threshold(method, level, level * histogram.native_step, histogram.counts, reason)
