"""Which spot of a picture is which light: one shift for all, then one map from a frame to the next."""

import math

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

_AROUND = 5  # cells to each side, of whose mean a light stands out
_FARTHER = 0.1  # of what all lights show, by which the farthest shift must be better than none
_MOST_PAIRS = 300  # of points that are tried
_LARGEST, _TURNED_RAD = 1.6, math.radians(40)  # between two frames: times as large, and turned
_ENOUGH_FOR_AFFINE = 6


def shifted(
    light: np.ndarray, guesses_px: list[np.ndarray], heights: np.ndarray, reach_px: float, cell_px: int
) -> np.ndarray:
    """Shift the best of some guesses (N, 2), by no more than a reach, to where lights of such heights (N,) stand out.

    A spot of the picture (H, W) counts as no brighter than its light.
    """
    across = [max(1, side // cell_px) for side in light.shape]
    cropped = light[: across[0] * cell_px, : across[1] * cell_px]
    cells = cv2.resize(cropped, (across[1], across[0]), interpolation=cv2.INTER_AREA).astype(np.float32)
    standing_out = cells - cv2.blur(cells, (2 * _AROUND + 1, 2 * _AROUND + 1))
    standing_out = cv2.dilate(np.maximum(standing_out, 0), np.ones((3, 3), np.uint8))
    steps = math.ceil(reach_px / cell_px)
    padded = np.pad(standing_out, steps)
    windows = sliding_window_view(padded, (2 * steps + 1, 2 * steps + 1))
    around = np.arange(-steps, steps + 1)
    nearer = 1 - _FARTHER * np.hypot(*np.meshgrid(around, around)) / max(1, steps)
    most, best = -1.0, guesses_px[0]
    for guess_px in guesses_px:
        columns, rows = np.floor((guess_px + 0.5) / cell_px).astype(int).T
        inside = (columns >= 0) & (columns < across[1]) & (rows >= 0) & (rows < across[0])
        if not inside.any():
            continue
        seen = np.minimum(windows[rows[inside], columns[inside]], heights[inside, None, None])
        score = (seen / heights[inside, None, None]).sum(axis=0) * nearer
        row, column = divmod(int(score.argmax()), 2 * steps + 1)
        if score[row, column] > most:
            most, best = score[row, column], guess_px + cell_px * (np.array([column, row]) - steps)
    return best


def mapped(before_px: np.ndarray, now_px: np.ndarray, within_px: float) -> tuple[np.ndarray, np.ndarray] | None:
    """Find a map (2, 3) that takes most of some points (N, 2) to where they are now, and which (N,) it does.

    NaN where one is not known. A similarity by two points is the start (Fischler and Bolles 1981); then, by all that
    it brings near enough, an affine map, or a similarity of few.
    """
    known = np.flatnonzero(np.isfinite(now_px).all(axis=1))
    if len(known) < 2:
        return None
    p, q = (points[known, 0] + 1j * points[known, 1] for points in (before_px, now_px))
    one, other = np.triu_indices(len(known), 1)
    one, other = (each[:: math.ceil(len(one) / _MOST_PAIRS)] for each in (one, other))
    apart = np.abs(p[one] - p[other]) > 0
    one, other = one[apart], other[apart]
    turn = (q[one] - q[other]) / (p[one] - p[other])
    size = np.abs(turn)
    likely = (size < _LARGEST) & (size > 1 / _LARGEST) & (np.abs(np.angle(turn)) < _TURNED_RAD)
    if not likely.any():
        return None
    turn, one = turn[likely, None], one[likely]
    off = np.abs(turn * (p - p[one, None]) + q[one, None] - q)
    worth = np.maximum(0, 1 - (off / within_px) ** 2).sum(axis=1)
    best = int(worth.argmax())
    near = off[best] < within_px
    found = np.zeros((2, 3))
    for _ in range(2):
        found = _fitted(before_px[known][near], now_px[known][near])
        off_px = np.linalg.norm(moved(found, before_px[known]) - now_px[known], axis=1)
        fitted, near = near, off_px < within_px
        if near.sum() < 2:
            return None
        if np.array_equal(near, fitted):
            break
    is_near = np.zeros(len(before_px), dtype=bool)
    is_near[known[near]] = True
    return found, is_near


def moved(by: np.ndarray, points_px: np.ndarray) -> np.ndarray:
    """Points (N, 2) moved by a map (2, 3)."""
    return points_px @ by[:, :2].T + by[:, 2]


def _fitted(before_px: np.ndarray, now_px: np.ndarray) -> np.ndarray:
    """Least squares: an affine map (2, 3), or a similarity where the points are few."""
    middle, to = before_px.mean(axis=0), now_px.mean(axis=0)
    p, q = before_px - middle, now_px - to
    if len(p) >= _ENOUGH_FOR_AFFINE:
        matrix = np.linalg.lstsq(p, q, rcond=1e-3)[0].T
    else:
        squares = max(float((p * p).sum()), 1e-12)
        a = float((p * q).sum()) / squares
        b = float((p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]).sum()) / squares
        matrix = np.array([[a, -b], [b, a]])
    return np.column_stack([matrix, to - matrix @ middle])
