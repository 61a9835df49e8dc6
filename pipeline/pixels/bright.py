"""The bright pixels of a picture, and the groups (8-connected components) that they form at any level."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.pixels.flood import (
    LEVELS,
    Shapes,
    add_pixel,
    count_groups,
    group_shapes,
    label_groups,
    no_shapes,
    to_means,
)

_RUN = 256  # pixels
# Levels so near the top are saturated: noise and compression lower some.
SATURATED = 250


@dataclass(frozen=True)
class BrightPixels:
    """Pixels at or above a floor, row by row.

    Attributes
    ----------
    floor, width : int, grey level and pixels
        The floor level, and the width of the picture.
    index, level : (n,) int arrays
        Position of each pixel, row * width + column, and its grey level, at least ``floor``.
    """

    floor: int
    width: int
    index: np.ndarray
    level: np.ndarray

    def __len__(self) -> int:
        return len(self.index)

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
        return label_groups(self.index, self.width)

    def groups_at_every_level(self, min_area_px: int) -> np.ndarray:
        """Number of groups of at least ``min_area_px`` pixels at every level; (256,), -1 below the floor."""
        return self.count_groups(min_area_px)[0]

    def count_groups(
        self, min_area_px: int, most_area_px: int | None = None, rise: float = 0.0
    ) -> tuple[np.ndarray, np.ndarray]:
        """Counts (256,) of all groups, and of those no larger, or saturated, that rise so far; -1 below the floor."""
        if self.is_empty:
            counts = np.where(np.arange(LEVELS) < self.floor, -1, 0)
            return counts, counts
        most = len(self) if most_area_px is None else most_area_px
        return count_groups(self.level, self.index, self.width, self.floor, min_area_px, most, float(rise), SATURATED)

    def coarser(self, most_pixels: int) -> tuple[BrightPixels, int]:
        """These pixels in about ``most_pixels`` squares at most, and the side of a square in pixels."""
        side = math.ceil(math.sqrt(len(self) / most_pixels))
        if side <= 1:
            return self, 1
        index, level, _, width = coarsen(self.index, self.level, self.width, side)
        return BrightPixels(self.floor, width, index, level), side


@dataclass(frozen=True)
class PixelGroups:
    """Bright pixels, and which group each belongs to."""

    pixels: BrightPixels
    group_of: np.ndarray  # (n,): number of each one's group, from 0
    count: int  # of groups
    centres_px: np.ndarray | None = None  # (N, 2): of groups whose middles are known by more than these pixels
    side = 1  # of a square, as of the others

    def shapes(self) -> Shapes:
        """What each group looks like."""
        pixels = self.pixels
        return group_shapes(pixels.index, pixels.level, self.group_of, self.count, pixels.width, SATURATED)

    def squares(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Place (n,) and group (n,) of each pixel, and the width of a row."""
        return self.pixels.index, self.group_of, self.pixels.width

    def listed(self) -> tuple[BrightPixels, np.ndarray]:
        """The pixels, and the group (n,) of each."""
        return self.pixels, self.group_of


@dataclass(frozen=True)
class SquareGroups:
    """Groups of so many pixels, kept as squares, since a list of them would take more memory than the picture."""

    levels: np.ndarray  # (H, W) uint8: the picture
    side: int  # of a square, in pixels
    group_at: np.ndarray  # (h, w): number of each square's group, from 0; -1 where it has none
    dimmest: np.ndarray  # (N,): level at or above which a pixel of a square belongs to its group

    @property
    def count(self) -> int:
        """How many groups there are."""
        return len(self.dimmest)

    def shapes(self) -> Shapes:
        """What each group looks like."""
        shapes = no_shapes(len(self.dimmest))
        _add_squares(shapes, self.levels, self.side, self.group_at, self.dimmest, SATURATED)
        return to_means(shapes)

    def squares(self) -> tuple[np.ndarray, np.ndarray, int]:
        """Place (m,) and group (m,) of each square that has one, and the number of squares in a row."""
        index = np.flatnonzero(self.group_at >= 0)
        return index, self.group_at.ravel()[index], self.group_at.shape[1]

    def listed(self) -> tuple[BrightPixels, np.ndarray]:
        """The pixels, and the group (n,) of each."""
        floor = int(self.dimmest.min())
        pixels = bright_pixels(self.levels, floor)
        group_of = self.group_at.ravel()[squares_of(pixels.index, pixels.width, self.side)]
        kept = (group_of >= 0) & (pixels.level >= self.dimmest[group_of])
        return BrightPixels(floor, pixels.width, pixels.index[kept], pixels.level[kept]), group_of[kept]


