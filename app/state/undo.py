"""Undo and redo of the operator's changes to one picture."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
from dockpose.app.state.view import View

_LONGEST = 100
_ONE_MOVE_S = 0.8  # a slider that is dragged changes many times, and is undone at once
_NOTED = ("camera", "dock", "settings", "scene", "by_hand", "measured", "tank", "camera_of", "dock_of")


class History:
    """Remembers views. ``clock`` gives seconds."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._past: list[View] = []
        self._future: list[View] = []
        self._last_names: set[str] = set()
        self._last_s = -_ONE_MOVE_S
        self._returned_to: View | None = None

    def note(self, before: View, after: View) -> None:
        """Record a change; another picture clears the history, since it brings its own camera and scene."""
        if after is before or after is self._returned_to:
            return
        self._returned_to = None
        if after.image is not before.image:
            self.forget()
            return
        names, now = changed_names(before, after), self._clock()
        if not names:
            return
        is_same_move = names == self._last_names and now - self._last_s < _ONE_MOVE_S
        if not is_same_move or not self._past:
            self._past = [*self._past, before][-_LONGEST:]
        self._future = []
        self._last_names, self._last_s = names, now

    def forget(self) -> None:
        """Forget all."""
        self._past, self._future = [], []

    def undo(self, view: View) -> View:
        """The view before the last change; the same one where there is none."""
        return self._return(view, self._past, self._future)

    def redo(self, view: View) -> View:
        """The view before the last undo; the same one where there is none."""
        return self._return(view, self._future, self._past)

    def _return(self, view: View, here: list[View], there: list[View]) -> View:
        if not here:
            return view
        there.append(view)
        self._last_names = set()
        self._returned_to = here.pop()
        if view.list_name == "sequence":  # its frames go on meanwhile
            self._returned_to = replace(self._returned_to, image=view.image, source=view.source, sha256=view.sha256)
        return self._returned_to


def changed_names(before: View, after: View) -> set[str]:
    """Which numbers differ, as "camera.fx"."""
    names = {name for name in _NOTED if getattr(before, name) is not getattr(after, name)}
    return {one for name in names for one in _differences(name, getattr(before, name), getattr(after, name))}


def _differences(name: str, before: Any, after: Any) -> set[str]:
    if before is after or before == after:
        return set()
    if type(before) is not type(after) or not isinstance(before, msgspec.Struct):
        return {name}
    parts = [(f"{name}.{part}", getattr(before, part), getattr(after, part)) for part in before.__struct_fields__]
    return {one for part in parts if part[1] != part[2] for one in _differences(*part)}
