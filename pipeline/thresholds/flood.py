"""Loops over single pixels, compiled by numba: which touch, what groups they form, and where those meet.

Pixels are a list in the order of the picture's rows; pairs of touching pixels are numbers in that list.
"""

from __future__ import annotations

import numpy as np
from dockpose.thresholds.compiled import compiled

LEVELS = 256


@compiled
def touching_pairs(index: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs (m,), (m,) of pixels that touch, also across corners, each pair once; ``index`` is row * width + column."""
    count = len(index)
    first, second = np.empty(4 * count, np.int32), np.empty(4 * count, np.int32)
    found, above = 0, 0
    for pixel in range(count):
        place = index[pixel]
        column = place % width
        if column > 0 and pixel > 0 and index[pixel - 1] == place - 1:
            first[found], second[found] = pixel - 1, pixel
            found += 1
        # Pixels of the row above are passed once: "above" is the first that is not left of all neighbours.
        while index[above] < place - width - 1:
            above += 1
        other = above
        while other < pixel and index[other] <= place - width + 1:
            step = index[other] % width - column
            if -1 <= step <= 1:
                first[found], second[found] = other, pixel
                found += 1
            other += 1
    return first[:found], second[:found]


@compiled
def _root(parent: np.ndarray, node: int) -> int:
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


@compiled
def _brightest_first(values: np.ndarray) -> np.ndarray:
    """Order (n,) of levels from bright to dark; equal ones keep their order."""
    start = np.zeros(LEVELS + 1, np.int64)
    for value in values:
        start[LEVELS - value] += 1
    start = np.cumsum(start)
    order = np.empty(len(values), np.int64)
    for number in range(len(values)):
        slot = LEVELS - 1 - values[number]
        order[start[slot]] = number
        start[slot] += 1
    return order


@compiled
def groups_at_every_level(
    level: np.ndarray, first: np.ndarray, second: np.ndarray, floor: int, min_area_px: int
) -> np.ndarray:
    """Number of groups of at least ``min_area_px`` pixels at every level (256,), -1 below the floor."""
    darker = np.minimum(level[first], level[second])
    pixels, pairs = _brightest_first(level), _brightest_first(darker)
    parent, area = np.arange(len(level)), np.ones(len(level), np.int64)
    counts = np.full(LEVELS, -1)
    groups, pixel, pair = 0, 0, 0
    for at in range(LEVELS - 1, floor - 1, -1):
        while pixel < len(pixels) and level[pixels[pixel]] == at:
            groups += min_area_px <= 1
            pixel += 1
        while pair < len(pairs) and darker[pairs[pair]] == at:
            one, other = _root(parent, first[pairs[pair]]), _root(parent, second[pairs[pair]])
            pair += 1
            if one == other:
                continue
            together = area[one] + area[other]
            groups += int(together >= min_area_px) - int(area[one] >= min_area_px) - int(area[other] >= min_area_px)
            parent[other] = one
            area[one] = together
        counts[at] = groups
    return counts


@compiled
def label_groups(count: int, first: np.ndarray, second: np.ndarray) -> tuple[int, np.ndarray]:
    """How many groups the pixels form, and the number (n,) of each one's, in the order of their first pixels."""
    parent = np.arange(count)
    for pair in range(len(first)):
        one, other = _root(parent, first[pair]), _root(parent, second[pair])
        parent[max(one, other)] = min(one, other)
    labels = np.empty(count, np.int64)
    groups = 0
    for pixel in range(count):
        root = _root(parent, pixel)
        if root == pixel:
            labels[pixel] = groups
            groups += 1
        else:
            labels[pixel] = labels[root]
    return groups, labels


@compiled
def group_shapes(
    index: np.ndarray, level: np.ndarray, labels: np.ndarray, count: int, width: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Areas (N,), mass moments (N, 2), boxes (N, 4: left, top, right, bottom) and brightest levels (N,) of groups."""
    areas, peaks = np.zeros(count, np.int64), np.zeros(count, np.int64)
    moments, boxes = np.zeros((count, 2)), np.empty((count, 4), np.int64)
    boxes[:, :2], boxes[:, 2:] = np.iinfo(np.int64).max, -1
    for pixel in range(len(index)):
        group = labels[pixel]
        y, x = index[pixel] // width, index[pixel] % width
        areas[group] += 1
        moments[group, 0] += x
        moments[group, 1] += y
        peaks[group] = max(peaks[group], level[pixel])
        boxes[group, 0], boxes[group, 1] = min(boxes[group, 0], x), min(boxes[group, 1], y)
        boxes[group, 2], boxes[group, 3] = max(boxes[group, 2], x), max(boxes[group, 3], y)
    for group in range(count):
        moments[group] /= max(areas[group], 1)
    return areas, moments, boxes, peaks


@compiled
def peaks_by_persistence(
    level: np.ndarray, first: np.ndarray, second: np.ndarray, mode: int, rise: float, rise_share: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Peaks of the picture that rise enough above where they meet a brighter one.

    Returns
    -------
    For each peak its level and the level of its highest saddle to another (-1 where it stands alone), and for each
    pixel the number (n,) of its peak. A peak rises enough if it does by ``rise``, and by ``rise_share`` of its height
    above ``mode``. Pixels are joined along the touching pairs, brightest first.
    """
    darker = np.minimum(level[first], level[second])
    parent, peak = np.arange(len(level)), level.copy()
    saddle, tree = np.full(len(level), -1), np.arange(len(level))
    pairs = _brightest_first(darker)
    for number in range(len(pairs)):
        pair = int(pairs[number])
        # A pair within one tree tells nothing new; trees join whether or not their peaks stay apart.
        one, other = _root(tree, first[pair]), _root(tree, second[pair])
        if one == other:
            continue
        tree[other] = one
        high, low = _root(parent, first[pair]), _root(parent, second[pair])
        if peak[high] < peak[low]:
            high, low = low, high
        at = darker[pair]
        if peak[low] - at < max(rise, rise_share * (peak[low] - mode)):
            parent[low] = high
            saddle[high] = max(saddle[high], saddle[low])
        else:
            saddle[high], saddle[low] = max(saddle[high], at), max(saddle[low], at)
    number_of = np.full(len(level), -1)
    member_of = np.empty(len(level), np.int64)
    count = 0
    for pixel in range(len(level)):
        root = _root(parent, pixel)
        if number_of[root] < 0:
            number_of[root] = count
            count += 1
        member_of[pixel] = number_of[root]
    tops, saddles = np.empty(count, np.int64), np.empty(count, np.int64)
    for pixel in range(len(level)):
        if number_of[pixel] >= 0:
            tops[number_of[pixel]], saddles[number_of[pixel]] = peak[pixel], saddle[pixel]
    return tops, saddles, member_of
