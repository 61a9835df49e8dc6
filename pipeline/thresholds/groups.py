"""Counting the groups (8-connected components) that a level leaves, at many levels cheaply."""

from __future__ import annotations

import cv2
import numpy as np

from pipeline.thresholds.histogram import LEVELS


def lit_part(levels: np.ndarray, floor: int) -> tuple[np.ndarray, np.ndarray]:
    """Rows and columns that have a pixel at or above ``floor``, and the one after each of them.

    ``levels[np.ix_(rows, columns)]`` has the same groups as the whole picture at ``floor`` and above: whatever
    touched still touches, whatever was apart is still apart. It is far smaller where little is lit.
    """
    bright = cv2.threshold(levels, floor - 0.5, 1, cv2.THRESH_BINARY)[1]
    rows = cv2.reduce(bright, 1, cv2.REDUCE_MAX).ravel()
    columns = cv2.reduce(bright, 0, cv2.REDUCE_MAX).ravel()
    return _and_next(rows), _and_next(columns)


def count_groups(levels: np.ndarray, floor: int, ceiling: int, min_area_px: int) -> np.ndarray:
    """Number of groups of at least ``min_area_px`` pixels at every level from ``floor`` to ``ceiling``.

    Returns
    -------
    (256,) counts, -1 outside that span.
    """
    counts = np.full(LEVELS, -1)
    part = levels[np.ix_(*lit_part(levels, floor))]
    if part.size == 0:
        counts[floor : ceiling + 1] = 0
        return counts
    present = np.bincount(part.ravel(), minlength=LEVELS) > 0
    previous = 0
    for level in range(ceiling, floor - 1, -1):
        # A level that no pixel has leaves the same groups as the level above it.
        if present[level] or level == ceiling:
            binary = cv2.threshold(part, level - 0.5, 1, cv2.THRESH_BINARY)[1]
            _, _, stats, _ = cv2.connectedComponentsWithStats(binary, connectivity=8)
            previous = int(np.count_nonzero(stats[1:, cv2.CC_STAT_AREA] >= min_area_px))
        counts[level] = previous
    return counts


def _and_next(occupied: np.ndarray) -> np.ndarray:
    """Indices of the occupied places and of the one after each."""
    keep = occupied > 0
    keep[1:] |= keep[:-1].copy()
    return np.flatnonzero(keep)
