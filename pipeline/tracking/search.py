"""Searching frame after frame: around the ring of the frame before first, and the whole picture where that fails."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.lights.region import Region, is_within, ring_region
from dockpose.settings import Settings
from dockpose.tracking.chain import Speeds

_NOMINAL_PERIOD_S = 0.1  # between frames whose times are not known
_LEAST_PERIOD_S = 1e-3
BLOCK = 25  # frames: the first of so many is searched as a whole
_SHARE, _MARGIN_PX = 0.5, 20.0  # of the ring's size, and more: margin on each side
_LEAST = 0.25  # of the picture's width and height; a smaller region has too little water for a histogram
_LARGEST = 0.6  # of the picture's pixels; of a larger region the whole picture is as fast


@dataclass(frozen=True)
class _Last:
    """The frame before: its estimate, and the region around its ring."""

    found: Estimate
    index: int
    time_s: float | None
    ring: Region | None


class Search:
    """Searches the frames of a sequence, each but for some in a region around the ring of the frame before.

    The region hangs on the estimate of the frame before alone, and the first frame of each 25 is searched as a whole.
    So blocks of 25 frames may be searched in any order and by several processes, with the same results.

    Parameters
    ----------
    camera, dock : as for :func:`dockpose.estimate.estimate`.
    max_speed_m_per_s, max_turn_deg_per_s : see the settings; they bound how far a ring can come.
    whole_first : frames below this index are searched as a whole, so that what stays put is found soon.
    """

    def __init__(self, camera: Camera, dock: Dock, settings: Settings, *, whole_first: int = 0) -> None:
        self._camera, self._dock, self._whole_first = camera, dock, whole_first
        self._speeds = Speeds.of(settings)
        self._last: _Last | None = None

    def see(self, image: Any, index: int, time_s: float | None, settings: Settings) -> Estimate:
        """Search the next frame.

        Parameters
        ----------
        image : as for :func:`dockpose.estimate.estimate`.
        index : its number in the sequence.
        time_s : when it was taken; None for a tenth of a second after the frame before.
        settings : how to search it.
        """
        shape = np.shape(image)
        region = self._region(shape[1], shape[0], index, time_s) if len(shape) > 1 else None
        found = estimate(image, self._camera, self._dock, settings, region=region)
        ring = self._ring_of(found)
        if region is not None and not self._holds(found, ring, region):
            first_ms = found.elapsed_ms
            found = estimate(image, self._camera, self._dock, settings)
            found = replace(found, elapsed_ms=first_ms + found.elapsed_ms)
            ring = self._ring_of(found)
        self._last = _Last(found, index, time_s, ring)
        return found

    def remember(self, found: Estimate, index: int, time_s: float | None) -> None:
        """Go on from a frame that was searched before."""
        self._last = _Last(found, index, time_s, self._ring_of(found))

    def _ring_of(self, found: Estimate) -> Region | None:
        return ring_region(found.candidates[0], found.camera, self._dock) if found.candidates else None

    def _region(self, width: int, height: int, index: int, time_s: float | None) -> Region | None:
        """Where to search a picture of that size; None for all of it."""
        last = self._last
        if last is None or last.ring is None or index < self._whole_first or index // BLOCK != last.index // BLOCK:
            return None
        camera, ring = last.found.camera, last.ring
        distance = float(np.linalg.norm(last.found.candidates[0].position_m))
        reach = self._speeds.reach_m(distance, period_s(last.time_s, time_s)) / distance
        margin = _MARGIN_PX + _SHARE * max(ring[2:]) + reach * max(camera.fx, camera.fy)
        across = max(ring[2] + 2 * margin, _LEAST * width)
        down = max(ring[3] + 2 * margin, _LEAST * height)
        x, y = ring[0] + (ring[2] - across) / 2, ring[1] + (ring[3] - down) / 2
        seen_across, seen_down = min(width, x + across) - max(0.0, x), min(height, y + down) - max(0.0, y)
        if min(seen_across, seen_down) < 1 or seen_across * seen_down > _LARGEST * width * height:
            return None
        return x, y, across, down

    def _holds(self, found: Estimate, ring: Region | None, region: Region) -> bool:
        """Whether what a region shows is all of the ring, as far as one can tell."""
        if ring is None or self._last is None:
            return False
        all_there = (found.lights_on_ring or 0) >= (self._last.found.lights_on_ring or 0)
        return all_there and is_within(ring, region)


def period_s(before_s: float | None, now_s: float | None) -> float:
    """Time between two frames."""
    if before_s is None or now_s is None:
        return _NOMINAL_PERIOD_S
    return max(_LEAST_PERIOD_S, now_s - before_s)
