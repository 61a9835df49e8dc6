"""Grey-weighted centroids of lights, one window at a time, compiled by numba."""

from __future__ import annotations

import numpy as np
from dockpose.thresholds.compiled import compiled

_NEIGHBOURS = 2  # lights that may share a light's window


@compiled
def weighted_centres(grey: np.ndarray, points: np.ndarray, reach: np.ndarray, foot: float) -> np.ndarray:
    """Grey-weighted centroids of lights.

    Parameters
    ----------
    grey : (H, W) array
        Grey picture.
    points : (N, 2) float array, pixels
        Rough centres x, y.
    reach : (N,) int array, pixels
        Half the size of the window around each light.
    foot : float
        Share of a light's height above the water around it below which a pixel has no weight.

    Returns
    -------
    (N, 2) float array, pixels
        Centroids x, y.
    """
    centres = points.copy()
    for light in range(len(points)):
        column, row = int(np.rint(points[light, 0])), int(np.rint(points[light, 1]))
        far = reach[light]
        top, bottom = max(0, row - far), min(grey.shape[0] - 1, row + far)
        left, right = max(0, column - far), min(grey.shape[1] - 1, column + far)
        water = _median_along_edge(grey, top, bottom, left, right)
        inner = grey[max(0, row - 1) : row + 2, max(0, column - 1) : column + 2].max()
        least = water + foot * (inner - water)
        beside = _nearest(points, light, 3.0 * far)
        total, sum_x, sum_y = 0.0, 0.0, 0.0
        for y in range(top, bottom + 1):
            for x in range(left, right + 1):
                weight = grey[y, x] - least
                if weight > 0 and _is_nearest(points, light, beside, x, y):
                    total += weight
                    sum_x += weight * x
                    sum_y += weight * y
        if total > 0:
            centres[light, 0], centres[light, 1] = sum_x / total, sum_y / total
    return centres


@compiled
def _median_along_edge(grey: np.ndarray, top: int, bottom: int, left: int, right: int) -> float:
    values = np.empty(2 * (right - left + 1) + 2 * (bottom - top + 1))
    count = 0
    for x in range(left, right + 1):
        values[count], values[count + 1] = grey[top, x], grey[bottom, x]
        count += 2
    for y in range(top, bottom + 1):
        values[count], values[count + 1] = grey[y, left], grey[y, right]
        count += 2
    return np.median(values)


@compiled
def _nearest(points: np.ndarray, light: int, within: float) -> np.ndarray:
    """Indices of the nearest other points, -1 for none."""
    found = np.full(_NEIGHBOURS, -1)
    distance = np.full(_NEIGHBOURS, within)
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


@compiled
def _is_nearest(points: np.ndarray, light: int, beside: np.ndarray, x: int, y: int) -> bool:
    least = (points[light, 0] - x) ** 2 + (points[light, 1] - y) ** 2
    nearest = True
    for other in beside:
        if other >= 0 and (points[other, 0] - x) ** 2 + (points[other, 1] - y) ** 2 < least:
            nearest = False
    return nearest
