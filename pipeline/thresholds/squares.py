"""A picture in squares of some pixels, where it has too many to look at each by itself."""

from __future__ import annotations

import numpy as np
from dockpose.thresholds.compiled import compiled


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
def coarsen(
    index: np.ndarray, value: np.ndarray, width: int, shrink: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, int]:
    """Put pixels in squares of ``shrink`` by ``shrink``, each as high as its highest pixel.

    Returns the place (m,) and value (m,) of each square, the number (n,) of each pixel's, and how many squares a row
    has.
    """
    across = -(-width // shrink)
    down = index[-1] // width // shrink + 1
    highest = np.full(across * down, -1, value.dtype)
    square_of = np.empty(len(index), np.int32)
    # Divisions take longer than all the rest: one for each row and each column is enough.
    of_column = np.arange(width) // shrink
    row_starts, first = -width, 0
    for pixel in range(len(index)):
        if index[pixel] >= row_starts + width:
            row = index[pixel] // width
            row_starts, first = row * width, row // shrink * across
        square = first + of_column[index[pixel] - row_starts]
        square_of[pixel] = square
        highest[square] = max(highest[square], value[pixel])
    squares = np.flatnonzero(highest >= 0)
    number_of = np.empty(across * down, np.int64)
    for number in range(len(squares)):
        number_of[squares[number]] = number
    for pixel in range(len(index)):
        square_of[pixel] = number_of[square_of[pixel]]
    return squares, highest[squares], square_of, across


@compiled
def of_squares(index: np.ndarray, width: int, side: int, across: int, of_square: np.ndarray) -> np.ndarray:
    """The entry of ``of_square`` for each pixel: squares are ``side`` by ``side`` pixels, ``across`` to a row."""
    found = np.empty(len(index), of_square.dtype)
    of_column = np.arange(width) // side
    row_starts, first = -width, 0
    for pixel in range(len(index)):
        if index[pixel] >= row_starts + width:
            row = index[pixel] // width
            row_starts, first = row * width, row // side * across
        found[pixel] = of_square[first + of_column[index[pixel] - row_starts]]
    return found


@compiled
def shapes_in_squares(
    levels: np.ndarray, side: int, group_at: np.ndarray, dimmest: np.ndarray, saturated: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What :func:`dockpose.thresholds.flood.group_shapes` returns, of a picture's pixels rather than a list of them.

    ``group_at`` (h, w) is the group that each square of that side belongs to, -1 for none; ``dimmest`` (N,) the lowest
    level of each group's pixels.
    """
    count, width = len(dimmest), levels.shape[1]
    areas, peaks, bright = np.zeros(count, np.int64), np.zeros(count, np.int64), np.zeros(count, np.int64)
    moments, boxes = np.zeros((count, 2)), np.empty((count, 4), np.int64)
    boxes[:, :2], boxes[:, 2:] = np.iinfo(np.int64).max, -1
    for y in range(len(levels)):
        row = group_at[y // side]
        for square in range(len(row)):
            group = row[square]
            if group < 0:
                continue
            least, area, peak, full, along, left, right = dimmest[group], 0, 0, 0, 0, -1, -1
            for x in range(square * side, min((square + 1) * side, width)):
                level = np.int64(levels[y, x])
                if level >= least:
                    area += 1
                    along += x
                    peak = max(peak, level)
                    full += level >= saturated
                    left, right = x if left < 0 else left, x
            if area == 0:
                continue
            areas[group] += area
            moments[group, 0] += along
            moments[group, 1] += y * area
            peaks[group], bright[group] = max(peaks[group], peak), bright[group] + full
            boxes[group, 0], boxes[group, 1] = min(boxes[group, 0], left), min(boxes[group, 1], y)
            boxes[group, 2], boxes[group, 3] = max(boxes[group, 2], right), max(boxes[group, 3], y)
    for group in range(count):
        moments[group] /= max(areas[group], 1)
    return areas, moments, boxes, peaks, bright
