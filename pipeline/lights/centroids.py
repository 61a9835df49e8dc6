"""Grey-weighted centroids of lights, one window at a time, compiled by numba."""

from typing import NamedTuple

import numpy as np
from dockpose.compiled import compiled, compiled_bare, compiled_within

_NEIGHBOURS = 2  # lights that may share a light's window
# What rises across a window by more than a small share of the light's height may be the light itself, whose flank an
# edge of the window cuts. Water, as the halos of other lights, rises by no more than the largest share, and goes on by
# this share of its slope so many pixels farther out. Another light so near, in half windows, has a flank there.
_SMALL_RISE, _LARGEST_RISE, _WIDER_PX, _GOES_ON, _CROWDED = 0.05, 0.4, 2, 0.5, 1.5
NORMAL = 0.886  # standard deviation of normal numbers over the mean absolute difference of two of them, sqrt(pi) / 2


class _Plane(NamedTuple):
    """Grey levels over a part of the picture."""

    at: float  # level in the middle
    slope_x: float  # to the right and downwards, in levels per pixel
    slope_y: float
    middle: tuple[float, float]


@compiled
def weighted_centres(grey: np.ndarray, points: np.ndarray, reach: np.ndarray, foot: float) -> np.ndarray:
    """Grey-weighted centroids (N, 2) of lights near points (N, 2), above water and ``foot`` of their height.

    Each is weighed as far as its reach (N,); one of none stays where it is.
    """
    centres = points.copy()
    for light in range(len(points)):
        if reach[light] == 0:
            continue
        column, row = int(np.rint(points[light, 0])), int(np.rint(points[light, 1]))
        far = reach[light]
        window = top, bottom, left, right = window_at(grey, row, column, far)
        water = median_along_edge(grey, top, bottom, left, right)
        beside = nearest(points, light, 3.0 * far)
        slope_x, slope_y = _slopes(grey, points, light, beside, window)
        middle = (left + right) / 2, (top + bottom) / 2
        inner = brightest(grey, window_at(grey, row, column, np.int64(1)))
        height = inner - water
        rise = max(abs(slope_x) * (right - left), abs(slope_y) * (bottom - top))
        if rise > _SMALL_RISE * height:
            wider = window_at(grey, row, column, far + _WIDER_PX)
            beyond_x, beyond_y = _slopes(grey, points, light, beside, wider)
            is_water = rise < _LARGEST_RISE * height and nearest(points, light, _CROWDED * far)[0] < 0
            slope_x = _going_on(slope_x, beyond_x) if is_water else 0.0
            slope_y = _going_on(slope_y, beyond_y) if is_water else 0.0
        of_water = _Plane(water, slope_x, slope_y, middle)
        x, y = _centroid(grey, points, light, beside, window, of_water, foot * height)
        if np.isfinite(x):
            centres[light, 0], centres[light, 1] = x, y
    return centres


@compiled_within
def _centroid(
    grey: np.ndarray,
    points: np.ndarray,
    light: int,
    beside: np.ndarray,
    window: tuple[int, int, int, int],
    water: _Plane,
    foot: float,
) -> tuple[float, float]:
    """Centroid of what is brighter than the water by so many levels; NaN where nothing is."""
    top, bottom, left, right = window
    total, sum_x, sum_y = 0.0, 0.0, 0.0
    for y in range(top, bottom + 1):
        for x in range(left, right + 1):
            base = water.at + water.slope_x * (x - water.middle[0]) + water.slope_y * (y - water.middle[1])
            weight = grey[y, x] - base - foot
            if weight > 0 and is_nearest(points, light, beside, x, y):
                total += weight
                sum_x += weight * x
                sum_y += weight * y
    return (sum_x / total, sum_y / total) if total > 0 else (np.nan, np.nan)


@compiled_bare
def window_at(grey: np.ndarray, row: int, column: int, far: int) -> tuple[int, int, int, int]:
    """First and last row, first and last column of what of a picture is so near to a pixel."""
    height, width = grey.shape
    return max(0, row - far), min(height - 1, row + far), max(0, column - far), min(width - 1, column + far)


@compiled_bare
def brightest(grey: np.ndarray, window: tuple[int, int, int, int]) -> float:
    """Return the highest level within a window."""
    top, bottom, left, right = window
    most = grey[top, left]
    for y in range(top, bottom + 1):
        for x in range(left, right + 1):
            most = max(most, grey[y, x])
    return most


@compiled
def median_along_edge(grey: np.ndarray, top: int, bottom: int, left: int, right: int) -> float:
    """Return the median level of a window's first and last rows and columns."""
    values = np.empty(2 * (right - left + 1) + 2 * (bottom - top + 1))
    count = 0
    for x in range(left, right + 1):
        values[count], values[count + 1] = grey[top, x], grey[bottom, x]
        count += 2
    for y in range(top, bottom + 1):
        values[count], values[count + 1] = grey[y, left], grey[y, right]
        count += 2
    return _median(values)


