"""Loops over single pixels, compiled by numba: which touch, what groups they form, and where those meet."""

from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled, compiled_bare

LEVELS = 256  # that the histogram has, whatever the bits
NEIGHBOURS = 8  # of a pixel, across corners too


@compiled
def touching(index: np.ndarray, width: int) -> np.ndarray:
    """Numbers (n, 8) of the pixels that touch each, also across corners; -1 where there is none."""
    count = len(index)
    beside = np.full((count, NEIGHBOURS), -1, np.int32)
    above, row_starts = 0, -width
    for pixel in range(count):
        place = index[pixel]
        if place >= row_starts + width:
            row_starts = place - place % width
        if pixel > 0 and place > row_starts and index[pixel - 1] == place - 1:
            beside[pixel, 0], beside[pixel - 1, 7] = pixel - 1, pixel
        # Pixels of the row above are passed once: "above" is the first that is not left of all neighbours.
        first = max(place - width - 1, row_starts - width)
        last = min(place - width + 1, row_starts - 1)
        while index[above] < first:
            above += 1
        other = above
        while index[other] <= last:
            slot = index[other] - place + width + 2
            beside[pixel, slot], beside[other, 7 - slot] = other, pixel
            other += 1
    return beside


@compiled_bare
def root_of(parent: np.ndarray, node: int) -> int:
    """The root of the tree that a node is in; the path to it becomes shorter."""
    while parent[node] != node:
        parent[node] = parent[parent[node]]
        node = parent[node]
    return node


@compiled
def brightest_first(values: np.ndarray) -> np.ndarray:
    """Order (n,) of whole numbers from large to small; equal ones keep their order."""
    top, bottom = values[0], values[0]
    for value in values:
        top, bottom = max(top, value), min(bottom, value)
    start = np.zeros(top - bottom + 2, np.int64)
    for value in values:
        start[top - value + 1] += 1
    for place in range(1, len(start)):
        start[place] += start[place - 1]
    order = np.empty(len(values), np.int32)
    for number in range(len(values)):
        slot = top - values[number]
        order[start[slot]] = number
        start[slot] += 1
    return order


