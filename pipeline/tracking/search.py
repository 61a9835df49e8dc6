"""The frames of a sequence one after another: each followed from the one before, and searched where that fails."""

from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.settings import Settings
from dockpose.tracking.follow import Sighting, begin, follow, period_s

BLOCK = 100  # frames; the first of each block is searched


class Search:
    """Finds the dock in frame after frame; each 100th is searched, so that blocks can be done in any order."""

    def __init__(self, camera: Camera, dock: Dock) -> None:
        self._camera, self._dock = camera, dock
        self._last: Sighting | None = None  # the last frame that shows a dock
        self._index = 0  # of the last frame

    def see(self, image: Any, index: int, time_s: float | None, settings: Settings) -> Estimate:
        """Follow the dock into the next frame, a picture (H, W) or (H, W, 3), or search that."""
        last = self._last if index // BLOCK == self._index // BLOCK else None
        self._index = index
        followed = None if last is None else self._followed(image, last, time_s, settings)
        if isinstance(followed, Sighting):
            self._last = followed
            return followed.found
        found = estimate(image, self._camera, self._dock, settings)
        begun = begin(found, image, time_s)
        is_gone = last is not None and period_s(last.time_s, time_s) > settings.lost_after_s
        self._last = begun or (None if is_gone else last)
        return found

    def _followed(self, image: Any, last: Sighting, time_s: float | None, settings: Settings) -> Sighting | str:
        before = last.found
        if not isinstance(image, np.ndarray) or isinstance(image, np.ma.MaskedArray):
            return "the picture is no plain array"
        if before.settings != settings or image.shape[:2] != (before.height, before.width):
            return "settings or size have changed"
        return follow(image, last, self._camera, time_s)
