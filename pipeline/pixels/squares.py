"""A picture in squares of some pixels, where it has too many to look at each by itself."""

import numpy as np
from dockpose.compiled import compiled
from dockpose.pixels.flood import Shapes, add_pixel, no_shapes


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


@compiled
def shapes_in_squares(
    levels: np.ndarray, side: int, group_at: np.ndarray, dimmest: np.ndarray, saturated: int
) -> Shapes:
    """Shapes of groups of squares (h, w), -1 for none, of pixels at or above a group's ``dimmest`` (N,)."""
    shapes, width = no_shapes(len(dimmest)), levels.shape[1]
    for y in range(len(levels)):
        row = group_at[y // side]
        for square in range(len(row)):
            if row[square] < 0:
                continue
            for x in range(square * side, min((square + 1) * side, width)):
                level = np.int64(levels[y, x])
                if level >= dimmest[row[square]]:
                    add_pixel(shapes, row[square], x, y, level, saturated)
    for group in range(len(dimmest)):
        shapes.moments[group] /= max(shapes.areas[group], 1)
    return shapes
