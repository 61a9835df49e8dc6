"""Notifications in a corner of the page; bursts, as from forty bad files, are merged."""

import threading
import time
from dataclasses import dataclass, field
from typing import Literal

import viser

Colour = Literal["red", "yellow", "green"]
SHOWN_S = 12.0
_RUSH_S = 2.0
_MOST_SENTENCES = 6


@dataclass
class _Notice:
    handle: viser.NotificationHandle
    title: str
    at_s: float
    sentences: list[str] = field(default_factory=list)


class Notifications:
    """Shows notifications in browsers, merging bursts."""

    def __init__(self) -> None:
        self._last: dict[int, _Notice] = {}
        self._lock = threading.Lock()

    def show(self, title: str, sentence: str, colour: Colour, client: viser.ClientHandle) -> None:
        """Notify one browser; within two seconds of a notification with this title, extend that one."""
        now = time.monotonic()
        with self._lock:
            last = self._last.get(client.client_id)
            if last is not None and last.title == title and now - last.at_s < _RUSH_S:
                last.at_s = now
                last.sentences.append(sentence)
                last.handle.body = together(last.sentences)
                return
            handle = client.add_notification(title, sentence, color=colour, auto_close_seconds=SHOWN_S)
            self._last[client.client_id] = _Notice(handle, title, now, [sentence])

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
