"""The groups of pixels that a threshold keeps, and where their centres are."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from pipeline.thresholds.groups import lit_part
from pipeline.thresholds.histogram import Threshold

CENTROIDS = ("grey", "binary")
_LEAST_REACH_PX = 3  # around a group
_FOOT = 0.2  # of a light's height above the water, below which it does not weigh


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
    centroid : "grey" weighs the light around a group by how far it stands above the water there, see
        :func:`grey_centre`; "binary" is the mass moment of the group, as in the paper.
    """
    rows, columns = lit_part(levels, threshold.level)
    if len(rows) == 0:
        return Markers(np.empty((0, 2)), np.empty(0, dtype=int))
    binary = cv2.threshold(levels[np.ix_(rows, columns)], threshold.level - 0.5, 1, cv2.THRESH_BINARY)[1]
    _, _, stats, centres = cv2.connectedComponentsWithStats(binary, connectivity=8)
    areas = stats[1:, cv2.CC_STAT_AREA].astype(int)
    kept = areas >= min_area_px
    boxes = _boxes_in_picture(stats[1:][kept], rows, columns)
    # The lit part leaves out rows and columns between groups, never inside one.
    points = boxes[:, :2] + (centres[1:][kept] - stats[1:][kept, :2])
    if centroid == "grey":
        points = np.array([grey_centre(grey, box, points) for box in boxes]).reshape(-1, 2)
    return Markers(points, areas[kept], int(np.count_nonzero(~kept)))


def grey_centre(grey: np.ndarray, box: np.ndarray, centres_px: np.ndarray) -> np.ndarray:
    """Centre (2,) of a light, by the grey values that stand out of the water around it.

    Parameters
    ----------
    grey : (H, W) picture.
    box : (4,) left, top, width and height of its group, in pixels.
    centres_px : (N, 2) rough centres of all groups; pixels nearer to another one do not count.

    Notes
    -----
    The window reaches well beyond the group, so that where the threshold cut it plays no part, nor do saturated
    middles: the flanks weigh in. The water is the median along the window's edge; what stands less than a fifth of the
    light's height above it is left out, because noise far from the middle would pull the most.
    """
    left, top, width, height = (int(value) for value in box)
    reach = max(_LEAST_REACH_PX, (max(width, height) + 1) // 2)
    y0, y1 = max(0, top - reach), min(grey.shape[0], top + height + reach)
    x0, x1 = max(0, left - reach), min(grey.shape[1], left + width + reach)
    window = grey[y0:y1, x0:x1].astype(float)
    water = np.median(np.concatenate([window[0], window[-1], window[:, 0], window[:, -1]]))
    weight = window - (
        water + _FOOT * (window[top - y0 : top - y0 + height, left - x0 : left - x0 + width].max() - water)
    )
    own = np.argmin(np.hypot(*(centres_px - [left + (width - 1) / 2, top + (height - 1) / 2]).T))
    x, y = np.arange(x0, x1), np.arange(y0, y1)[:, None]
    for other in np.flatnonzero(np.abs(centres_px - centres_px[own]).max(axis=1) < 2 * (reach + max(width, height))):
        if other != own:
            middle, towards = (centres_px[own] + centres_px[other]) / 2, centres_px[other] - centres_px[own]
            weight = np.where((x - middle[0]) * towards[0] + (y - middle[1]) * towards[1] > 0, 0.0, weight)
    weight = np.maximum(weight, 0.0)
    total = weight.sum()
    if total <= 0:
        return centres_px[own]
    return np.array([(weight * x).sum() / total, (weight * y).sum() / total])


def _boxes_in_picture(stats: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Left, top, width and height (N, 4) of groups of the lit part, in the picture."""
    boxes = stats[:, : cv2.CC_STAT_AREA].copy()
    boxes[:, 0], boxes[:, 1] = columns[stats[:, 0]], rows[stats[:, 1]]
    return boxes
