"""The bright pixels of a picture, and the groups (8-connected components) that they form at any level.

Lights are a thousandth of a picture. So whoever looks at groups looks at the pixels above a floor alone: a list of them
and of which touch which.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components, minimum_spanning_tree

LEVELS = 256


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
        column = self.index % self.width
        pairs = []
        for step, least, most in ((1, 0, -1), (self.width - 1, 1, 0), (self.width, 0, 0), (self.width + 1, 0, -1)):
            place = np.searchsorted(self.index, self.index + step)
            found = self.index[np.minimum(place, len(self.index) - 1)] == self.index + step
            # A step to the side must not wrap around into another row.
            inside = (column >= least) & (column < self.width + most)
            first = np.flatnonzero(found & inside)
            pairs.append((first, place[first]))
        return np.concatenate([pair[0] for pair in pairs]), np.concatenate([pair[1] for pair in pairs])

    def above(self, floor: int) -> BrightPixels:
        """Return those at or above another floor, which is not lower."""
        kept = self.level >= floor
        return BrightPixels(floor, self.width, self.index[kept], self.level[kept])

    @property
    def is_empty(self) -> bool:
        """Whether there are none."""
        return len(self.index) == 0

    def none(self) -> BrightPixels:
        """Return an empty list of pixels of the same picture."""
        return BrightPixels(LEVELS, self.width, self.index[:0], self.level[:0])

    def groups(self) -> tuple[int, np.ndarray]:
        """How many groups the pixels form, and for each pixel the number (n,) of its group, 0 to that less 1."""
        first, second = self.touching
        size = (len(self), len(self))
        graph = csr_array((np.ones(len(first), dtype=np.int8), (first, second)), shape=size)
        count, labels = connected_components(graph, directed=False)
        return int(count), labels

    def groups_at_every_level(self, min_area_px: int) -> np.ndarray:
        """Number of groups of at least ``min_area_px`` pixels at every level; (256,), -1 below the floor.

        Notes
        -----
        At a level t there are as many groups as there are pixels at or above t, less the edges of a maximum spanning
        forest of the touching pixels whose darker end is at or above t. A pixel is a group of its own from its level
        down to its brightest neighbour's. Larger groups that are still too small are counted one level at a time.
        """
        counts = np.full(LEVELS, -1)
        counts[self.floor :] = 0
        if len(self) == 0:
            return counts
        if min_area_px > 2:
            return self._groups_one_by_one(min_area_px, counts)
        first, second = self.touching
        darker = np.minimum(self.level[first], self.level[second])
        size = (len(self), len(self))
        forest = minimum_spanning_tree(csr_array((LEVELS - darker.astype(float), (first, second)), shape=size))
        edges = LEVELS - forest.data.astype(int)
        groups = _at_or_above(self.level) - _at_or_above(edges)
        if min_area_px == 2:
            groups -= self._lone_pixels(first, second)
        counts[self.floor :] = groups[self.floor :]
        return counts

    def _lone_pixels(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """How many pixels are a group of their own at every level (256,)."""
        brightest = np.zeros(len(self), dtype=self.level.dtype)
        np.maximum.at(brightest, first, self.level[second])
        np.maximum.at(brightest, second, self.level[first])
        alone = brightest < self.level
        return _at_or_above(self.level[alone]) - _at_or_above(brightest[alone])

    def _groups_one_by_one(self, min_area_px: int, counts: np.ndarray) -> np.ndarray:
        pixels = self
        for level in np.unique(self.level):
            pixels = pixels.above(int(level))
            count, labels = pixels.groups()
            counts[level] = np.count_nonzero(np.bincount(labels, minlength=count) >= min_area_px)
        # A level that no pixel has leaves the groups of the next level that some pixel has.
        present = np.unique(self.level)
        every = np.arange(self.floor, LEVELS)
        place = np.searchsorted(present, every)
        held = place < len(present)
        counts[every[held]] = counts[present[place[held]]]
        return counts


def bright_pixels(levels: np.ndarray, floor: int) -> BrightPixels:
    """Pixels of a (H, W) uint8 picture at or above ``floor``."""
    flat = levels.ravel()
    index = np.flatnonzero(flat >= floor)
    return BrightPixels(floor, levels.shape[1], index, flat[index].astype(np.int32))


def _at_or_above(values: np.ndarray) -> np.ndarray:
    """How many of the values lie at or above every level (256,)."""
    return np.bincount(values, minlength=LEVELS)[::-1].cumsum()[::-1]
