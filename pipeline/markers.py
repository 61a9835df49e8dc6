"""The groups of pixels that a threshold keeps, and where their centres are."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.thresholds.groups import lit_part
from pipeline.thresholds.histogram import Threshold

CENTROIDS = ("grey", "binary")


@dataclass(frozen=True)
class Markers:
    """Groups (8-connected components) at or above the threshold, in the order of their first rows.

    Attributes
    ----------
    points_px : (N, 2) their centres x, y.
    areas_px : (N,) how many pixels each has.
    dropped : how many groups were smaller than the minimum area.
    """

    points_px: np.ndarray
    areas_px: np.ndarray
    dropped: int = 0

    def __len__(self) -> int:
        return len(self.points_px)


def find_markers(
    grey: np.ndarray, levels: np.ndarray, threshold: Threshold, min_area_px: int, centroid: str = "grey"
) -> Markers:
    """Find the groups that ``threshold`` keeps.

    Parameters
    ----------
    grey : (H, W) uint8 or uint16 picture, whose values weigh the centres.
    levels : (H, W) uint8, the same on 256 levels.
    threshold : pixels at or above its level are kept.
    min_area_px : smaller groups are dropped and counted.
    centroid : "grey" weighs each pixel by how far it stands above the threshold, so that the edge of a group, where
        it was cut, counts for nothing; "binary" is the mass moment of the group, as in the paper.
    """
    rows, columns = lit_part(levels, threshold.level)
    if len(rows) == 0:
        return Markers(np.empty((0, 2)), np.empty(0, dtype=int))
    part = np.ix_(rows, columns)
    binary = cv2.threshold(levels[part], threshold.level - 0.5, 1, cv2.THRESH_BINARY)[1]
    count, labels, stats, _ = cv2.connectedComponentsWithStats(binary, connectivity=8)
    at_row, at_column = np.nonzero(labels)
    label = labels[at_row, at_column]
    if centroid == "grey":
        weight = grey[part][at_row, at_column].astype(float) - threshold.native_level + 0.5
    else:
        weight = np.ones(len(label))
    mass = np.bincount(label, weight, count)[1:]
    x = np.bincount(label, weight * columns[at_column], count)[1:] / mass
    y = np.bincount(label, weight * rows[at_row], count)[1:] / mass
    areas = stats[1:, cv2.CC_STAT_AREA].astype(int)
    kept = areas >= min_area_px
    return Markers(np.column_stack([x, y])[kept], areas[kept], int(np.count_nonzero(~kept)))