@compiled
def count_groups(
    level: np.ndarray,
    index: np.ndarray,
    width: int,
    floor: int,
    min_area_px: int,
    most_area_px: int,
    rise: float,
    saturated: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Number of all groups at every level, and of those that a person would count; (256,) each, -1 below the floor."""
    count = len(level)
    beside = touching(index, width)
    parent, area, seen = np.empty(count, np.int32), np.empty(count, np.int32), np.empty(count, np.bool_)
    # The level from which down a group has the least area, and more than the most.
    enough, too_much = np.empty(count, np.int32), np.empty(count, np.int32)
    for pixel in range(count):
        parent[pixel], area[pixel], enough[pixel], too_much[pixel], seen[pixel] = pixel, 1, -1, -1, False
    # What each level adds to the number of the level above.
    more, more_real = np.zeros(LEVELS + 1, np.int64), np.zeros(LEVELS + 1, np.int64)
    for pixel in brightest_first(level):
        seen[pixel] = True
        at, own = np.int64(level[pixel]), np.int64(pixel)
        if min_area_px <= 1:
            enough[own] = at
        for number in range(NEIGHBOURS):
            other = np.int64(beside[pixel, number])
            if other < 0 or not seen[other]:
                continue
            other = root_of(parent, other)
            if other == own:
                continue
            # A root is its group's first, so brightest, pixel.
            high, low = (other, own) if level[other] >= level[own] else (own, other)
            _count_one(more, more_real, level[low], enough[low], too_much[low], at, rise, saturated)
            parent[low] = high
            area[high] += area[low]
            if enough[high] < 0 and area[high] >= min_area_px:
                enough[high] = at
            if too_much[high] < 0 and area[high] > most_area_px:
                too_much[high] = at
            own = high
    for pixel in range(count):
        if parent[pixel] == pixel:
            _count_one(more, more_real, level[pixel], enough[pixel], too_much[pixel], floor - 1, rise, saturated)
    counts, real = np.zeros(LEVELS, np.int64), np.zeros(LEVELS, np.int64)
    groups, real_groups = 0, 0
    for at in range(floor):
        counts[at] = real[at] = -1
    for at in range(LEVELS - 1, floor - 1, -1):
        groups += more[at]
        real_groups += more_real[at]
        counts[at], real[at] = groups, real_groups
    return counts, real


@compiled_bare
def _count_one(
    more: np.ndarray,
    more_real: np.ndarray,
    top: int,
    enough: int,
    too_much: int,
    ends: int,
    rise: float,
    saturated: int,
) -> None:
    """Count a group from the level at which it is large enough to where it ends in another."""
    if enough <= ends:
        return
    more[enough] += 1
    if ends >= 0:
        more[ends] -= 1
    last = ends if top >= saturated else max(ends, too_much)
    if top - ends >= rise and enough > last:
        more_real[enough] += 1
        if last >= 0:
            more_real[last] -= 1


@compiled
def label_groups(index: np.ndarray, width: int) -> tuple[int, np.ndarray]:
    """How many groups the pixels form, and the number (n,) of each one's, in the order of their first pixels."""
    starts, ends = _runs(index, width)
    runs = len(starts)
    parent = np.empty(runs, np.int32)
    above, row_starts = 0, 0
    for run in range(runs):
        parent[run] = run
        left, right = index[starts[run]], index[ends[run] - 1]
        if left >= row_starts + width:
            row_starts = left - left % width
        # Runs of the row above that touch this one, also across corners; those left of it are passed once.
        first = max(left - width - 1, row_starts - width)
        last = min(right - width + 1, row_starts - 1)
        while index[ends[above] - 1] < first:
            above += 1
        other = above
        while other < run and index[starts[other]] <= last:
            one, two = root_of(parent, other), root_of(parent, run)
            parent[max(one, two)] = min(one, two)
            other += 1
    labels, label_of_run = np.empty(len(index), np.int32), np.empty(runs, np.int32)
    groups = 0
    for run in range(runs):
        root = root_of(parent, run)
        if root == run:
            label_of_run[run] = groups
            groups += 1
        else:
            label_of_run[run] = label_of_run[root]
        for pixel in range(starts[run], ends[run]):
            labels[pixel] = label_of_run[run]
    return groups, labels


@compiled
def _runs(index: np.ndarray, width: int) -> tuple[np.ndarray, np.ndarray]:
    """The first pixel (m,) and the one after the last (m,) of each run of neighbours in a row."""
    starts, ends = np.empty(len(index), np.int32), np.empty(len(index), np.int32)
    runs, row_ends = 0, 0
    for pixel in range(len(index)):
        if pixel > 0 and index[pixel] == index[pixel - 1] + 1 and index[pixel] < row_ends:
            continue
        if index[pixel] >= row_ends:
            row_ends = (index[pixel] // width + 1) * width
        if pixel > 0:
            ends[runs - 1] = pixel
        starts[runs] = pixel
        runs += 1
    if runs > 0:
        ends[runs - 1] = len(index)
    return starts[:runs], ends[:runs]


@compiled
def joined(
    values: np.ndarray, row: int, column: int, least: float, rows: tuple[int, int], columns: tuple[int, int]
) -> np.ndarray:
    """Rows and columns (K, 2) of pixels at or above a level that are joined to one, from a first to a last of both."""
    (top, bottom), (left, right) = rows, columns
    is_seen = np.zeros((bottom - top + 1, right - left + 1), np.bool_)
    found, count, looked_at = np.empty((is_seen.size, 2), np.int64), 1, 0
    found[0] = row, column
    is_seen[row - top, column - left] = True
    while looked_at < count:
        y, x = found[looked_at]
        looked_at += 1
        for beside_y in range(max(top, y - 1), min(bottom, y + 1) + 1):
            for beside_x in range(max(left, x - 1), min(right, x + 1) + 1):
                if values[beside_y, beside_x] >= least and not is_seen[beside_y - top, beside_x - left]:
                    is_seen[beside_y - top, beside_x - left] = True
                    found[count] = beside_y, beside_x
                    count += 1
    return found[:count]


@compiled
def outline(index: np.ndarray, labels: np.ndarray, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
    """Which pixels (n,) are on their group's outline, and which (n,) touch another group or the edge."""
    beside = touching(index, width)
    on_outline, cut = np.zeros(len(index), np.bool_), np.zeros(len(index), np.bool_)
    row = 0
    for pixel in range(len(index)):
        if index[pixel] >= (row + 1) * width:
            row = index[pixel] // width
        column = index[pixel] - row * width
        cut[pixel] = row == 0 or column == 0 or row == height - 1 or column == width - 1
        for slot in range(NEIGHBOURS):
            other = beside[pixel, slot]
            if other >= 0:
                cut[pixel] |= labels[other] != labels[pixel]
            elif slot == 0 or slot == 2 or slot == 5 or slot == 7:
                on_outline[pixel] = True
        on_outline[pixel] &= not cut[pixel]
    return on_outline, cut


class Shapes(NamedTuple):
    """What N groups of pixels look like."""

    areas: np.ndarray  # (N,): how many pixels each has
    moments: np.ndarray  # (N, 2): mass moments, the mean x and y of its pixels
    boxes: np.ndarray  # (N, 4): left, top, right and bottom pixel
    peaks: np.ndarray  # (N,): brightest level
    saturated: np.ndarray  # (N,): how many of its pixels are


def no_shapes(count: int) -> Shapes:
    """Shapes of groups to which pixels are yet to be added."""
    boxes = np.full((count, 4), -1, np.int64)
    boxes[:, :2] = np.iinfo(np.int64).max
    areas, peaks, saturated = np.zeros((3, count), np.int64)
    return Shapes(areas, np.zeros((count, 2)), boxes, peaks, saturated)


@compiled_bare
def add_pixel(shapes: Shapes, group: int, x: int, y: int, level: int, saturated: int) -> None:
    """Add a pixel to a group; at or above the level ``saturated`` it counts as saturated."""
    shapes.areas[group] += 1
    shapes.moments[group, 0] += x
    shapes.moments[group, 1] += y
    shapes.peaks[group] = max(shapes.peaks[group], level)
    shapes.saturated[group] += level >= saturated
    box = shapes.boxes[group]
    box[0], box[1] = min(box[0], x), min(box[1], y)
    box[2], box[3] = max(box[2], x), max(box[3], y)


def group_shapes(
    index: np.ndarray, level: np.ndarray, labels: np.ndarray, count: int, width: int, saturated: int
) -> Shapes:
    """Shapes of groups of listed pixels, each of the group ``labels`` (n,)."""
    shapes = no_shapes(count)
    _add_pixels(shapes, index, level, labels, width, saturated)
    return to_means(shapes)


@compiled_bare
def _add_pixels(
    shapes: Shapes, index: np.ndarray, level: np.ndarray, labels: np.ndarray, width: int, saturated: int
) -> None:
    """Add listed pixels, each to the group ``labels`` (n,)."""
    y = 0
    for pixel in range(len(index)):
        if index[pixel] >= (y + 1) * width:
            y = index[pixel] // width
        add_pixel(shapes, labels[pixel], index[pixel] - y * width, y, level[pixel], saturated)


def to_means(shapes: Shapes) -> Shapes:
    """Divide the sums of pixels' places, in place, by how many there are."""
    shapes.moments[:] /= np.maximum(shapes.areas, 1)[:, None]
    return shapes
