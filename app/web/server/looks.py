"""What each browser says of itself: whether its system is dark, and whether it draws without a graphics card."""

from collections.abc import Callable

import viser
from dockpose.app.web.server.guard import Guard, look_of
from dockpose.app.web.server.viser_private import connections
from websockets import Headers


class Looks:
    """Heeds what browsers say when they come, and later; ``paint(client, is_dark)`` gives one its colours."""

    def __init__(
        self, server: viser.ViserServer, guard: Guard, paint: Callable[[viser.ClientHandle, bool], None]
    ) -> None:
        self._server, self._guard, self._paint = server, guard, paint
        self._slow: set[int] = set()
        guard.on_look = self._on_look

    def draws_slowly(self) -> bool:
        """Whether a browser that steers has no graphics card; those that only view hold nobody up."""
        return bool(self._slow)

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
        if "software" in look and not self._guard.only_views(request.headers, request.path):
            self._slow.add(client.client_id)

    def forget(self, client: viser.ClientHandle) -> None:
        """Forget a browser that left."""
        self._slow.discard(client.client_id)

    def _on_look(self, headers: Headers) -> None:
        for client in self._server.get_clients().values():
            self.heed(client, headers)
