"""The grey picture as every threshold method gets it, with its histogram; and the result of a method."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import cv2
import numpy as np
from dockpose.camera.image import to_levels
from dockpose.pixels.bright import (
    SATURATED,
    BrightPixels,
    PixelGroups,
    SquareGroups,
    bright_pixels,
    brightest_of_squares,
)
from dockpose.pixels.flood import LEVELS

SKETCH_PX = 80_000  # about so many pixels are counted, enough for the water
MOST_SATURATED_PX = 40_000  # lights that fill more are large
# What fills more of a picture is water or glare: at least three lights are in view, and fill less than a half.
MOST_SHARE = 0.125
# A list of more bright pixels would take more memory than a large picture: their places and levels are 8 bytes each.
MOST_LISTED_PX = 4_000_000
_GLARE_PX = 20_000  # of the picture in which glare is looked for
SMOOTHING = np.array([1, 4, 6, 4, 1]) / 16  # of the histogram, so that a single odd level is not a peak


@dataclass(frozen=True)
class Histogram:
    """A grey picture on 256 levels with its histogram: what every threshold method starts from.

    Attributes
    ----------
    levels : (H, W) uint8 array
        The picture.
    native_step : int
        Native grey steps in one level: 1 for 8-bit pictures, 256 for full 16-bit ones.
    counted : (H, W) uint8 array or None
        0 where a pixel is masked and does not count; None where all count.
    native : (H, W) uint8 or uint16 array or None
        The grey picture on its own scale; None where only the levels are known.
    """

    levels: np.ndarray
    native_step: int = 1
    counted: np.ndarray | None = None
    native: np.ndarray | None = field(default=None, repr=False)
    _found: dict[str, BrightPixels] = field(default_factory=dict, repr=False, compare=False)
    _smaller: dict[int, tuple[Histogram, int]] = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def counts(self) -> np.ndarray:
        """Number of pixels of each level (256,)."""
        return _counts(self.levels, self.counted)

    @cached_property
    def sketch(self) -> np.ndarray:
        """Approximate number of pixels of each level (256,), of every few rows, accurate enough for the water."""
        step = -(-self.levels.size // SKETCH_PX)
        if step <= 1:
            return self.counts
        rough = _counts(self.levels[::step], None if self.counted is None else self.counted[::step]) * step
        return rough if rough.any() else self.counts  # masks may hide every one of those rows

    def in_squares(self, most_px: int) -> tuple[Histogram, int]:
        """A picture, if large, in about ``most_px`` squares as bright as their brightest pixels, and their side."""
        if most_px not in self._smaller:
            saturated = int(self.sketch[SATURATED:].sum())
            side = math.ceil(math.sqrt(max(self.levels.size / most_px, saturated / MOST_SATURATED_PX)))
            smaller = self
            if side > 1:
                counted = None if self.counted is None else brightest_of_squares(self.counted, side)
                smaller = Histogram(brightest_of_squares(self.levels, side), self.native_step, counted)
            self._smaller[most_px] = smaller, side
        return self._smaller[most_px]

    @cached_property
    def without_glare(self) -> Histogram:
        """The picture less saturated regions so wide that a light of their width would fill ``MOST_SHARE`` of it."""
        most = MOST_SHARE * self.levels.size
        if self.sketch[SATURATED:].sum() < most:
            return self
        step = max(1, round(math.sqrt(self.levels.size / _GLARE_PX)))
        saturated = (self.levels[::step, ::step] >= SATURATED).astype(np.uint8)
        radius = math.sqrt(most / math.pi) / step
        middle = cv2.distanceTransform(saturated, cv2.DIST_L2, cv2.DIST_MASK_5) > radius
        if not middle.any():
            return self
        reach = cv2.distanceTransform((~middle).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
        # The halo's brightest part goes as well.
        clear = (reach > radius + 2).astype(np.uint8)
        clear = cv2.resize(clear, self.levels.shape[::-1], interpolation=cv2.INTER_NEAREST)
        counted = clear if self.counted is None else np.minimum(clear, self.counted)
        return Histogram(self.levels * clear, self.native_step, counted)

    @cached_property
    def noise(self) -> float:
        """Standard deviation of the noise, in levels."""
        return noise_levels(self.levels, self.counted)

    def bright(self, floor: int) -> BrightPixels:
        """Pixels at or above ``floor``; the picture is searched once for the lowest floor asked for."""
        known = self._found.get("pixels")
        if known is None or floor < known.floor:
            known = self._found["pixels"] = bright_pixels(self.levels, floor)
        return known if floor == known.floor else known.above(floor)

    def is_lit(self, floor: int) -> bool:
        """Whether too many pixels are at or above ``floor`` to list them: squares must do."""
        return int(self.sketch[floor:].sum()) > MOST_LISTED_PX

    def bright_squares(self, floor: int, most_pixels: int) -> tuple[BrightPixels, int]:
        """Pixels at or above ``floor`` in about ``most_pixels`` squares at most, and the side of a square in pixels."""
        if not self.is_lit(floor):
            return self.bright(floor).coarser(most_pixels)
        side = math.ceil(math.sqrt(max(int(self.counts[floor:].sum()) / most_pixels, 1)))
        return bright_pixels(brightest_of_squares(self.levels, side), floor), side


@dataclass(frozen=True)
class Peak:
    """A local peak of the histogram: a candidate for the threshold.

    Attributes
    ----------
    level, down_to : int
        Where the peak is, and the darkest level it stands for.
    groups, votes : int
        The number of groups at most of the levels it stands for, and the number of those levels.
    """

    level: int
    down_to: int
    groups: int
    votes: int


@dataclass(frozen=True)
class Threshold:
    """The level that separates lights from water: a pixel at or above it is kept.

    Attributes
    ----------
    method : str
        Name of the method in ``METHODS``.
    level, native_level : int
        0..255, 256 keeps nothing; and the same on the picture's own scale (16-bit pictures: up to 65536).
    histogram : (256,) int array
        Number of pixels of each level. The HATS methods only look at bright pixels; theirs is, for a large picture,
        estimated from every few rows below ``floor``.
    reason : str
        Why this level, in one sentence.
    groups_at_level : (256,) int array
        Number of groups at every level, -1 where it was not counted.
    floor : int
        Where the background ends, as far as the method needs it; 0 for methods that do not.
    groups : PixelGroups, SquareGroups or None
        For methods with a level per light: which pixels are kept, and of which light each is.
    leaves_glare : bool
        Whether saturated regions too wide for a light are no groups, see :attr:`Histogram.without_glare`.
    """

    method: str
    level: int
    native_level: int
    histogram: np.ndarray
    reason: str
    groups_at_level: np.ndarray = field(default_factory=lambda: np.full(LEVELS, -1))
    floor: int = 0
    groups: PixelGroups | SquareGroups | None = field(default=None, repr=False)
    leaves_glare: bool = False

    @cached_property
    def kept(self) -> tuple[BrightPixels, np.ndarray] | None:
        """For methods with a level per light: the pixels that are kept, and the index (n,) of the light of each."""
        return None if self.groups is None else self.groups.listed()

    @cached_property
    def peaks(self) -> tuple[Peak, ...]:
        """Local peaks of the smoothed histogram, bright to dark, and what each votes for: for display only."""
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
    """Histogram of a grey picture over 256 equal levels.

    Parameters
    ----------
    grey : (H, W) array, uint8 or uint16
        Grey picture.
    counted : (H, W) uint8 array, optional
        0 where a pixel does not count; None where all count.

    Returns
    -------
    Histogram
        The picture on 256 levels, with its histogram.

    Examples
    --------
    >>> import numpy as np
    >>> histogram = histogram_of(np.array([[10, 10], [10, 250]], np.uint8))
    >>> histogram.counts[[10, 250]].tolist()
    [3, 1]
    """
    return Histogram(*to_levels(grey), counted, grey)


def noise_levels(levels: np.ndarray, counted: np.ndarray | None = None) -> float:
    """Standard deviation of the noise, from how neighbours differ along every few rows; at least a quarter level."""
    rows = np.arange(len(levels)) if counted is None else np.flatnonzero(counted.any(axis=1))
    rows = rows[:: max(1, len(rows) // 60)]
    if len(rows) == 0 or levels.shape[1] < 2:
        return 0.25
    sampled, both = levels[rows], None
    if counted is not None:
        both = counted[rows, 1:] & counted[rows, :-1]
    counts = _counts(cv2.absdiff(sampled[:, 1:], sampled[:, :-1]), both)
    # Lights and edges are rare; the mean of what is left of a normal distribution's differences is 1.128 sigma.
    quiet = counts[: int(np.searchsorted(counts.cumsum(), 0.98 * counts.sum())) + 1]
    return max(0.25, float(quiet @ np.arange(len(quiet))) / max(quiet.sum(), 1) / 1.128)


def _counts(levels: np.ndarray, counted: np.ndarray | None) -> np.ndarray:
    return cv2.calcHist([levels], [0], counted, [LEVELS], [0, LEVELS]).ravel().astype(np.int64)


def threshold_at(
    method: str, histogram: Histogram, level: int, reason: str, groups: PixelGroups | None = None
) -> Threshold:
    """Return a threshold that has only a level, a reason and perhaps groups."""
    return Threshold(method, level, level * histogram.native_step, histogram.counts, reason, groups=groups)
