"""The frames of a sequence one after another: each followed from the one before, and searched where that fails."""

import math
import threading
import time
from typing import Any

import numpy as np
from dockpose.camera.camera import Camera
from dockpose.dock import Dock
from dockpose.estimate import Estimate, estimate
from dockpose.pose.choice import DECIDED
from dockpose.settings import Settings
from dockpose.tracking.follow import follow, period_s
from dockpose.tracking.sighting import Sighting, begin

BLOCK = 100  # frames; the first of each block is searched
_AGAIN = 10  # frames; the first of these is searched as well where a ring that is followed may be no dock
_BESIDE_S = 1.0  # between two searches beside following, of a live source
_SAME = 0.2  # of the ring's radius, within which the centres of two are one


class Search:
    """Finds the dock in frame after frame: follows it, and searches where that fails and now and then.

    Each 100th frame is searched, so that blocks can be done in any order; of a live source one about each second,
    beside following. Where that shows another ring, the next frame is searched. What follows from lights that were set
    by hand is searched only once it is lost.
    """

    def __init__(self, camera: Camera, dock: Dock, *, is_live: bool = False) -> None:
        self._camera, self._dock, self._is_live = camera, dock, is_live
        self._last: Sighting | None = None  # the last frame that shows a dock
        self._index = 0  # of the last frame
        self._beside: threading.Thread | None = None  # searches a frame that was followed
        self._is_another = False  # whether that showed another ring
        self._searched_s = 0.0  # when one was searched last

    def see(
        self, image: Any, index: int, time_s: float | None, settings: Settings, lights_px: Any = None, snap: Any = False
    ) -> Estimate:
        """Follow the dock into the next frame, (H, W) or (H, W, 3), or search that, or take the lights set in it."""
        if lights_px is not None:
            found = estimate(image, self._camera, self._dock, settings, lights_px=lights_px, snap=snap)
            self._last, self._index = (begin(found, image, time_s) if _is_plain(image) else None), index
            return found
        is_set = self._last is not None and self._last.found.detection is None
        last = self._last if is_set or self._is_live or index // BLOCK == self._index // BLOCK else None
        self._index = index
        if last is not None and period_s(last.time_s, time_s) > settings.lost_after_s:
            last = None
        if self._is_another:
            last, self._is_another = None, False
        sure = 1.0 if last is None or last.found.detection is None else last.found.detection
        if index % _AGAIN == 0 and sure < DECIDED:
            found = estimate(image, self._camera, self._dock, settings)
            if (found.detection or 0.0) > sure:
                self._last = begin(found, image, time_s) if _is_plain(image) else None
                return found
        followed = None
        if last is not None and last.found.settings == settings and _is_plain(image):
            is_same_size = image.shape[:2] == (last.found.height, last.found.width)
            followed = follow(image, last, self._camera, time_s) if is_same_size else None
        if isinstance(followed, Sighting):
            self._last = followed
            if self._is_live and not is_set:
                self._search_beside(image, followed.found)
            return followed.found
        found = estimate(image, self._camera, self._dock, settings)
        self._searched_s = time.monotonic()
        begun = begin(found, image, time_s) if _is_plain(image) else None
        self._last = begun or last
        return found

    def _search_beside(self, image: np.ndarray, followed: Estimate) -> None:
        """Begin to search a frame that was followed, if the last such search is done and long enough ago."""
        is_busy = self._beside is not None and self._beside.is_alive()
        if is_busy or time.monotonic() - self._searched_s < _BESIDE_S:
            return
        self._searched_s = time.monotonic()
        self._beside = threading.Thread(target=self._compare, args=(image.copy(), followed), daemon=True)
        self._beside.start()

    def _compare(self, image: np.ndarray, followed: Estimate) -> None:
        found = estimate(image, self._camera, self._dock, followed.settings)
        self._is_another = found.status == "ok" and not _is_same(found, followed)


def _is_plain(image: Any) -> bool:
    """Whether a picture is an array all of which counts."""
    return isinstance(image, np.ndarray) and not isinstance(image, np.ma.MaskedArray)


def _is_same(found: Estimate, followed: Estimate) -> bool:
    """Whether the ring that was followed is the one that a search finds."""
    if found.ellipse is None or followed.ellipse is None:
        return False
    one, other = found.ellipse, followed.ellipse
    apart_px = math.dist((*one.centre_px, *one.semi_axes_px), (*other.centre_px, *other.semi_axes_px))
    return apart_px < _SAME * other.semi_axes_px[0]
