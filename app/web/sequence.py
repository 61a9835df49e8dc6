"""The sequence that is open on the page, and the others that can be chosen."""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import viser
from dockpose.app.inputs.sequences import FrameSource, choices, choose, sent
from dockpose.app.processing.following import FrameFollower
from dockpose.app.processing.player import FramePlayer
from dockpose.app.state.scene import scene_of

NONE_CHOSEN = "(none)"


class SequenceController:
    """Holds one sequence at a time, and shows its frames through the page's App."""

    def __init__(self, stage: Any, given: FrameSource | None, root: Path | None) -> None:
        self._stage, self._given, self._root = stage, given, root
        self._lock = threading.Lock()
        self._source: FrameSource | None = None
        self.player: FramePlayer | None = None
        self.follower: FrameFollower | None = None

    @property
    def is_playing(self) -> bool:
        """Whether the sequence is playing now."""
        return self.player is not None and self.player.is_playing

    @property
    def name(self) -> str | None:
        """Name of the open sequence, if any."""
        return None if self._source is None else self._source.name

    @property
    def is_sent(self) -> bool:
        """Whether the open sequence was sent by a browser."""
        return self._source is not None and self._source.folder is not None

    def names(self) -> list[str]:
        """Return the names of the sequences that can be chosen."""
        return choices(self._given, self._root)

    def choose(self, name: Any, client: viser.ClientHandle) -> None:
        """Open a sequence in place of the open one; if that fails, say so and change nothing."""
        if name == NONE_CHOSEN:
            self.close()
            return
        self._try(lambda: choose(name, self._given, self._root, scene_of(self._stage.view)), client)

    def take(self, data: bytes, name: str, client: viser.ClientHandle) -> None:
        """Open an uploaded video, in the same way."""
        self._try(lambda: sent(data, name), client)

    def open_given(self) -> None:
        """Open the sequence given at the start, if any. Raises ValueError if it cannot be opened."""
        if self._given is not None:
            self.open(self._given)

    def open(self, source: FrameSource) -> None:
        """Show the first frame of a sequence; start playing if it is live."""
        frames = source.open(self.tell)
        self.close()
        with self._lock:
            self._source, self.follower = source, FrameFollower(frames, source.name, self.tell)
            self.player = FramePlayer(frames, self._stage.show_frame, self._stage.on_rest, self._show_error)
        self._stage.on_sequence(source.name)

    def play(self, is_playing: bool) -> None:
        """Play or pause."""
        if self.player is not None:
            self.player.play(is_playing)
            if not is_playing:
                self._stage.on_rest()

    def close(self) -> None:
        """Close the open sequence, if any."""
        with self._lock:
            player, source = self.player, self._source
            self.player = self.follower = self._source = None
        if player is not None and source is not None:
            player.close()
            source.discard()
            self._stage.on_sequence(None)

    def tell(self, sentence: str) -> None:
        """Report on the source: skipped frames, a stream lost or restored."""
        self._stage.notify("About the sequence", sentence, "yellow", None)

    def _try(self, resolving: Callable[[], FrameSource], client: viser.ClientHandle) -> None:
        if not self._stage.attempt(lambda: self.open(resolving()), client):
            self._stage.on_sequence(self.name)

    def _show_error(self, error: Exception) -> None:
        if isinstance(error, ValueError):
            self._stage.notify("The sequence ended", str(error), "red", None)
        else:
            self._stage.fail(error)
        self._stage.on_rest()
