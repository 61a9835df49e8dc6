"""What each browser says of itself, and how often browsers are sent updates, so that none falls behind."""

import math
import time
from collections.abc import Callable
from dataclasses import dataclass

import viser
from dockpose.app.web.server.guard import Guard, look_of
from dockpose.app.web.server.viser_private import connections
from websockets import Headers

FRAME_EVERY_S = 0.03  # a browser shows the newest of what comes sooner than it can draw
DRAWING_QUIET_S = 0.4  # a slider that moves gives a new result more often than that
DRAWING_REST_S = 0.7  # a browser goes on drawing for 0.25 s after each change of the 3D scene


class Looks:
    """Heeds what browsers say when they come, and later; ``paint(client, is_dark)`` gives one its colours."""

    def __init__(
        self, server: viser.ViserServer, guard: Guard, paint: Callable[[viser.ClientHandle, bool], None]
    ) -> None:
        self._server, self._guard, self._paint = server, guard, paint
        self.slow: set[int] = set()  # those without a graphics card
        guard.on_look = self._on_look

    def heed(self, client: viser.ClientHandle, changed_to: Headers | None = None) -> None:
        """Heed a browser that came, or those of its pages that are open where it says something new."""
        request = getattr(connections(self._server).get(client.client_id), "request", None)
        if request is None:  # it left by now
            return
        look = look_of(request.headers)
        if changed_to is not None:
            anew = look_of(changed_to)
            if not any(word.startswith("id") for word in look & anew):  # another browser
                return
            look = anew
        self._paint(client, "dark" in look)
        if "software" in look:
            self.slow.add(client.client_id)

    def _on_look(self, headers: Headers) -> None:
        for client in self._server.get_clients().values():
            self.heed(client, headers)


@dataclass
class UpdatePacing:
    """Decides which frames of a sequence are shown, and how long the 3D scene rests where a browser draws slowly."""

    draws_slowly: Callable[[], bool]
    is_playing: Callable[[], bool]
    clock: Callable[[], float] = time.monotonic
    due_s: float = -math.inf

    def shows_next(self) -> bool:
        """Whether to show the next frame, in all panels; otherwise it is shown nowhere."""
        now_s = self.clock()
        if self.is_playing() and now_s < self.due_s:
            return False
        # After a late frame the next may come at once: a browser draws twice as often as that.
        self.due_s = max(self.due_s, now_s - FRAME_EVERY_S) + FRAME_EVERY_S
        return True

    def drawing_pauses_s(self) -> tuple[float, float]:
        """Seconds for which the 3D scene rests after it was drawn, and without a newer result before it is."""
        return (DRAWING_REST_S, DRAWING_QUIET_S) if self.draws_slowly() else (0.0, 0.0)