@compiled
def _median(values: np.ndarray) -> float:
    """Median of values (N,) by quickselect (Hoare 1961), which compiles in half the time of numpy's."""
    ordered = values.copy()
    middle, low, high = len(ordered) // 2, 0, len(ordered) - 1
    while low < high:
        pivot, left, right = ordered[(low + high) // 2], low, high
        while left <= right:
            while ordered[left] < pivot:
                left += 1
            while ordered[right] > pivot:
                right -= 1
            if left <= right:
                ordered[left], ordered[right] = ordered[right], ordered[left]
                left, right = left + 1, right - 1
        if middle <= right:
            high = right
        elif middle >= left:
            low = left
        else:
            break
    if len(ordered) % 2:
        return ordered[middle]
    below = ordered[0]
    for number in range(1, middle):
        below = max(below, ordered[number])
    return (below + ordered[middle]) / 2


@compiled
def _slopes(
    grey: np.ndarray, points: np.ndarray, light: int, beside: np.ndarray, window: tuple[int, int, int, int]
) -> tuple[float, float]:
    """Grey levels by which the water rises per pixel to the right and downwards, by opposite edges of a window."""
    top, bottom, left, right = window
    edges = np.empty((4, max(bottom - top, right - left) + 1))
    count = np.zeros(4, np.int64)
    for y in range(top, bottom + 1):
        for side, x in enumerate((left, right)):
            if is_nearest(points, light, beside, x, y):
                edges[side, count[side]] = grey[y, x]
                count[side] += 1
    for x in range(left, right + 1):
        for side, y in enumerate((top, bottom)):
            if is_nearest(points, light, beside, x, y):
                edges[side + 2, count[side + 2]] = grey[y, x]
                count[side + 2] += 1
    slope_x, slope_y = 0.0, 0.0
    if 3 * min(count[0], count[1]) > bottom - top and right > left:
        slope_x = _rise(edges[0, : count[0]], edges[1, : count[1]]) / (right - left)
    if 3 * min(count[2], count[3]) > right - left and bottom > top:
        slope_y = _rise(edges[2, : count[2]], edges[3, : count[3]]) / (bottom - top)
    return slope_x, slope_y


@compiled_bare
def _going_on(slope: float, beyond: float) -> float:
    """The slope of the water beyond a window; 0 where that is no going on of the slope within."""
    return beyond if beyond * slope > 0 and abs(beyond) > _GOES_ON * abs(slope) else 0.0


@compiled
def _rise(one: np.ndarray, other: np.ndarray) -> float:
    """How much brighter the other edge is, as far as that is beyond the noise of both."""
    rise = _median(other) - _median(one)
    steps = 0.0
    for edge in (one, other):
        for place in range(1, len(edge)):
            steps += abs(edge[place] - edge[place - 1])
    numbers = len(one) + len(other)
    spread = NORMAL * steps / max(1, numbers - 2)
    variance = np.pi / 2 * spread**2 * (1 / len(one) + 1 / len(other))
    return beyond_noise(rise, variance)


@compiled_bare
def beyond_noise(value: float, variance: float) -> float:
    """Return a value as far as it is beyond its noise."""
    square = value * value
    return value * square / (square + variance) if square > 0 else 0.0


@compiled
def nearest(points: np.ndarray, light: int, within: float) -> np.ndarray:
    """Indices of the nearest other points, -1 for none."""
    found, distance = np.zeros(_NEIGHBOURS, np.int64), np.empty(_NEIGHBOURS)
    for place in range(_NEIGHBOURS):
        found[place], distance[place] = -1, within
    for other in range(len(points)):
        if other == light:
            continue
        apart = np.hypot(points[other, 0] - points[light, 0], points[other, 1] - points[light, 1])
        for place in range(_NEIGHBOURS):
            if apart < distance[place]:
                for later in range(_NEIGHBOURS - 1, place, -1):
                    found[later], distance[later] = found[later - 1], distance[later - 1]
                found[place], distance[place] = other, apart
                break
    return found


@compiled_bare
def is_nearest(points: np.ndarray, light: int, beside: np.ndarray, x: int, y: int) -> bool:
    """Whether a light is no farther from a pixel than those beside it."""
    least = (points[light, 0] - x) ** 2 + (points[light, 1] - y) ** 2
    is_so = True
    for other in beside:
        if other >= 0 and (points[other, 0] - x) ** 2 + (points[other, 1] - y) ** 2 < least:
            is_so = False
    return is_so
