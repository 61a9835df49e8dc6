"""The bright pixels of a picture, and the groups (8-connected components) that they form at any level.

Lights are a thousandth of a picture. So whoever looks at groups looks at the pixels above a floor alone: a list of them
and of which touch which.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from dockpose.thresholds.flood import groups_at_every_level, label_groups, touching_pairs


@dataclass(frozen=True)
class BrightPixels:
    """Pixels at or above a floor, in the order of the picture's rows.

    Attributes
    ----------
    floor : the level.
    width : of the picture, in pixels.
    index : (n,) place of each pixel, row * width + column.
    level : (n,) int, at least ``floor``.
    """

    floor: int
    width: int
    index: np.ndarray
    level: np.ndarray

    def __len__(self) -> int:
        return len(self.index)

    @cached_property
    def touching(self) -> tuple[np.ndarray, np.ndarray]:
        """Pairs (m,), (m,) of neighbours, also across corners, as numbers of pixels in this list; each pair once."""
        if self.is_empty:
            return np.empty(0, np.int32), np.empty(0, np.int32)
        return touching_pairs(self.index, self.width)

    def above(self, floor: int) -> BrightPixels:
        """Return those at or above another floor, which is not lower."""
        kept = self.level >= floor
        return BrightPixels(floor, self.width, self.index[kept], self.level[kept])

    @property
    def is_empty(self) -> bool:
        """Whether there are none."""
        return len(self.index) == 0

    def groups(self) -> tuple[int, np.ndarray]:
        """How many groups the pixels form, and for each pixel the number (n,) of its group, 0 to that less 1."""
        return label_groups(len(self), *self.touching)

    def groups_at_every_level(self, min_area_px: int) -> np.ndarray:
        """Number of groups of at least ``min_area_px`` pixels at every level; (256,), -1 below the floor."""
        return groups_at_every_level(self.level, *self.touching, self.floor, min_area_px)


def bright_pixels(levels: np.ndarray, floor: int) -> BrightPixels:
    """Pixels of a (H, W) uint8 picture at or above ``floor``."""
    flat = levels.ravel()
    index = np.flatnonzero(flat >= floor)
    return BrightPixels(floor, levels.shape[1], index, flat[index].astype(np.int32))
