"""The part of a picture that is looked at, and lights that the picture's edge leaves open."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.lights.ellipse import MIN_POINTS
from dockpose.lights.markers import Markers
from dockpose.lights.masks import Mask
from dockpose.lights.ring import Kind, Ring, find_ring
from numpy.typing import ArrayLike

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
    """Find the markers that are the dock's lights; none counts whose centre the picture's edge leaves open.

    Where none is found, the middle ones may be extra lights of the dock, which are none of the ring's.
    """
    ring = _ring_in(points_px, markers, camera, dock, area_px2, kind)
    if ring.found or not dock.extra_lights_m or not MIN_POINTS <= (dock.lights or len(markers)) < len(markers):
        return ring
    beside = beside_middle(points_px, points_px.mean(axis=0), np.ones(len(points_px), dtype=bool), dock)
    other = _ring_in(points_px[beside], markers.part(beside), camera, dock, area_px2, kind)
    if not other.found:
        return ring
    rivals = tuple(_among_all(rival, beside) for rival in other.rivals)
    return replace(other, on_ring=_among_all(other.on_ring, beside), rivals=rivals)


def beside_middle(points_px: np.ndarray, middle_px: ArrayLike, free: np.ndarray, dock: Dock) -> np.ndarray:
    """Flags (N,) of all points but those of the free ones, (N,), nearest to a middle: a dock's extra lights, if any."""
    beside = np.ones(len(points_px), dtype=bool)
    from_middle = np.where(free, np.linalg.norm(points_px - middle_px, axis=1), np.inf)
    nearest = np.argsort(from_middle, kind="stable")[: len(dock.extra_lights_m)]
    beside[nearest[free[nearest]]] = False
    return beside


def _ring_in(points_px: np.ndarray, markers: Markers, camera: Camera, dock: Dock, area_px2: float, kind: Kind) -> Ring:
    """The ring among markers of which none counts that the picture's edge cuts."""
    whole = ~markers.cut
    kept, cut = int(whole.sum()), int(markers.cut.sum())
    if cut == 0 or kept < MIN_POINTS:
        return find_ring(points_px, markers, camera, dock, area_px2, kind)
    ring = find_ring(points_px[whole], markers.part(whole), camera, dock, area_px2, kind)
    on_ring, rivals = _among_all(ring.on_ring, whole), tuple(_among_all(rival, whole) for rival in ring.rivals)
    if ring.found and not rivals:
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
