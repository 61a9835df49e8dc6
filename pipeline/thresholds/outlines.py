"""Lights by their outlines: where edges all around point to a middle, which lights that run together keep.

After the radial symmetry of Loy and Zelinsky (2003, section 3): each pixel of an edge votes for the places that lie a
radius away, towards the bright side; of many votes from all around one place becomes the middle of a disc.
"""

import math
from collections.abc import Iterator
from dataclasses import replace

import cv2
import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at
from dockpose.thresholds.scales import are_highest, grey_of, halved, pixels_of

# Radii of discs: each the root of two times the one before, so that a disc is within a fifth of one. Of larger discs
# the picture is halved, so that they have one of the last two.
_RADII_PX, _LAST = (2.0, 2.8, 4.0, 5.6), 2
_WIDEST_SHARE = 1 / 12  # of the picture's shorter side, as radius: three such discs beside each other fill half of it
_VOTES = np.array([0.87, 1.0, 1.15])  # radii: from one disc to the next, either way, no farther apart than votes spread
_BLUR_PX = 0.8  # of the picture, as the finest scale
_CLEAR_NOISE = 5.0  # standard deviations of a slope: one in a million, of which a quarter of a circle would be needed
_LEAST_SLOPE = 0.3  # levels per pixel, below which rounding to levels makes slopes
_SPREAD = 1 / 6  # of a radius, by which votes for one middle are off
_LEAST_SHARE = 0.25  # of a disc's outline that must be seen: a lamp half hidden by two others shows as much
_APART = 0.6  # of a radius: middles that are nearer are one
_OWN = 0.7  # of a radius, within which pixels are the disc's
_FEWEST = 4  # fewer make no ring
_MOST_LIGHTS = 60  # of one radius: the clearest


def by_outlines(histogram: Histogram, min_area_px: int) -> Iterator[Threshold]:
    """Find the discs of each radius, from small to large; radii with too few for a ring are passed over."""
    grey, shrink = grey_of(histogram)
    if grey.min() == grey.max():  # as behind a lens cap
        return
    levels, widest_px, first = grey.astype(np.float32), _WIDEST_SHARE * min(histogram.levels.shape), 0
    while _RADII_PX[first] * shrink <= widest_px:
        edges = _edges(levels)
        for radius_px in _RADII_PX[first:]:
            is_wanted = radius_px * shrink <= widest_px and len(edges) > _FEWEST * _LEAST_SHARE * math.tau * radius_px
            middles = _middles(levels.shape, edges, radius_px) if is_wanted else np.empty((0, 2))
            if len(middles) >= _FEWEST:
                found = _groups(histogram, (middles + 0.5) * shrink - 0.5, radius_px * shrink, min_area_px)
                if found is not None:
                    yield found
        levels, shrink, first = halved(levels), 2 * shrink, _LAST


def _edges(levels: np.ndarray) -> np.ndarray:
    """Places and directions (n, 4) of what is an edge of a picture (h, w): x, y, and the unit vector uphill."""
    blurred = cv2.GaussianBlur(levels, (0, 0), _BLUR_PX)
    across, down = (cv2.Sobel(blurred, cv2.CV_32F, *of, ksize=3, scale=1 / 8) for of in ((1, 0), (0, 1)))
    step = max(1, round(math.sqrt(levels.size / 20_000)))
    noise = float(np.median(np.abs(across[::step, ::step]))) / 0.6745
    slope = cv2.magnitude(across, down)
    return _crests(slope, across, down, max(_CLEAR_NOISE * noise, _LEAST_SLOPE))


@compiled
def _crests(slope: np.ndarray, across: np.ndarray, down: np.ndarray, least: float) -> np.ndarray:
    """Pixels (n, 4) where a slope is steepest along its own direction, and that direction."""
    height, width = slope.shape
    found = np.empty((slope.size, 4), np.float32)
    count = 0
    for row in range(2, height - 2):
        for column in range(2, width - 2):
            steep = slope[row, column]
            if steep <= least:
                continue
            x, y = across[row, column] / steep, down[row, column] / steep
            if steep < _between(slope, column + x, row + y) or steep <= _between(slope, column - x, row - y):
                continue
            found[count, 0], found[count, 1], found[count, 2], found[count, 3] = column, row, x, y
            count += 1
    return found[:count].copy()


