"""What plays sequences on the page: the one that is open, and the others that can be chosen."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import viser
from dockpose.app.inputs.sequences import FrameSource, choices, choose, sent
from dockpose.app.processing.following import FrameFollower
from dockpose.app.processing.player import FramePlayer
from dockpose.app.state.scene import scene_of
from dockpose.app.state.view import View
from dockpose.app.web.notifications import Colour, attempt
from dockpose.sources import Frame

NONE_CHOSEN = "(none)"


class Stage(Protocol):
    """The page, as far as a sequence needs it."""

    @property
    def view(self) -> View:
        """What is shown at this moment."""
        ...

    def show_frame(self, frame: Frame) -> None:
        """Search and show a frame; returns when that is done, or was given up for something newer."""
        ...

    def notify(self, title: str, sentence: str, colour: Colour, client: viser.ClientHandle | None) -> None:
        """Show a notification in one browser, or in all."""
        ...

    def fail(self, error: Exception) -> None:
        """Tell of an error that nobody expected."""
        ...


class SequenceController:
    """Holds one sequence at a time.

    Parameters
    ----------
    stage : where frames are shown.
    given : the sequence that was given at the start, if any.
    root : the folder on this machine that may be shown; None for none.

    Attributes
    ----------
    player, follower : play and search the open sequence; None where none is open.
    on_change : called with the name of the sequence that was opened, None when it was closed.
    on_rest : called when playing paused or came to the end.
    """

    def __init__(self, stage: Stage, given: FrameSource | None, root: Path | None) -> None:
        self._stage, self._given, self._root = stage, given, root
        self._lock = threading.Lock()
        self._source: FrameSource | None = None
        self.player: FramePlayer | None = None
        self.follower: FrameFollower | None = None
        self.on_change: Callable[[str | None], None] = lambda name: None
        self.on_rest: Callable[[], None] = lambda: None

    @property
    def is_playing(self) -> bool:
        """Whether frames follow each other by themselves at this moment."""
        return self.player is not None and self.player.is_playing

    @property
    def name(self) -> str | None:
        """Of the sequence that is open."""
        return None if self._source is None else self._source.name

    def names(self) -> list[str]:
        """Of the sequences that can be chosen."""
        return choices(self._given, self._root)

    def choose(self, name: Any, client: viser.ClientHandle) -> None:
        """Open one of them in place of what is open; where that cannot be done, say so and change nothing."""
        if name == NONE_CHOSEN:
            self.close()
            return
        self._try(lambda: choose(name, self._given, self._root, scene_of(self._stage.view)), client)

    def take(self, data: bytes, name: str, client: viser.ClientHandle) -> None:
        """Open a video that was sent, in the same way."""
        self._try(lambda: sent(data, name), client)

    def open_given(self) -> None:
        """Open the sequence that was given at the start, if any. Raises ValueError where that cannot be done."""
        if self._given is not None:
            self.open(self._given)

    def open(self, source: FrameSource) -> None:
        """Show the first frame of a sequence, or begin to play where it is live."""
        frames = source.open(self.tell)
        self.close()
        with self._lock:
            self._source, self.follower = source, FrameFollower(frames, source.name)
            self.player = FramePlayer(frames, self._stage.show_frame, lambda: self.on_rest(), self._show_error)
        self.on_change(source.name)

    def play(self, is_playing: bool) -> None:
        """Go on, or pause."""
        if self.player is not None:
            self.player.play(is_playing)
            if not is_playing:
                self.on_rest()

    def close(self) -> None:
        """Let go of what is open, if anything."""
        with self._lock:
            player, source = self.player, self._source
            self.player = self.follower = self._source = None
        if player is not None and source is not None:
            player.close()
            source.discard()
            self.on_change(None)

    def tell(self, sentence: str) -> None:
        """Say what became of a source: frames that were skipped, a stream that went away or came back."""
        self._stage.notify("About the sequence", sentence, "yellow", None)

    def _try(self, resolving: Callable[[], FrameSource], client: viser.ClientHandle) -> None:
        if not attempt(lambda: self.open(resolving()), self._stage.notify, self._stage.fail, client):
            self.on_change(self.name)

    def _show_error(self, error: Exception) -> None:
        if isinstance(error, ValueError):
            self._stage.notify("The sequence ended", str(error), "red", None)
        else:
            self._stage.fail(error)
        self.on_rest()
