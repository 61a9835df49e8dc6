"""How often browsers are sent updates, so that they do not fall behind."""

import math
import time
from collections.abc import Callable

FRAME_EVERY_S = 0.03  # a browser shows the newest of what comes sooner than it can draw
DRAWING_QUIET_S = 0.4  # a slider that moves gives a new result more often than that
DRAWING_REST_S = 0.7  # a browser goes on drawing for 0.25 s after each change of the 3D scene


class UpdatePacing:
    """Decides which frames of a sequence are shown, and how long the 3D scene of a picture rests.

    ``draws_slowly()`` tells whether a browser draws without a graphics card, so that all else waits for the 3D scene.
    """

    def __init__(
        self,
        draws_slowly: Callable[[], bool],
        is_playing: Callable[[], bool],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self._draws_slowly, self._is_playing, self._clock = draws_slowly, is_playing, clock
        self._shown_s = -math.inf

    def shows_next(self) -> bool:
        """Whether to show the next frame, in all panels; otherwise it is shown nowhere."""
        return not self._is_playing() or self._clock() - self._shown_s >= FRAME_EVERY_S

    def hides_scene(self) -> bool:
        """Whether the 3D scene is hidden, since drawing it would hold up each frame by a quarter of a second."""
        return self._is_playing() and self._draws_slowly()

    def note(self) -> None:
        """Record that a frame was shown."""
        self._shown_s = self._clock()

    def drawing_rest_s(self) -> float:
        """Seconds for which the 3D scene rests after it was drawn."""
        return DRAWING_REST_S if self._draws_slowly() else 0.0

    def drawing_quiet_s(self) -> float:
        """Seconds without a newer result after which the 3D scene is drawn."""
        return DRAWING_QUIET_S if self._draws_slowly() else 0.0
