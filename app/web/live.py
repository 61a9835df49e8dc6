"""Our own elements of the page: what they are sent with every frame, and the requests that come back from them."""

import base64
import functools
import itertools
import json
import operator
import threading
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from html import escape
from typing import Any

import msgspec
import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.choices import Client, on_person
from dockpose.app.web.server.values import MOST_LETTERS
from dockpose.app.web.server.viser_private import identity


def data_html(name: str, data: Any) -> str:
    """Return data for an element of static/, which reads it by that name."""
    text = json.dumps(data, separators=(",", ":"), allow_nan=False)
    return f'<dockpose-data name="{name}" hidden>{escape(text, quote=False)}</dockpose-data>'


class LivePage:
    """Collects what the panels before it have to show of a result, and sends it."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server, self._gui, self.held = server, server.gui, threading.RLock()
        self._serials = itertools.count(1)
        self._html_of: dict[str, Callable[[Analysis], str]] = {}
        self._html: dict[str, str] = {}
        self._data: dict[str, Any] = {}
        self._shown: Analysis | None = None
        self.results = 0  # that were shown so far

    def begin(self) -> None:
        """Add to the page what carries the data."""
        self._handle, self._aside = self._gui.add_html(""), self._gui.add_html("")

    def place(self, name: str, html_of: Callable[[Analysis], str], order: float | None = None) -> None:
        """Add a place for the HTML that ``html_of`` makes of each result."""
        self._gui.add_html(f'<dockpose-live name="{name}"></dockpose-live>', order=order)
        self._html_of[name] = html_of

    def put_html(self, name: str, html: str) -> None:
        """Set what is shown at a place, from the next message on."""
        self._html[name] = html

    def put(self, **data: Any) -> None:
        """Set data for the elements of static/, from the next message on."""
        self._data |= data

    def shell(self, jpeg_of: Callable[[Analysis], bytes]) -> str:
        """Return what a browser shows of the last result until its page is built, with its picture; "" without."""
        with self.held:
            found, number, html = self._shown, self.results, dict(self._html)
        if found is None or not (jpeg := jpeg_of(found)):
            return ""
        strip, poses = (f'<div name="{name}">{html[name]}</div>' for name in ("strip", "candidates"))
        picture = f'<img alt="" src="data:image/jpeg;base64,{base64.b64encode(jpeg).decode()}">'
        return f'<div id="shell" data-result="{number}">{strip}{picture}{poses}</div>'

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
            self._server.flush()

    def show(self, analysis: Analysis) -> None:
        """Send what the panels put, and the HTML of all places."""
        self._shown, self.results = analysis, self.results + 1
        for name, html_of in self._html_of.items():
            self._html[name] = html_of(analysis)
        self.send()


class Request(msgspec.Struct, tag_field="do", forbid_unknown_fields=True, frozen=True):
    """A request; ``number`` tells two equal ones apart."""

    number: int


Acts = Mapping[type[Request], Callable[[Any, Client], object]]


def request_to(do: str, **fields: type) -> type[Request]:
    """A kind of request, with its fields."""
    kind: Any = msgspec.defstruct(do, list(fields.items()), bases=(Request,), tag=do, frozen=True)
    return kind


def decoder(kinds: Iterable[type[Request]]) -> msgspec.json.Decoder[Any]:
    """What reads requests of these kinds, and no others."""
    return msgspec.json.Decoder(functools.reduce(operator.or_, kinds))


class RequestBox:
    """A hidden text box for the requests of elements that know it by its ``channel``; ``acts`` are done for them."""

    def __init__(self, gui: viser.GuiApi, label: str, acts: Acts | None = None) -> None:
        self.acts: Acts = {}
        self._decoder: msgspec.json.Decoder[Any] | None = None  # until there are acts, as while the page is built
        if acts is not None:
            self.heed(acts)
        self._done, self._held = deque[int](maxlen=64), threading.Lock()  # numbers; some requests are sent again
        self._box = gui.add_text(label, "")
        self.channel = identity(self._box)
        on_person(self._box.on_update, self._fulfil)

    def heed(self, acts: Acts) -> None:
        """Do these from now on."""
        self.acts, self._decoder = acts, decoder(acts)

    def _fulfil(self, client: Client) -> None:
        """Do what the newest request says; calls for requests that were overtaken find none."""
        text = self._box.value
        if self._decoder is None:
            return
        try:
            request = self._decoder.decode(text if isinstance(text, str) and len(text) <= MOST_LETTERS else "")
        except msgspec.DecodeError:
            return
        with self._held:
            if request.number in self._done:
                return
            self._done.append(request.number)
        self.acts[type(request)](request, client)