def bright_pixels(levels: np.ndarray, floor: int) -> BrightPixels:
    """Pixels of a (H, W) uint8 picture at or above ``floor``."""
    index, level = _at_least(levels.ravel(), floor, np.empty(0, _index_type(levels)))
    return BrightPixels(floor, levels.shape[1], index, level)


def pixels_at(levels: np.ndarray, index: np.ndarray) -> BrightPixels:
    """Pixels of a (H, W) uint8 picture at places (n,) that rise; their floor is the dimmest."""
    level = levels.ravel()[index].astype(np.int32)
    return BrightPixels(int(level.min()), levels.shape[1], index.astype(_index_type(levels)), level)


def _index_type(levels: np.ndarray) -> type[np.integer]:
    return np.int32 if levels.size <= np.iinfo(np.int32).max else np.int64


@compiled
def _at_least(flat: np.ndarray, floor: int, index: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions (n,) of the pixels at or above ``floor``, of the type of ``index``, and their levels (n,)."""
    # The brightest of a run is found in a few instructions, and most runs hold no bright pixel.
    runs = -(-len(flat) // _RUN)
    has_bright, most = np.empty(runs, np.bool_), 0
    for run in range(runs):
        brightest = np.uint8(0)
        for level in flat[run * _RUN : (run + 1) * _RUN]:
            brightest = max(brightest, level)
        has_bright[run] = brightest >= floor
        if has_bright[run]:
            for level in flat[run * _RUN : (run + 1) * _RUN]:
                most += level >= floor
    index, levels, count = np.empty(most, index.dtype), np.empty(most, np.int32), 0
    for run in range(runs):
        if has_bright[run]:
            for place in range(run * _RUN, min(len(flat), (run + 1) * _RUN)):
                if flat[place] >= floor:
                    index[count], levels[count] = place, flat[place]
                    count += 1
    return index, levels


def brightest_of_squares(levels: np.ndarray, side: int) -> np.ndarray:
    """The brightest pixel (h, w) of each square of ``side`` by ``side``, which the picture's edges may cut."""
    height, width = levels.shape
    if height % side or width % side:
        levels = np.pad(levels, ((0, -height % side), (0, -width % side)), mode="edge")
    rows = levels[::side]
    for offset in range(1, side):
        rows = np.maximum(rows, levels[offset::side])
    columns = rows[:, ::side]
    for offset in range(1, side):
        columns = np.maximum(columns, rows[:, offset::side])
    return np.ascontiguousarray(columns)


@compiled
def squares_of(index: np.ndarray, width: int, side: int) -> np.ndarray:
    """The square (n,) of ``side`` by ``side`` pixels that each pixel is in, counted row by row."""
    across, square_of = -(-width // side), np.empty(len(index), np.int64)
    # Divisions take longer than all the rest: one for each row and each column is enough.
    of_column = np.arange(width) // side
    row_starts, first = -width, 0
    for pixel in range(len(index)):
        if index[pixel] >= row_starts + width:
            row = index[pixel] // width
            row_starts, first = row * width, row // side * across
        square_of[pixel] = first + of_column[index[pixel] - row_starts]
    return square_of


@compiled
def coarsen(
    index: np.ndarray, value: np.ndarray, width: int, shrink: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Squares of ``shrink`` pixels: places and highest values (m,), each pixel's number (n,), squares in a row."""
    across, down = -(-width // shrink), index[-1] // width // shrink + 1
    highest = np.full(across * down, -1, value.dtype)
    square_of = squares_of(index, width, shrink)
    for pixel in range(len(index)):
        highest[square_of[pixel]] = max(highest[square_of[pixel]], value[pixel])
    squares = np.flatnonzero(highest >= 0)
    number_of = np.empty(across * down, np.int64)
    for number in range(len(squares)):
        number_of[squares[number]] = number
    return squares, highest[squares], number_of[square_of], across


@compiled_bare
def _add_squares(
    shapes: Shapes, levels: np.ndarray, side: int, group_at: np.ndarray, dimmest: np.ndarray, saturated: int
) -> None:
    """Add the pixels at or above a group's ``dimmest`` (N,) to shapes of groups of squares (h, w), -1 for none."""
    width = levels.shape[1]
    for y in range(len(levels)):
        row = group_at[y // side]
        for square in range(len(row)):
            if row[square] < 0:
                continue
            for x in range(square * side, min((square + 1) * side, width)):
                level = np.int64(levels[y, x])
                if level >= dimmest[row[square]]:
                    add_pixel(shapes, row[square], x, y, level, saturated)