@compiled_bare
def _between(values: np.ndarray, x: float, y: float) -> float:
    """Value between four pixels."""
    column, row = int(x), int(y)
    right, below = x - column, y - row
    upper = (1 - right) * values[row, column] + right * values[row, column + 1]
    lower = (1 - right) * values[row + 1, column] + right * values[row + 1, column + 1]
    return (1 - below) * upper + below * lower


def _middles(shape: tuple[int, int], edges: np.ndarray, radius_px: float) -> np.ndarray:
    """Middles (N, 2) of discs of which enough of the outline is seen, the clearest first."""
    spread_px, margin = max(_BLUR_PX, _SPREAD * radius_px), math.ceil(_VOTES[-1] * radius_px) + 1
    # All middles are in that part of the picture in which there are edges.
    (left, right), (top, bottom) = (
        (max(int(each.min()) - margin, 0), min(int(each.max()) + margin + 1, most))
        for each, most in zip(edges.T[:2], shape[::-1], strict=True)
    )
    votes = np.zeros((bottom - top, right - left), np.float32)
    _vote(votes, edges, left, top, radius_px * _VOTES)
    # A whole outline's votes, spread by the blur and by their own distances, make this height.
    off_px = radius_px * (_VOTES - 1)
    whole = radius_px / spread_px**2 * float(np.exp(-(off_px**2) / 2 / spread_px**2).mean())
    share = cv2.GaussianBlur(votes, (0, 0), spread_px)
    share /= np.float32(whole)
    reach = math.ceil(_APART * radius_px)
    near = np.argwhere(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * reach + 1, 2 * reach + 1))) - reach
    clear = np.flatnonzero(share > _LEAST_SHARE)
    rows, columns = np.divmod(clear[are_highest(share, clear, near)], votes.shape[1])
    order = np.argsort(-share[rows, columns], kind="stable")[:_MOST_LIGHTS]
    rows, columns = rows[order], columns[order]
    tops = np.column_stack([columns + _top(share, rows, columns, 0, 1), rows + _top(share, rows, columns, 1, 0)])
    return tops + [left, top]


def _top(values: np.ndarray, rows: np.ndarray, columns: np.ndarray, down: int, right: int) -> np.ndarray:
    """How far (N,) from a highest pixel the top of the parabola through it and its neighbours is."""
    before, here, after = (values[rows + k * down, columns + k * right] for k in (-1, 0, 1))
    return (after - before) / (2 * np.maximum(2 * here - before - after, 1e-9))


@compiled_bare
def _vote(votes: np.ndarray, edges: np.ndarray, left: int, top: int, distances_px: np.ndarray) -> None:
    """Add one vote of each edge (n, 4), shared by its distances, to the pixels around where these lead."""
    height, width = votes.shape
    each = 1 / len(distances_px)
    for number in range(len(edges)):
        for distance in distances_px:
            x = edges[number, 0] - left + distance * edges[number, 2]
            y = edges[number, 1] - top + distance * edges[number, 3]
            column, row = math.floor(x), math.floor(y)
            if not (0 <= column < width - 1 and 0 <= row < height - 1):
                continue
            right, below = each * (x - column), y - row
            votes[row, column] += (1 - below) * (each - right)
            votes[row, column + 1] += (1 - below) * right
            votes[row + 1, column] += below * (each - right)
            votes[row + 1, column + 1] += below * right


def _groups(histogram: Histogram, middles_px: np.ndarray, radius_px: float, min_area_px: int) -> Threshold | None:
    """Threshold by the discs around middles (N, 2), whose pixels are those near each; None of none."""
    height, width = histogram.levels.shape
    reach = math.ceil(_OWN * radius_px)
    y, x = np.mgrid[-reach : reach + 1, -reach : reach + 1]
    off = np.column_stack([x.ravel(), y.ravel()])[np.hypot(x, y).ravel() <= max(1.0, _OWN * radius_px)]
    columns, rows = (np.round(middles_px).astype(int)[:, None] + off).reshape(-1, 2).T
    light = np.repeat(np.arange(len(middles_px)), len(off))
    inside = (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    # A pixel that two discs share belongs to the clearer, which comes first.
    index, first = np.unique((rows * width + columns)[inside], return_index=True)
    listed = pixels_of(histogram, index, light[inside][first], min_area_px)
    if listed is None:
        return None
    groups, numbers = listed
    reason = f"{len(numbers)} discs {2 * radius_px:.3g} pixels wide stand out by their outlines."
    groups = replace(groups, centres_px=middles_px[numbers])
    return threshold_at("hats_local", histogram, groups.pixels.floor, reason, groups)
