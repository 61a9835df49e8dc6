"""The part of a picture that is looked at, and lights that the picture's edge leaves open."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.ellipse import MIN_POINTS
from dockpose.lights.exact import Kind
from dockpose.lights.markers import Markers
from dockpose.lights.masks import Mask
from dockpose.lights.ring import Ring, find_ring

# x_px, y_px of the upper left corner, width_px, height_px.
Region = tuple[float, float, float, float]
# left, top, right, bottom: columns left to right - 1 of rows top to bottom - 1.
Part = tuple[int, int, int, int]


def part_of(region: Sequence[float] | None, width: int, height: int) -> Part:
    """The pixels whose centres lie in a region in pixels, clipped to the picture."""
    if region is None:
        return 0, 0, width, height
    x, y, across, down = region
    left, right = (math.ceil(min(max(edge, 0), width)) for edge in (x, x + across))
    top, bottom = (math.ceil(min(max(edge, 0), height)) for edge in (y, y + down))
    return left - left % 2, top - top % 2, right, bottom


def masks_within(masks: Sequence[Mask], part: Part) -> tuple[Mask, ...]:
    """Masks of a picture, in the pixels of a part of it."""
    left, top, _, _ = part
    return tuple((x - left, y - top, width, height) for x, y, width, height in masks)


def crop(image: Any, part: Part) -> np.ndarray:
    """A part of a picture (H, W) or (H, W, C), as a view rather than a copy."""
    left, top, right, bottom = part
    return np.asarray(image)[top:bottom, left:right]


def ring_in(
    points_px: np.ndarray, markers: Markers, camera: Camera, dock: Dock, area_px2: float, kind: Kind = "exact"
) -> Ring:
    """Find the markers that are the dock's lights; none counts whose centre the picture's edge leaves open."""
    whole = ~markers.cut
    kept, cut = int(whole.sum()), int(markers.cut.sum())
    if cut == 0 or kept < MIN_POINTS:
        return find_ring(points_px, markers, camera, dock, area_px2, kind)
    ring = find_ring(points_px[whole], markers.part(whole), camera, dock, area_px2, kind)
    on_ring, rivals = _among_all(ring.on_ring, whole), tuple(_among_all(rival, whole) for rival in ring.rivals)
    if ring.found and not rivals and len(markers) - on_ring.sum() >= MIN_POINTS:
        # Nobody measures by another ring, so of that the edge may cut some lights.
        other = find_ring(points_px[~on_ring], markers.part(~on_ring), camera, dock, area_px2)
        rivals = tuple(_among_all(rival, ~on_ring) for rival in ((other.on_ring,) if other.found else other.rivals[:1]))
    reason = f"{ring.reason} {cut} that the edge cuts {'do' if cut > 1 else 'does'} not count."
    return replace(ring, on_ring=on_ring, reason=reason, rivals=rivals)


def _among_all(flags: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Flags of all markers, from those of the whole ones."""
    every = np.zeros(len(whole), dtype=bool)
    every[whole] = flags
    return every
