"""Whatever rules the next picture too, each as a chip that one click removes."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

from dockpose import Settings
from dockpose.app.drawing.numbers import count
from dockpose.app.state.changes import mask_labels, with_lights, with_pose_by_hand, without_mask, without_masks
from dockpose.app.state.in_force import is_in_force, with_my_tank, with_own_dock
from dockpose.app.state.view import View
from msgspec.structs import replace as changed

_DEFAULT = Settings()
_MOST_MASKS = 2  # with a chip each; more have one for all


@dataclass(frozen=True)
class Chip:
    """What a button says, what it is for, and what pressing it does to the view."""

    label: str
    hint: str
    press: Callable[[View], View]


def chips(view: View, fitting_lights: int | None = None) -> list[Chip]:
    """Return what to offer, and all that holds beyond this picture and is not as the program would have it."""
    return [*_offers(view, fitting_lights), *_removable(view)]


def _offers(view: View, fitting_lights: int | None) -> Iterator[Chip]:
    if fitting_lights is not None:
        label = f"{fitting_lights} lights form a ring; the dock is set to {view.dock.lights}. Use {fitting_lights}?"
        yield Chip(label, "Sets the number of lights, evenly spaced.", lambda view: with_lights(view, fitting_lights))
    if view.dock_of == "guess":
        hint = "Distances are in proportion to the diameter. Press if it is right; otherwise set it in the tab Tank."
        label = f"The dock's diameter is assumed. Is it {100 * view.dock.diameter:g} cm?"
        yield Chip(label, hint, lambda view: with_own_dock(view, view.dock))
    mine = with_my_tank(view)
    is_known = view.tank.camera is not None or view.camera_of == "tank"
    if is_known and not is_in_force(view) and (mine.camera, mine.dock) != (view.camera, view.dock):
        hint = "Look at this picture with the operator's own camera and dock."
        yield Chip("Use My tank for this picture", hint, with_my_tank)


def _removable(view: View) -> list[Chip]:
    settings, found = view.settings, []

    def add(words: str, hint: str, press: Callable[[View], View]) -> None:
        found.append(Chip(f"{words}  ✕", f"{hint} Press to remove.", press))

    def reset(*names: str) -> Callable[[View], View]:
        defaults = {name: getattr(_DEFAULT, name) for name in names}
        return lambda view: replace(view, settings=changed(view.settings, **defaults))

    if view.by_hand is not None:
        add("Pose chosen by hand", "For this picture.", lambda view: with_pose_by_hand(view, None))
    if settings.method == "fixed":
        add(f"Fixed level {settings.level}", "For every picture, not only this one.", reset("method", "level"))
    elif settings.method != _DEFAULT.method:
        add(f"Method {settings.method.replace('_', ' ')}", "For every picture.", reset("method", "level"))
    if settings.min_area_px != _DEFAULT.min_area_px:
        add(f"Lights of {settings.min_area_px} px or more", "Smaller ones are ignored.", reset("min_area_px"))
    if settings.centroid != _DEFAULT.centroid:
        add("Centres by the middle of the pixels", "In place of the brightness.", reset("centroid"))
    labels = mask_labels(settings.masks)
    if len(labels) > _MOST_MASKS:
        add(count(len(labels), "mask"), "They hide the same parts of every picture.", without_masks)
        labels = []
    for label in labels:
        hint = "It hides the same part of every picture."
        add(f"Mask {label}", hint, partial(without_mask, label=label))
    return found
