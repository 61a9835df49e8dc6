"""What is drawn over a picture, as geometry: the layers, and where each of their parts lies in pixels."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator

import numpy as np
from dockpose.estimate import Estimate
from dockpose.estimate.geometry import axes, centres, dock_outline, in_picture, normal, on_ring, outline

__all__ = [
    "LAYERS",
    "axes",
    "centres",
    "check_layers",
    "dock_outline",
    "in_picture",
    "light_labels",
    "normal",
    "on_ring",
    "outline",
    "scale_bar",
]

LAYERS = ("lights", "ellipse", "centres", "axes", "normals", "text", "scale")
_BAR_SHARE = 0.25  # of the picture's width, at most


def check_layers(layers: Collection[str]) -> None:
    """Raise ValueError for a layer that is not in ``LAYERS``."""
    for layer in layers:
        if layer not in LAYERS:
            raise ValueError(f"layers has {layer!r}; there are {', '.join(LAYERS)}")


def light_labels(estimate: Estimate) -> Iterator[tuple[int, str, np.ndarray]]:
    """Yield for each light on the ring the index of its group, its number from 1, and the way (2,) out of the ring."""
    lights = on_ring(estimate)
    if estimate.markers is None or not lights.any():
        return
    points, numbers = estimate.markers.points_px, estimate.light_numbers()
    centre = points[lights].mean(axis=0)
    for index in np.flatnonzero(lights):
        outward, light = points[index] - centre, numbers[index]
        label = index if light is None else light
        yield int(index), str(label + 1), outward / max(float(np.linalg.norm(outward)), 1e-9)


def scale_bar(estimate: Estimate) -> tuple[float, float] | None:
    """Return a round length at the dock's distance, in metres and in pixels; None where there is no pose.

    The length is 1, 2 or 5 times a power of ten and at most a quarter of the picture's width.
    """
    pose = estimate.selected
    if pose is None:
        return None
    ends = pose.position_m + np.outer([-0.5, 0.5], [estimate.dock.radius, 0, 0])
    left, right = estimate.camera.project(ends)
    per_metre = float(np.linalg.norm(right - left)) / estimate.dock.radius
    if not math.isfinite(per_metre) or per_metre <= 0:
        return None
    longest = _BAR_SHARE * estimate.width / per_metre
    power = 10.0 ** math.floor(math.log10(longest))
    length = max(factor * power for factor in (1, 2, 5) if factor * power <= longest * (1 + 1e-9))
    return length, length * per_metre
