"""What changes with every frame, sent to the browser in one message, which static/frame.js shows at one moment."""

from __future__ import annotations

import itertools
import json
import threading
from collections.abc import Callable
from html import escape
from typing import Any

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import Panel


def data_html(name: str, data: Any) -> str:
    """Return data for an element of static/, which reads it by that name."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return f'<dockpose-data name="{name}" hidden>{escape(text, quote=False)}</dockpose-data>'


class LivePage(Panel):
    """Collects what the panels before it have to show of a result, and sends it.

    What stands in tabs and folds is made only while a browser has it in view: each says what it has. Those of
    ``has_viewers()`` cannot say anything, so while there are some, all is made.
    """

    def __init__(self, gui: viser.GuiApi, flush: Callable[[], None], has_viewers: Callable[[], bool]) -> None:
        self._flush, self._has_viewers = flush, has_viewers
        self.held = threading.RLock()
        self._serials = itertools.count(1)
        self._html: dict[str, str] = {}
        self._makers: dict[str, Callable[[], str]] = {}
        self._in_view: dict[int, set[str]] = {}
        self._data: dict[str, Any] = {}
        self._handle, self._aside = gui.add_html(""), gui.add_html("")

    def place(self, gui: viser.GuiApi, name: str, order: float | None = None) -> None:
        """Add the place where the HTML of this name is shown."""
        gui.add_html(f'<dockpose-live name="{name}"></dockpose-live>', order=order)

    def put_html(self, name: str, html: str) -> None:
        """Set what is shown at a place, from the next message on."""
        self._html[name] = html

    def put_folded(self, name: str, make: Callable[[], str]) -> None:
        """Set what makes the HTML at a place that is not always in view."""
        self._makers[name] = make

    def look(self, names: set[str], client: viser.ClientHandle) -> None:
        """Take note of the places that a browser has in view, and send what it was not sent."""
        with self.held:
            known, self._in_view[client.client_id] = self._names_in_view(), names
            if names & self._makers.keys() - known:
                self.send()

    def forget(self, client: viser.ClientHandle) -> None:
        """Forget a browser that left."""
        self._in_view.pop(client.client_id, None)

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Send all to a new browser that cannot say what it has in view."""
        if self._has_viewers():
            self.send()

    def put(self, **data: Any) -> None:
        """Set data for the elements of static/, from the next message on."""
        self._data |= data

    def send_aside(self, name: str, data: Any) -> None:
        """Send what is too long for every message; a browser that comes later gets what was sent last."""
        self._aside.content = data_html(name, data)

    def send(self) -> None:
        """Send all as it is now, once there is a first result."""
        with self.held:
            if "picture" not in self._data:
                return
            seen = self._names_in_view()
            html = self._html | {name: make() for name, make in self._makers.items() if name in seen}
            everything = {"serial": next(self._serials), **self._data, "html": html}
            self._handle.content = data_html("page", everything)
            self._flush()

    def show(self, analysis: Analysis) -> None:
        """Send what the panels put."""
        self.send()

    def _names_in_view(self) -> set[str]:
        """The places that are in view in any browser."""
        return set(self._makers) if self._has_viewers() else set().union(*self._in_view.values())
