"""Notifications in a corner of the page; bursts, as from forty bad files, are merged."""

import threading
import time
from typing import Literal

import viser
from dockpose.app.web.server.viser_private import show_again

Colour = Literal["red", "yellow", "green"]
REFUSED = "That did not work"
SHOWN_S = 12.0
_RUSH_S = 2.0
_MOST_SENTENCES = 6


class Notifications:
    """Shows notifications in browsers, merging bursts."""

    def __init__(self) -> None:
        # Of each browser its newest notification, with its title, sentences and time.
        self._last: dict[int, tuple[viser.NotificationHandle, str, list[str], float]] = {}
        self._lock = threading.Lock()

    def show(self, title: str, sentence: str, colour: Colour, client: viser.ClientHandle) -> None:
        """Notify one browser; within two seconds of a notification with this title, extend that one."""
        now = time.monotonic()
        with self._lock:
            handle, told, sentences, at_s = self._last.get(client.client_id, (None, "", [], 0.0))
            if handle is not None and told == title and now - at_s < _RUSH_S:
                sentences = sentences if sentence in sentences else [*sentences, sentence]
                handle.body = together(sentences)
                handle.auto_close_seconds = SHOWN_S + len(sentences) / 1000  # only another time starts it again
                show_again(handle)
            else:
                handle = client.add_notification(title, sentence, color=colour, auto_close_seconds=SHOWN_S)
                sentences = [sentence]
            self._last[client.client_id] = handle, title, sentences, now

    def withdraw(self) -> None:
        """Take away refusals, but of this rush: what was done since is not what they were told of."""
        with self._lock:
            for number, (handle, title, _, at_s) in list(self._last.items()):
                if title == REFUSED and time.monotonic() - at_s > _RUSH_S:
                    handle.remove()
                    del self._last[number]

    def forget(self, client: viser.ClientHandle) -> None:
        """Forget a browser that left."""
        with self._lock:
            self._last.pop(client.client_id, None)


def together(sentences: list[str]) -> str:
    """Join sentences: the first few, how many are left out, and the last."""
    if len(sentences) <= _MOST_SENTENCES:
        return " | ".join(sentences)
    left_out = len(sentences) - _MOST_SENTENCES
    return " | ".join([*sentences[: _MOST_SENTENCES - 1], f"({left_out} more)", sentences[-1]])
