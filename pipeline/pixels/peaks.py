"""Peaks of a picture that rise enough above the saddles between them: which there are, and the pixels of each."""

import numpy as np
from dockpose.compiled import compiled, compiled_bare
from dockpose.pixels.flood import LEVELS, NEIGHBOURS, brightest_first, root_of, touching


@compiled
def peaks_by_persistence(
    value: np.ndarray,
    index: np.ndarray,
    width: int,
    mode: float,
    saturated: int,
    rise: tuple[float, float],
    rise_saturated: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Peaks' values (n,), highest saddles, saddles to a higher one (-1 for none), and each pixel's (n,) peak."""
    count = len(value)
    beside = touching(index, width)
    # Pixels that are joined at all form a tree, whose root is its highest pixel; those of one peak form a basin.
    tree, basin = np.arange(count), np.arange(count)
    saddle, ends = np.full(count, -1), np.full(count, -1)
    has_parts, seen = np.zeros(count, np.bool_), np.zeros(count, np.bool_)
    for pixel in brightest_first(value):
        seen[pixel] = True
        at = value[pixel]
        # A pixel belongs to the basin of its highest neighbour; so it meets that one first.
        highest = 0
        for number in range(1, NEIGHBOURS):
            if beside[pixel, number] >= 0 and (
                beside[pixel, highest] < 0 or value[beside[pixel, number]] > value[beside[pixel, highest]]
            ):
                highest = number
        for turn in range(NEIGHBOURS):
            other = beside[pixel, (highest + turn) % NEIGHBOURS]
            if other < 0 or not seen[other]:
                continue
            one, two = root_of(tree, pixel), root_of(tree, other)
            if one == two:
                continue
            here, there = root_of(basin, pixel), root_of(basin, other)
            if value[one] > value[two]:
                one, two, here, there = two, one, there, here
            tree[one] = two
            if at > saturated:
                stays = value[one] - at >= max(rise_saturated[0], rise_saturated[1] * (value[one] - saturated))
            else:
                top = min(value[one], saturated)
                stays = top - at >= max(rise[0], rise[1] * (top - mode))
            if stays or has_parts[one]:
                ends[one] = at
                saddle[here], saddle[there] = max(saddle[here], at), max(saddle[there], at)
                has_parts[two] = True
            else:
                basin[here] = there
                saddle[there] = max(saddle[there], saddle[here])
    number_of = np.full(count, -1)
    member_of = np.empty(count, np.int64)
    peaks = 0
    for pixel in range(count):
        root = root_of(basin, pixel)
        if number_of[root] < 0:
            number_of[root] = peaks
            peaks += 1
        member_of[pixel] = number_of[root]
    tops, saddles, last = np.empty(peaks, np.int64), np.empty(peaks, np.int64), np.empty(peaks, np.int64)
    for pixel in range(count):
        if number_of[pixel] >= 0:
            one = number_of[pixel]
            tops[one], saddles[one], last[one] = value[pixel], saddle[pixel], ends[pixel]
    return tops, saddles, last, member_of


@compiled_bare
def deepen(value: np.ndarray, index: np.ndarray, depth: np.ndarray, steps: float) -> None:
    """Continue brightness beyond 255, in place, by ``steps`` for each pixel of depth within what is saturated."""
    for pixel in range(len(index)):
        deep = depth[index[pixel]]
        if deep > 0:
            value[pixel] = LEVELS - 1 + int(steps * deep + 0.5)
