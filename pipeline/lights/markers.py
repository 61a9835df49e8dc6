"""The groups of pixels that a threshold keeps, and where their centres are."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from dockpose.lights.centroids import weighted_centres
from dockpose.thresholds.bright import BrightPixels
from dockpose.thresholds.flood import LEVELS, group_shapes
from dockpose.thresholds.histogram import Histogram, Threshold
from dockpose.thresholds.local import split_by_peaks

CENTROIDS = ("grey", "binary")
_LEAST_REACH_PX = 3  # around a group
_MOST_REACH_PX = 40
_FOOT = 0.2  # of a light's height above the water, below which it does not weigh
_MOST_MARKERS = 400  # of more, the largest are taken
# A group so many times as large as the middle one, and not tiny, may be two lights.
_MERGED_AREA, _LEAST_MERGED_PX = 1.7, 8


@dataclass(frozen=True)
class Markers:
    """Groups (8-connected components) of pixels that the threshold keeps.

    Attributes
    ----------
    points_px : (N, 2) their centres x, y.
    areas_px : (N,) how many pixels each has.
    peaks : (N,) grey level of the brightest pixel of each, 0..255.
    dropped : how many groups were smaller than the minimum area.
    boxes_px : (N, 4) left, top, right and bottom pixel of each.
    """

    points_px: np.ndarray
    areas_px: np.ndarray
    peaks: np.ndarray
    dropped: int = 0
    boxes_px: np.ndarray = field(default_factory=lambda: np.empty((0, 4), dtype=int))

    def __len__(self) -> int:
        return len(self.points_px)


def find_markers(
    grey: np.ndarray, histogram: Histogram, threshold: Threshold, min_area_px: int, centroid: str = "grey"
) -> Markers:
    """Find the groups that ``threshold`` keeps, two lights that run together split where that shows.

    Parameters
    ----------
    grey : (H, W) uint8 or uint16 picture, whose values weigh the centres.
    histogram : of the same picture.
    threshold : pixels at or above its level are kept, or those that it lists.
    min_area_px : smaller groups are dropped and counted.
    centroid : "grey" weighs the light around a group by how far it stands above the water there, see
        :func:`grey_centres`; "binary" is the mass moment of the group, as in the paper.
    """
    if threshold.kept is not None:
        pixels, labels = threshold.kept
        count = int(labels.max()) + 1
    elif threshold.level < LEVELS and not (pixels := histogram.bright(threshold.level)).is_empty:
        count, labels = _split_merged(pixels, *pixels.groups())
    else:
        return _no_markers()
    areas, points, boxes, peaks = group_shapes(pixels.index, pixels.level, labels, count, pixels.width)
    kept = areas >= min_area_px
    dropped = int(np.count_nonzero(~kept))
    if count - dropped > _MOST_MARKERS:
        kept &= areas >= np.sort(areas)[-_MOST_MARKERS]
    if not kept.any():
        return _no_markers(dropped)
    points, boxes = points[kept], boxes[kept]
    if centroid == "grey":
        points = grey_centres(grey, boxes, points)
    return Markers(points, areas[kept], peaks[kept], dropped, boxes)


def _no_markers(dropped: int = 0) -> Markers:
    return Markers(np.empty((0, 2)), np.empty(0, dtype=int), np.empty(0, dtype=int), dropped)


def _split_merged(pixels: BrightPixels, count: int, labels: np.ndarray) -> tuple[int, np.ndarray]:
    """Give the parts of groups that hold several separate peaks numbers of their own."""
    if count < 2:
        return count, labels
    areas = np.bincount(labels, minlength=count)
    middle = sorted(areas.tolist())[count // 2]
    suspects = np.flatnonzero((areas > _MERGED_AREA * middle) & (areas >= _LEAST_MERGED_PX))
    if len(suspects) == 0 or len(suspects) > count / 2:
        return count, labels
    labels = labels.copy()
    for suspect in suspects:
        members = np.flatnonzero(labels == suspect)
        part = BrightPixels(pixels.floor, pixels.width, pixels.index[members], pixels.level[members])
        parts = split_by_peaks(part)
        for number in range(1, int(parts.max()) + 1):
            labels[members[parts == number]] = count
            count += 1
    return count, labels


def grey_centres(grey: np.ndarray, boxes: np.ndarray, points_px: np.ndarray) -> np.ndarray:
    """Centres (N, 2) of lights, by the grey values that stand out of the water around them.

    Parameters
    ----------
    grey : (H, W) picture.
    boxes : (N, 4) left, top, right and bottom of their groups, in pixels.
    points_px : (N, 2) rough centres; pixels nearer to another one do not count.

    Notes
    -----
    The window reaches well beyond the group, so that where the threshold cut it plays no part, nor do saturated
    middles: the flanks weigh in. The water is the median along the window's edge; what stands less than a fifth of the
    light's height above it is left out, because noise far from the middle would pull the most.
    """
    size = np.maximum(boxes[:, 2] - boxes[:, 0], boxes[:, 3] - boxes[:, 1]) + 1
    half = (size + 1) // 2
    reach = np.minimum(half + np.maximum(_LEAST_REACH_PX, half), _MOST_REACH_PX)
    return weighted_centres(grey, points_px, reach, _FOOT)
