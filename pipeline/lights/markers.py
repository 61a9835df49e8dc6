"""The groups of pixels that a threshold keeps, and where their centres are."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace

import numpy as np
from dockpose.lights.centroids import weighted_centres
from dockpose.lights.ellipse import NoEllipseError, fit_ellipse
from dockpose.lights.likelihood import fitted_centres
from dockpose.pixels.bright import SATURATED, BrightPixels, PixelGroups, SquareGroups, coarsen, squares_of
from dockpose.pixels.flood import LEVELS, group_shapes, outline
from dockpose.thresholds.histogram import Histogram, Threshold
from dockpose.thresholds.local import ENOUGH_PX, split_by_peaks

CENTROIDS = ("grey", "binary")
_LEAST_REACH_PX = 3  # around a group
_MOST_REACH_PX = 40  # for time, which grows with its square
_FOOT = 0.2  # of a light's height above the water, below which it does not weigh
_MOVED_PX, _MOVED = 2.0, 0.5  # off a group's centroid and, as a share, its radius: what is fitted is a glow near by
_ENOUGH_FITTED = 5  # of a ring's lights, or half of them: others then weigh little
_MOST_MARKERS = 400  # of more, the largest are taken
# A group so many times as large as the middle one, and not tiny, may be two lights.
_MERGED_AREA, _LEAST_MERGED_PX = 1.7, 8
# So may one that fills little of its box: a disc fills 0.79.
_LEAST_FILL = 0.6
_MOST_SUSPECTS = 100  # of more, the picture is speckled rather than lights merged
# Pixels beyond which squares do, and squares that an outline is taken of, for time.
_MANY_PIXELS, _MOST_OUTLINED = 100_000, 50_000
# A cut group of so many pixels, so many of them saturated, is centred by its outline; it needs so much of it.
_LEAST_FLAT_PX, _FLAT_SHARE, _LEAST_OUTLINE_PX = 150, 0.5, 12


@dataclass(frozen=True)
class Markers:
    """Groups (8-connected components) of pixels that the threshold keeps."""

    points_px: np.ndarray  # (N, 2): their centres x, y
    areas_px: np.ndarray  # (N,): how many pixels each has
    peaks: np.ndarray  # (N,): grey level of the brightest pixel of each, 0..255
    dropped: int = 0  # how many groups were smaller than the minimum area
    # (N, 4): left, top, right and bottom pixel of each
    boxes_px: np.ndarray = field(default_factory=lambda: np.empty((0, 4), dtype=int))
    # (N,): which the picture's edge cuts so that the place of their centres is not known
    cut: np.ndarray = field(default_factory=lambda: np.empty(0, dtype=bool))
    left_out: int = 0  # how many groups of at least the minimum area are not among these, since there were too many
    # (N, 2, 2) of the centres that were fitted, NaN of others, and (N, 2) where all were before; None where none was
    covariances_px2: np.ndarray | None = None
    centroids_px: np.ndarray | None = None
    # (N, 6) of those that were fitted, as dockpose.lights.likelihood has them, of a height of 0 of others
    shapes: np.ndarray | None = None

    def __len__(self) -> int:
        return len(self.points_px)

    @property
    def seen(self) -> int:
        """How many groups of at least the minimum area there are in all."""
        return len(self) + self.left_out

    @property
    def unfitted(self) -> Markers:
        """The groups as a threshold shows them, before any of their centres was fitted."""
        if self.centroids_px is None:
            return self
        return replace(self, points_px=self.centroids_px, covariances_px2=None, centroids_px=None, shapes=None)

    def part(self, chosen: np.ndarray) -> Markers:
        """Return the groups that are chosen by a flag (N,) for each."""
        every = {name: value for name, value in vars(self).items() if isinstance(value, np.ndarray) and len(value)}
        return replace(self, **{name: value[chosen] for name, value in every.items()})


def find_markers(
    grey: np.ndarray, histogram: Histogram, threshold: Threshold, min_area_px: int, centroid: str = "grey"
) -> Markers:
    """Find the groups that a threshold keeps, and weigh their centres in ``grey`` (H, W)."""
    if threshold.leaves_glare:
        histogram = histogram.without_glare
    groups = threshold.groups or _groups(histogram, threshold.level)
    if groups is None:
        return _no_markers()
    count = groups.count
    areas, points, boxes, peaks, saturated = groups.shapes()
    kept = areas >= min_area_px
    dropped = int(np.count_nonzero(~kept))
    if count - dropped > _MOST_MARKERS:
        # Of those of equal size the brighter ones, and in the end the first.
        order = np.lexsort((-peaks, -areas))
        kept[order[_MOST_MARKERS:]] = False
    if not kept.any():
        return _no_markers(dropped)
    height, width = histogram.levels.shape
    cut = np.any(np.hstack([boxes[:, :2] <= 0, boxes[:, 2:] >= [width - 1, height - 1]]), axis=1)
    if isinstance(groups, PixelGroups) and groups.centres_px is not None:
        points = groups.centres_px[kept]
    elif centroid == "grey":
        size = (boxes[:, 2:] - boxes[:, :2]).max(axis=1) + 1
        is_large = size > _MOST_REACH_PX
        is_flat = (areas >= _LEAST_FLAT_PX) & ((saturated >= _FLAT_SHARE * areas) | is_large)
        flat, is_outlined = _flat_centres(groups, areas, is_flat, is_large, points, height)
        cut &= ~is_outlined
        is_known = np.isfinite(flat[kept, 0])
        points = np.where(is_known[:, None], flat[kept], grey_centres(grey, boxes[kept], points[kept], ~is_known))
    else:
        points = points[kept]
    more = max(0, count - dropped - _MOST_MARKERS)
    return Markers(points, areas[kept], peaks[kept], dropped, boxes[kept], cut[kept], more)


def _no_markers(dropped: int = 0) -> Markers:
    return Markers(np.empty((0, 2)), np.empty(0, dtype=int), np.empty(0, dtype=int), dropped)


def _groups(histogram: Histogram, level: int) -> PixelGroups | SquareGroups | None:
    """The groups of the pixels at or above a level; of very many as a smaller picture shows them, None of none."""
    if level >= LEVELS:
        return None
    if histogram.is_lit(level):
        return _groups_of_squares(histogram, level)
    pixels = histogram.bright(level)
    if pixels.is_empty:
        return None
    if len(pixels) > _MANY_PIXELS and histogram.in_squares(ENOUGH_PX)[1] > 1:
        found = _groups_of_squares(histogram, level)
        group_of = found.group_at.ravel()[squares_of(pixels.index, pixels.width, found.side)]
        return PixelGroups(pixels, group_of, found.count)
    count, group_of = _split_merged(histogram, pixels, *pixels.groups())
    return PixelGroups(pixels, group_of, count)


def _groups_of_squares(histogram: Histogram, level: int) -> SquareGroups:
    smaller, side = histogram.in_squares(ENOUGH_PX)
    squares = smaller.bright(level)
    count, labels = _split_merged(smaller, squares, *squares.groups())
    group_at = np.full(smaller.levels.shape, -1, np.int32)
    group_at.ravel()[squares.index] = labels
    return SquareGroups(histogram.levels, side, group_at, np.full(count, level))


def _split_merged(histogram: Histogram, pixels: BrightPixels, count: int, labels: np.ndarray) -> tuple[int, np.ndarray]:
    """Give the parts of groups that hold several separate peaks numbers of their own."""
    areas, _, boxes, *_ = group_shapes(pixels.index, pixels.level, labels, count, pixels.width, SATURATED)
    fill = areas / ((boxes[:, 2] - boxes[:, 0] + 1) * (boxes[:, 3] - boxes[:, 1] + 1))
    middle = np.sort(areas)[count // 2]
    large = (areas > _MERGED_AREA * middle) | ((fill < _LEAST_FILL) & (areas >= _LEAST_FLAT_PX))
    suspects = np.flatnonzero(large & (areas >= _LEAST_MERGED_PX))
    if len(suspects) == 0 or len(suspects) > _MOST_SUSPECTS:
        return count, labels
    members = np.flatnonzero(np.isin(labels, suspects))
    part = BrightPixels(pixels.floor, pixels.width, pixels.index[members], pixels.level[members])
    parts = split_by_peaks(part, histogram)
    # Parts never span groups; the first of each keeps the group's number.
    first = np.unique(parts, return_index=True)[1]
    number = labels[members][first]
    extra = np.delete(np.arange(len(number)), np.unique(number, return_index=True)[1])
    number[extra] = np.arange(count, count + len(extra))
    labels = labels.copy()
    labels[members] = number[parts]
    return count + len(extra), labels


def _flat_centres(
    groups: PixelGroups | SquareGroups,
    areas: np.ndarray,
    is_flat: np.ndarray,
    is_large: np.ndarray,
    points_px: np.ndarray,
    height: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Centres (N, 2) of flat groups that are too large for a window, or that others or an edge cut; nan for others.

    And which (N,) are known by their outlines, which follow an ellipse to a pixel.
    """
    centres, is_outlined = np.full((len(areas), 2), np.nan), np.zeros(len(areas), dtype=bool)
    if not is_flat.any():
        return centres, is_outlined
    index, labels, width = groups.squares()
    side, more = groups.side, math.ceil(math.sqrt(len(index) / _MOST_OUTLINED))
    if more > 1:
        index, labels, _, width = coarsen(index, labels, width, more)
        side *= more
    on_outline, is_cut = outline(index, labels, width, -(-height // side))
    cut = np.bincount(labels, is_cut, len(areas)) > 0
    by_pixels = is_flat & (cut | is_large)
    centres[by_pixels] = points_px[by_pixels]
    y, x = np.divmod(index[on_outline], width)
    of = labels[on_outline]
    for group in np.flatnonzero(is_flat & cut):
        points = np.column_stack([x[of == group], y[of == group]])
        if len(points) < _LEAST_OUTLINE_PX:
            continue
        try:
            ellipse = fit_ellipse(points)
        except NoEllipseError:
            continue
        major, minor = ellipse.semi_axes_px
        if minor > 0.5 * major and side**2 * 4 * major * minor < 8 * areas[group]:
            (across, down), is_exact = ellipse.centre_px, ellipse.rms_px < 1
            centres[group] = np.multiply(ellipse.centre_px, side) + (side - 1) / 2
            is_outlined[group] = is_exact and 0 <= across < width and 0 <= side * down < height
    return centres, is_outlined


def grey_centres(
    grey: np.ndarray, boxes: np.ndarray, points_px: np.ndarray, wanted: np.ndarray | bool = True
) -> np.ndarray:
    """Centres (N, 2) of lights in boxes (N, 4), by the grey values that stand out of the water around those wanted."""
    return weighted_centres(grey, points_px, np.where(wanted, np.minimum(_reach(boxes), _MOST_REACH_PX), 0), _FOOT)


def _reach(boxes: np.ndarray) -> np.ndarray:
    """How many pixels (N,) to each side of a light are its window, by its box (N, 4)."""
    half = ((boxes[:, 2:] - boxes[:, :2]).max(axis=1) + 2) // 2
    return half + np.maximum(_LEAST_REACH_PX, half)


def with_fitted_centres(
    markers: Markers,
    chosen: np.ndarray,
    grey: np.ndarray,
    white: float,
    middle_px: tuple[float, float],
    corner_px: tuple[int, int] = (0, 0),
) -> Markers:
    """Fit the centres of those chosen by a flag (N,) in a part of the picture (H, W), saturated from ``white`` on.

    ``middle_px`` is the lens's in the whole picture, and ``corner_px`` where the part begins. Unless enough are fitted,
    all keep their centroids. The shapes that the markers have are those to begin with.
    """
    reach, start = np.where(chosen, _reach(markers.boxes_px), 0), markers.points_px - corner_px
    middle, far_px = np.subtract(middle_px, corner_px), max(1.0, math.hypot(*middle_px))
    shapes = np.zeros((len(markers), 6)) if markers.shapes is None else markers.shapes.copy()
    found, covariances = fitted_centres(grey, start, reach, float(white), middle, far_px, shapes)
    is_elsewhere = np.hypot(*(found - start).T) > np.maximum(_MOVED_PX, _MOVED * np.sqrt(markers.areas_px / math.pi))
    found[is_elsewhere], covariances[is_elsewhere] = start[is_elsewhere], np.nan
    is_fitted = (found != start).any(axis=1)
    if is_fitted.sum() <= min(_ENOUGH_FITTED, chosen.sum() / 2):
        return markers
    unknown = chosen & ~np.isfinite(covariances).all(axis=(1, 2))  # but for being in their groups, as if in discs
    covariances[unknown] = markers.areas_px[unknown, None, None] / (4 * math.pi) * np.eye(2)
    points = np.where(chosen[:, None], found + corner_px, markers.points_px)
    centroids_px = markers.points_px
    return replace(markers, points_px=points, covariances_px2=covariances, centroids_px=centroids_px, shapes=shapes)
