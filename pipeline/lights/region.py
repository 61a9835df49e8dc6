"""A region of interest: the part of a picture that is searched, and how results map back to the whole picture."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import check_number
from dockpose.dock import Dock
from dockpose.lights.ellipse import MIN_POINTS
from dockpose.lights.markers import Markers
from dockpose.lights.masks import Mask
from dockpose.lights.ring import Ring, find_ring
from dockpose.pixels.bright import BrightPixels, PixelGroups
from dockpose.thresholds import Threshold

# x_px, y_px of the upper left corner, width_px, height_px: like a mask, but it says where to look.
Region = tuple[float, float, float, float]
# left, top, right, bottom: columns left to right - 1 of rows top to bottom - 1.
Part = tuple[int, int, int, int]


def part_of(region: Sequence[float] | None, width: int, height: int) -> Part:
    """The pixels whose centres lie in a region in pixels, clipped to the picture; ValueError where there are none."""
    if region is None:
        return 0, 0, width, height
    if len(region) != 4:
        raise ValueError(f"region is {region!r}; it must be four numbers: x_px, y_px, width_px, height_px")
    x, y, across, down = region
    for name, value in (("x_px", x), ("y_px", y)):
        check_number(f"region {name}", value)
    for name, value in (("width_px", across), ("height_px", down)):
        check_number(f"region {name}", value, above=0)
    left, right = (math.ceil(min(max(edge, 0), width)) for edge in (x, x + across))
    top, bottom = (math.ceil(min(max(edge, 0), height)) for edge in (y, y + down))
    if left >= right or top >= bottom:
        raise ValueError(f"region is {tuple(region)!r}; it holds no pixel of the picture of {width} x {height}")
    return left - left % 2, top - top % 2, right, bottom


def masks_within(masks: Sequence[Mask], part: Part) -> tuple[Mask, ...]:
    """Masks of a picture, in the pixels of a part of it."""
    left, top, _, _ = part
    return tuple((x - left, y - top, width, height) for x, y, width, height in masks)


def markers_in_whole(markers: Markers, part: Part) -> Markers:
    """Markers found in a part, in the pixels of the whole picture."""
    left, top, _, _ = part
    if left == top == 0 or len(markers) == 0:
        return markers
    return replace(
        markers, points_px=markers.points_px + (left, top), boxes_px=markers.boxes_px + (left, top, left, top)
    )


def threshold_in_whole(threshold: Threshold, part: Part, width: int) -> Threshold:
    """A threshold of a part, with the pixels it lists numbered as in the whole picture of that width."""
    left, top, right, _ = part
    if threshold.groups is None or (left == top == 0 and right == width):
        return threshold
    pixels, lights = threshold.groups.listed()
    row, column = np.divmod(pixels.index, right - left)
    index = (row + top) * width + column + left
    pixels = BrightPixels(pixels.floor, width, index, pixels.level)
    return replace(threshold, groups=PixelGroups(pixels, lights, threshold.groups.count))


def crop(image: Any, part: Part) -> np.ndarray:
    """A part of a picture (H, W) or (H, W, C), as a view rather than a copy."""
    left, top, right, bottom = part
    return np.asarray(image)[top:bottom, left:right]


def ring_in(
    points_px: np.ndarray, markers: Markers, camera: Camera, dock: Dock, part: Part, *, of_few: bool = True
) -> Ring:
    """Find the markers that are the dock's lights; none counts whose centre the edge of the part leaves open."""
    left, top, right, bottom = part
    area_px2 = float((right - left) * (bottom - top))
    whole = ~markers.cut
    kept, cut = int(whole.sum()), int(markers.cut.sum())
    if cut == 0 or kept < MIN_POINTS:
        return find_ring(points_px, markers, camera, dock, area_px2, of_few=of_few)
    ring = find_ring(points_px[whole], markers.part(whole), camera, dock, area_px2, of_few=of_few)
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
