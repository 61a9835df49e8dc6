"""What people do in controls: called back with their browser, in the order in which they did it."""

import threading
from collections.abc import Callable
from typing import Any, TypeAlias

import viser
from dockpose.app.web.server.viser_private import hear_values, identity

Client: TypeAlias = viser.ClientHandle  # a browser that shows the page
Act = Callable[[Client], object]
# Applies a function to the present view, for the browser that asked for it; by ``reload`` the controls follow.
Change = Callable[..., None]
Choice = tuple[str, Any, Any]  # a control's id, the control, and the value that a person gave it


class Choices:
    """What people set in controls and no act has taken up yet: another act that ends meanwhile sets all controls."""

    def __init__(self) -> None:
        self._open: dict[str | None, Choice] = {}
        self.typed: dict[str, tuple[Any, Callable[[float, Client], None]]] = {}  # sets one of an id
        self._held = threading.Lock()  # or a choice that has just been replaced is put back over the newer one
        self._acting = threading.local()

    def on_update(self, handle: Any, act: Act) -> None:
        """Call ``act`` with the browser in which a person set a control, which then has the value set last."""
        key = identity(handle)
        sent: dict[str, Any] = {}

        async def note(event: Any) -> None:  # viser awaits this in the order of a browser's messages
            if event.client is not None:
                with self._held:
                    self._open[key] = key, handle, sent["value"]

        def take_up(client: Client) -> None:  # which viser calls in any order
            self._acting.on = key
            choice = self.put_back()
            try:
                act(client)
            finally:
                self.taken(choice)
                self._acting.on = None

        def typed(number: float, client: Client) -> None:
            with self._held:
                self._open[key] = key, handle, number
            take_up(client)

        self.typed[key] = handle, typed
        hear_values(handle, sent.update)
        handle.on_update(note)
        on_person(handle.on_update, take_up)

    def put_back(self) -> Choice | None:
        """Set controls as people did, where the program set them otherwise since; return what this thread acts on."""
        with self._held:
            for _, handle, value in self._open.values():
                if handle.value != value:
                    handle.value = value
            return self._open.get(getattr(self._acting, "on", None))

    def taken(self, choice: Choice | None) -> None:
        """Say that an act has read a choice; one that was made in the same control since stays."""
        with self._held:
            if choice is not None and self._open.get(choice[0]) is choice:
                del self._open[choice[0]]


def on_person(attach: Callable[[Callable[[Any], None]], object], act: Act) -> None:
    """Call ``act`` with the browser in which a person, not the program, did what ``attach`` (``on_click``) is for."""

    def called(event: Any) -> None:
        if event.client is not None:
            act(event.client)

    attach(called)
