"""What an operator does in our own elements of the page: wishes that come through one hidden text box."""

from collections.abc import Callable
from typing import Any

import msgspec
import viser
from dockpose.app.web.server.viser_private import identity
from dockpose.app.web.widgets import Panel, on_person

_LONGEST = 300  # letters


class Wish(msgspec.Struct, tag_field="do", forbid_unknown_fields=True, frozen=True):
    """A wish; ``number`` tells two equal ones apart."""

    number: int


class Take(Wish, tag="take", frozen=True):
    """Log the frame that is shown."""


class Zip(Wish, tag="zip", frozen=True):
    """Save everything as one ZIP file."""


class Compare(Wish, tag="compare", frozen=True):
    """Compare the methods, unless what is shown there is of now."""


class Use(Wish, tag="use", frozen=True):
    """Take a threshold method."""

    method: str


class Play(Wish, tag="play", frozen=True):
    """Play, or pause."""


class GoTo(Wish, tag="goto", frozen=True):
    """Show a frame of the sequence, counted from 0."""

    frame: int


class Speed(Wish, tag="speed", frozen=True):
    """Play at one of the speeds on offer."""

    speed: str


Acts = dict[type[Wish], Callable[[Any, viser.ClientHandle], object]]


class JobsPanel(Panel):
    """The bar of main jobs, static/jobs.js, and what is done for the wishes of all elements that use its text box."""

    def __init__(self, gui: viser.GuiApi, acts: Acts) -> None:
        self._acts, self._last = acts, -1
        union: Any = None
        for kind in acts:
            union = kind if union is None else union | kind
        self._decoder = msgspec.json.Decoder(union)
        self._box = gui.add_text("Done on the page", "")
        gui.add_html(f'<dockpose-jobs channel="{identity(self._box)}"></dockpose-jobs>')
        on_person(self._box.on_update, self._fulfil)

    def _fulfil(self, client: viser.ClientHandle) -> None:
        """Do what the newest wish says; calls for wishes that were overtaken find none."""
        text = self._box.value
        try:
            wish = self._decoder.decode(text if isinstance(text, str) and len(text) <= _LONGEST else "")
        except msgspec.DecodeError:
            return
        if wish.number != self._last:
            self._last = wish.number
            self._acts[type(wish)](wish, client)
