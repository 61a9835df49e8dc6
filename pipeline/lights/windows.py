"""Lights in windows around where they must be, each by what is above half its height; compiled by numba."""

from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled
from dockpose.lights.centroids import NORMAL, median_along_edge, window_at
from dockpose.pixels.flood import joined


class Spots(NamedTuple):
    """The brightest spot of each window; NaN where it has none."""

    points_px: np.ndarray  # (N, 2): x, y, weighed by what is above half of its height
    spans_px: np.ndarray  # (N,): light above half of its height, over that half: grows with its area
    heights: np.ndarray  # (N,): above the water, in levels
    noises: np.ndarray  # (N,): standard deviation of the water's levels
    peaks: np.ndarray  # (N,): level of its brightest pixel
    boxes_px: np.ndarray  # (N, 4): left, top, right and bottom pixel of what is above half of its height
    cut: np.ndarray  # (N,): whether the picture's edge cuts it

    def chosen(self, flags: np.ndarray, other: "Spots") -> "Spots":
        """Of each light that a flag (N,) is set for what another look shows."""
        pairs = zip(self, other, strict=True)
        return Spots(*(np.where(flags.reshape(-1, *[1] * (a.ndim - 1)), b, a) for a, b in pairs))


def spots_in_windows(grey: np.ndarray, points_px: np.ndarray, far_px: np.ndarray, reach_px: np.ndarray) -> Spots:
    """Find the brightest spots of a picture (H, W) within ``far_px`` (N,) of points (N, 2).

    ``reach_px`` (N,) is how far from its brightest pixel a spot and the water around it go.
    """
    table = _spots(grey, np.ascontiguousarray(points_px), far_px.astype(np.int64), reach_px.astype(np.int64))
    return Spots(table[:, :2], table[:, 2], table[:, 3], table[:, 4], table[:, 5], table[:, 6:10], table[:, 10] > 0)


def reach_px_of(halves_px: np.ndarray) -> np.ndarray:
    """How far (N,) from a light's middle the water around it is."""
    return np.ceil(halves_px + np.maximum(3.0, halves_px))


@compiled
def _spots(grey: np.ndarray, points: np.ndarray, far: np.ndarray, reach: np.ndarray) -> np.ndarray:
    """Table (N, 11) of the numbers of ``Spots``."""
    height, width = grey.shape
    table = np.full((len(points), 11), np.nan)
    for light in range(len(points)):
        x, y = points[light]
        if not (-0.5 <= x < width - 0.5 and -0.5 <= y < height - 0.5):
            continue
        row, column = _brightest_peak(grey, int(np.rint(y)), int(np.rint(x)), far[light])
        if row >= 0:
            _fill(grey, row, column, reach[light], table[light])
    return table


@compiled
def _brightest_peak(grey: np.ndarray, row: int, column: int, far: int) -> tuple[int, int]:
    """Row and column of the brightest pixel in a circle that no neighbour outshines, as on another light's flank."""
    height, width = grey.shape
    top, bottom, left, right = window_at(grey, row, column, far)
    found_row, found_column, most = -1, -1, -1.0
    for y in range(top, bottom + 1):
        for x in range(left, right + 1):
            level = float(grey[y, x])
            if level <= most or (y - row) ** 2 + (x - column) ** 2 > far * far:
                continue
            is_peak = True
            for beside_y in range(max(0, y - 1), min(height, y + 2)):
                for beside_x in range(max(0, x - 1), min(width, x + 2)):
                    if grey[beside_y, beside_x] > grey[y, x]:
                        is_peak = False
            if is_peak:
                found_row, found_column, most = y, x, level
    return found_row, found_column


@compiled
def _fill(grey: np.ndarray, row: int, column: int, far: int, line: np.ndarray) -> None:
    """Fill in what is above half of a peak's height and touches it."""
    height, width = grey.shape
    top, bottom, left, right = window_at(grey, row, column, far)
    water, peak = median_along_edge(grey, top, bottom, left, right), float(grey[row, column])
    if peak <= water:
        return
    half = (water + peak) / 2
    pixels = joined(grey, row, column, np.nextafter(half, np.inf), (top, bottom), (left, right))
    total, sum_x, sum_y = 0.0, 0.0, 0.0
    for y, x in pixels:
        weight = grey[y, x] - half
        total, sum_x, sum_y = total + weight, sum_x + weight * (x - column), sum_y + weight * (y - row)
    rows, columns = pixels[:, 0], pixels[:, 1]
    box = columns.min(), rows.min(), columns.max(), rows.max()
    is_cut = box[0] == 0 or box[1] == 0 or box[2] == width - 1 or box[3] == height - 1
    steps = 0.0
    for x in range(left + 1, right + 1):
        steps += abs(float(grey[top, x]) - float(grey[top, x - 1]))
        steps += abs(float(grey[bottom, x]) - float(grey[bottom, x - 1]))
    line[0], line[1] = column + sum_x / total, row + sum_y / total
    line[2], line[3] = total / (peak - half), peak - water
    line[4] = NORMAL * steps / max(1, 2 * (right - left))
    line[5], line[10] = peak, is_cut
    for side in range(4):
        line[6 + side] = box[side]
