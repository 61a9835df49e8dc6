"""What an operator does in our own elements of the page: wishes that come through hidden text boxes."""

import functools
import operator
from collections.abc import Callable, Iterable, Mapping
from typing import Any

import msgspec
import viser
from dockpose.app.web.server.viser_private import identity
from dockpose.app.web.widgets import on_person

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


Acts = Mapping[type[Wish], Callable[[Any, viser.ClientHandle], object]]


def decoder(kinds: Iterable[type[Wish]]) -> msgspec.json.Decoder[Any]:
    """What reads wishes of these kinds, and no others."""
    return msgspec.json.Decoder(functools.reduce(operator.or_, kinds))


class WishBox:
    """A hidden text box for the wishes of elements that know it by its ``channel``; ``acts`` are done for them."""

    def __init__(self, gui: viser.GuiApi, label: str, acts: Acts) -> None:
        self._acts, self._last, self._decoder = acts, -1, decoder(acts)
        self._box = gui.add_text(label, "")
        self.channel = identity(self._box)
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
