"""What changes with every frame, sent to the browser in one message, which static/frame.js shows at one moment."""

import itertools
import json
import threading
from collections.abc import Callable
from html import escape
from typing import Any

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.widgets import Panel


def data_html(name: str, data: Any) -> str:
    """Return data for an element of static/, which reads it by that name."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return f'<dockpose-data name="{name}" hidden>{escape(text, quote=False)}</dockpose-data>'


class LivePage(Panel):
    """Collects what the panels before it have to show of a result, and sends it."""

    def __init__(self, gui: viser.GuiApi, flush: Callable[[], None]) -> None:
        self._flush = flush
        self.held = threading.RLock()
        self._serials = itertools.count(1)
        self._html: dict[str, str] = {}
        self._data: dict[str, Any] = {}
        self._handle, self._aside = gui.add_html(""), gui.add_html("")

    def place(self, gui: viser.GuiApi, name: str, order: float | None = None) -> None:
        """Add the place where the HTML of this name is shown."""
        gui.add_html(f'<dockpose-live name="{name}"></dockpose-live>', order=order)

    def put_html(self, name: str, html: str) -> None:
        """Set what is shown at a place, from the next message on."""
        self._html[name] = html

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
            everything = {"serial": next(self._serials), **self._data, "html": self._html}
            self._handle.content = data_html("page", everything)
            self._flush()

    def show(self, analysis: Analysis) -> None:
        """Send what the panels put."""
        self.send()
