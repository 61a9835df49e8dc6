"""Undo and redo of the operator's changes to one picture."""

import itertools
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import msgspec
from dockpose.app.state.camera import with_tank
from dockpose.app.state.parameters import PARAMETERS
from dockpose.app.state.tank import Tank
from dockpose.app.state.view import View

_LONGEST = 100
_ONE_MOVE_S = 3.0  # between changes of a slider that is dragged, which are undone at once, until it is let go
_NOTED = ("camera", "dock", "settings", "scene", "by_hand", "set_lights", "measured", "tank", "camera_of", "dock_of")


class History:
    """Remembers views, and of other pictures My tank as it was. ``clock`` gives seconds."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._past: list[View | Tank] = []
        self._future: list[View | Tank] = []
        self._last_names: set[str] = set()
        self._last_s = -_ONE_MOVE_S
        self._returned_to: View | None = None

    def note(self, before: View, after: View) -> None:
        """Record a change; another picture, which brings its own camera and scene, leaves only My tank to be undone."""
        if after is before or after is self._returned_to:
            return
        self._returned_to = None
        if after.image is not before.image:
            self.forget()
            return
        names, now = changed_names(before, after), self._clock()
        if not names:
            return
        # What the first change made, as a fixed level or My tank's camera, later ones change within.
        is_same = all(any(f"{name}.".startswith(f"{last}.") for last in self._last_names) for name in names)
        if not is_same or now - self._last_s >= _ONE_MOVE_S or not self._past:
            self._past, self._last_names = [*self._past, before][-_LONGEST:], names
        self._future, self._last_s = [], now

    def end_move(self) -> None:
        """Say that a slider was let go: what changes next is undone by itself."""
        self._last_names = set()

    def forget(self) -> None:
        """Forget all but My tank as it was: the picture is another one."""
        self._past, self._future = _tanks(self._past), _tanks(self._future)

    def undo(self, view: View) -> View:
        """The view before the last change; the same one where there is none."""
        return self._return(view, self._past, self._future)

    def redo(self, view: View) -> View:
        """The view before the last undo; the same one where there is none."""
        return self._return(view, self._future, self._past)

    def _return(self, view: View, here: list[View | Tank], there: list[View | Tank]) -> View:
        while here and here[-1] == view.tank:  # what was undone on that picture was not of My tank
            here.pop()
        if not here:
            return view
        there.append(view)
        self._last_names, last = set(), here.pop()
        self._returned_to = last if isinstance(last, View) else with_tank(view, last)
        if view.list_name == "sequence":  # its frames go on meanwhile
            of_frame = {name: getattr(view, name) for name in ("image", "source", "sha256")}
            if view.image is not self._returned_to.image:
                of_frame["set_lights"] = view.set_lights
            self._returned_to = replace(self._returned_to, **of_frame)
        return self._returned_to


def _tanks(entries: list[View | Tank]) -> list[View | Tank]:
    """My tank in each of these, once where it stayed the same."""
    tanks = [entry.tank if isinstance(entry, View) else entry for entry in entries]
    return [tank for tank, _ in itertools.groupby(tanks)]


def difference_words(before: View, after: View) -> str:
    """Say what changed: "fx (px): 720 → 710. My tank: Dock diameter (cm): 40 → 30."; empty where nothing did."""
    told = {label: f"{label}: {old:g} → {new:g}" for label, old, new in _numbers(before, after)}
    tanks = [replace(one, camera=one.tank.camera or one.camera, dock=one.tank.dock) for one in (before, after)]
    mine = [f"My tank: {label}: {old:g} → {new:g}" for label, old, new in _numbers(*tanks) if label not in told]
    other = sorted({name.rpartition(".")[2].replace("_", " ") for name in changed_names(before, after)})
    return ". ".join([*told.values(), *mine] or [", ".join(other)])


def _numbers(before: View, after: View) -> list[tuple[str, float, float]]:
    """Label, old and new number of each parameter that changed."""
    known = [one for one in PARAMETERS.values() if one.path != "settings.level"]  # which there may be none of
    numbers = [(one.label, one.get(before), one.get(after)) for one in known]
    return [(label, old, new) for label, old, new in numbers if not math.isclose(old, new, rel_tol=1e-9)]


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
