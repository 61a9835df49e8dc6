"""The bright pixels of a picture, and the groups (8-connected components) that they form at any level.

Lights cover about a thousandth of a picture, so groups are found on a list of the pixels above a floor and of which
touch which, rather than on the whole picture.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from dockpose.thresholds.flood import groups_at_every_level, label_groups, touching_pairs


@dataclass(frozen=True)
class BrightPixels:
    """Pixels at or above a floor, row by row.

    Attributes
    ----------
    floor : int
        The floor level.
    width : int, pixels
        Width of the picture.
    index : (n,) int array
        Position of each pixel, row * width + column.
    level : (n,) int array
        Grey level of each pixel, at least ``floor``.
    """

    floor: int
    width: int
    index: np.ndarray
    level: np.ndarray

    def __len__(self) -> int:
        return len(self.index)

    @cached_property
    def touching(self) -> tuple[np.ndarray, np.ndarray]:
        """Pairs (m,), (m,) of neighbours, diagonal ones included, as indices into this list; each pair once."""
        if self.is_empty:
            return np.empty(0, np.int32), np.empty(0, np.int32)
        return touching_pairs(self.index, self.width)

    def above(self, floor: int) -> BrightPixels:
        """Return the pixels at or above another floor, which must not be lower."""
        kept = self.level >= floor
        return BrightPixels(floor, self.width, self.index[kept], self.level[kept])

    @property
    def is_empty(self) -> bool:
        """Whether there are none."""
        return len(self.index) == 0

    def groups(self) -> tuple[int, np.ndarray]:
        """Number of groups, and the group (n,) of each pixel, counted from 0."""
        return label_groups(len(self), *self.touching)

    def groups_at_every_level(self, min_area_px: int) -> np.ndarray:
        """Number of groups of at least ``min_area_px`` pixels at every level; (256,), -1 below the floor."""
        return groups_at_every_level(self.level, *self.touching, self.floor, min_area_px)


def bright_pixels(levels: np.ndarray, floor: int) -> BrightPixels:
    """Pixels of a (H, W) uint8 picture at or above ``floor``."""
    flat = levels.ravel()
    index = np.flatnonzero(flat >= floor)
    return BrightPixels(floor, levels.shape[1], index, flat[index].astype(np.int32))
