"""The one histogram that all threshold methods share, and what a method returns."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from pipeline.image import to_levels

LEVELS = 256


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
    peaks : the candidates and their votes, bright to dark.
    """

    method: str
    level: int
    native_level: int
    histogram: np.ndarray
    reason: str
    groups_at_level: np.ndarray = field(default_factory=lambda: np.full(LEVELS, -1))
    peaks: tuple[Peak, ...] = ()


def histogram_of(grey: np.ndarray) -> Histogram:
    """Histogram of a grey (H, W) uint8 or uint16 picture over 256 equal levels."""
    levels, native_step = to_levels(grey)
    counts = np.bincount(levels.ravel(), minlength=LEVELS)
    return Histogram(levels, counts, native_step)
