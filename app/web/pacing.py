"""How often browsers are sent updates, so that they do not fall behind."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable

PICTURE_EVERY_S = 0.03
ALL_EVERY_S, ALL_SLOWLY_EVERY_S = 0.25, 2.0
# A browser goes on drawing for 0.25 s after each change of the 3D scene.
DRAWING_REST_S, DRAWING_REST_PLAYING_S = 0.7, 3.0


class UpdatePacing:
    """Decides how much of each frame of a sequence is shown, and how long the 3D scene rests.

    ``draws_slowly`` is set where a browser draws without a graphics card, so that all else waits for the 3D scene.
    """

    def __init__(
        self,
        draws_slowly: threading.Event,
        is_playing: Callable[[], bool],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._draws_slowly, self._is_playing, self._clock = draws_slowly, is_playing, clock
        self._all_s = self._picture_s = -math.inf

    def shows_all(self) -> bool:
        """Whether to show the next frame in all panels; those between are shown only as pictures."""
        every_s = ALL_SLOWLY_EVERY_S if self._draws_slowly.is_set() else ALL_EVERY_S
        return not self._is_playing() or self._clock() - self._all_s >= every_s

    def shows_picture(self) -> bool:
        """Whether to show at least its picture."""
        return self._clock() - self._picture_s >= PICTURE_EVERY_S

    def note(self, *, all_panels: bool) -> None:
        """Record that a picture was shown, in all panels or alone."""
        self._picture_s = self._clock()
        if all_panels:
            self._all_s = self._picture_s

    def drawing_rest_s(self) -> float:
        """Seconds for which the 3D scene rests after it was drawn."""
        if not self._draws_slowly.is_set():
            return 0.0
        return DRAWING_REST_PLAYING_S if self._is_playing() else DRAWING_REST_S
