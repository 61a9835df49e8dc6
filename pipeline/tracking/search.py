"""Searching frame after frame: first around the previous frame's ring, then the whole picture if that fails."""

from dataclasses import replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.lights.region import Region
from dockpose.pose.circle import CirclePose
from dockpose.settings import Settings
from dockpose.tracking.chain import reach_m

_NOMINAL_PERIOD_S = 0.1  # between frames whose times are unknown
_LEAST_PERIOD_S = 1e-3  # two frames may bear one time
BLOCK = 25  # frames; the first of each block is searched as a whole
_SHARE, _MARGIN_PX = 0.5, 20.0  # margin on each side: this share of the ring's size, plus pixels
_LEAST = 0.25  # of the picture's width and height; a smaller region has too little water for a histogram
_LARGEST = 0.6  # of the picture's pixels; searching a larger region is no faster than searching everything
_ANGLES = np.linspace(0, 2 * np.pi, 24, endpoint=False)  # sampled on the ring
_CIRCLE = np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])


class Search:
    """Searches frames around the last ring, each 25th as a whole, so that blocks can be searched in any order."""

    def __init__(self, camera: Camera, dock: Dock, settings: Settings, *, whole_first: int = 0) -> None:
        self._camera, self._dock, self._settings, self._whole_first = camera, dock, settings, whole_first
        # The previous frame's estimate, index and time, and the region around its ring.
        self._last: tuple[Estimate, int, float | None, Region | None] | None = None

    def see(self, image: Any, index: int, time_s: float | None, settings: Settings) -> Estimate:
        """Search the next frame, a picture (H, W) or (H, W, 3)."""
        shape = np.shape(image)
        region = self._region(shape[1], shape[0], index, time_s) if len(shape) > 1 else None
        found = estimate(image, self._camera, self._dock, settings, region=region)
        ring = self._ring_of(found)
        if region is not None and not self._holds(found, ring, region):
            first_ms = found.elapsed_ms
            found = estimate(image, self._camera, self._dock, settings)
            found = replace(found, elapsed_ms=first_ms + found.elapsed_ms)
            ring = self._ring_of(found)
        self._last = found, index, time_s, ring
        return found

    def remember(self, found: Estimate, index: int, time_s: float | None) -> None:
        """Continue after a frame that was searched elsewhere."""
        self._last = found, index, time_s, self._ring_of(found)

    def _ring_of(self, found: Estimate) -> Region | None:
        return ring_region(found.candidates[0], found.camera, self._dock) if found.candidates else None

    def _region(self, width: int, height: int, index: int, time_s: float | None) -> Region | None:
        """The region to search in a picture of that size; None for all of it."""
        if self._last is None or index < self._whole_first:
            return None
        found, last_index, last_s, ring = self._last
        if ring is None or index // BLOCK != last_index // BLOCK:
            return None
        if found.ring is not None and found.ring.rivals:  # which of them is tracked is not known here
            return None
        camera, distance = found.camera, float(np.linalg.norm(found.candidates[0].position_m))
        reach = reach_m(self._settings, distance, period_s(last_s, time_s)) / distance
        margin = _MARGIN_PX + _SHARE * max(ring[2:]) + reach * max(camera.fx, camera.fy)
        across = max(ring[2] + 2 * margin, _LEAST * width)
        down = max(ring[3] + 2 * margin, _LEAST * height)
        x, y = ring[0] + (ring[2] - across) / 2, ring[1] + (ring[3] - down) / 2
        seen_across, seen_down = min(width, x + across) - max(0.0, x), min(height, y + down) - max(0.0, y)
        if min(seen_across, seen_down) < 1 or seen_across * seen_down > _LARGEST * width * height:
            return None
        return x, y, across, down

    def _holds(self, found: Estimate, ring: Region | None, region: Region) -> bool:
        """Whether the ring found in a region is complete, as far as one can tell."""
        if ring is None or self._last is None:
            return False
        all_there = (found.lights_on_ring or 0) >= (self._last[0].lights_on_ring or 0)
        (left, top, width, height), (x, y, across, down) = ring, region
        is_inside = left >= x and top >= y and left + width <= x + across and top + height <= y + down
        return all_there and is_inside


def period_s(before_s: float | None, now_s: float | None) -> float:
    """Time between two frames."""
    if before_s is None or now_s is None:
        return _NOMINAL_PERIOD_S
    return max(_LEAST_PERIOD_S, now_s - before_s)


def ring_region(pose: CirclePose, camera: Camera, dock: Dock) -> Region | None:
    """The bounding box of a dock's ring in the picture; None where part of the ring has no image."""
    seen = camera.project(pose.position_m + dock.radius * _CIRCLE @ pose.rotation[:, :2].T)
    if not np.isfinite(seen).all():
        return None
    (left, top), (right, bottom) = seen.min(axis=0).tolist(), seen.max(axis=0).tolist()
    return left, top, right - left, bottom - top
