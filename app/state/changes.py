"""Changes of what is searched for and how, poses by hand, and chips for what rules the next picture too."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from dockpose import Dock, Settings
from dockpose.app.drawing.numbers import QUANTITIES, count
from dockpose.app.errors import UserError
from dockpose.app.state.camera import is_in_force, with_given_values, with_my_tank, with_own_dock
from dockpose.app.state.parameters import LEAST_LIGHTS, checked_number, put
from dockpose.app.state.undo import difference_words
from dockpose.app.state.view import MeasuredPose, View
from dockpose.lights.by_hand import ByHand
from dockpose.lights.masks import Mask
from dockpose.pose.circle import CirclePose
from msgspec.structs import replace as changed

MAX_LIGHTS = 60
_LONGEST = 1000  # letters of the angles
MAX_MASKS = 40
# Name and unit of a measured pose's numbers, and how far to either side they may be.
MEASURED_LIMITS = dict(zip(QUANTITIES, (5000.0, 5000.0, 5000.0, 90.0, 90.0), strict=True))


def with_angles(view: View, text: Any) -> View:
    """Set the angle of each light around the ring, in degrees; the number of lights follows."""
    angles = _numbers(text, "A light angle", "degrees, as in 0, 36, 72")
    dock = view.dock
    if not angles:
        return replace(view, dock=changed(dock, angles_deg=()))
    if not LEAST_LIGHTS <= len(angles) <= MAX_LIGHTS:
        raise UserError(
            f"There {'is 1 light angle' if len(angles) == 1 else f'are {len(angles)} light angles'}; a dock has "
            f"{LEAST_LIGHTS} to {MAX_LIGHTS} lights."
        )
    offsets_m = dock.offsets_m if len(dock.offsets_m) == len(angles) else ()
    dock = changed(dock, lights=len(angles), angles_deg=angles, offsets_m=offsets_m)
    return replace(view, dock=dock)


def angles_text(dock: Dock) -> str:
    """Return the angles as :func:`with_angles` reads them; blank for evenly spaced lights."""
    return ", ".join(f"{angle:.10g}" for angle in dock.angles_deg)


def with_extra_lights(view: View, text: Any) -> View:
    """Set where lamps out of the ring's plane are, in cm: x, y, z of each, or z alone of one behind the middle."""
    if not isinstance(text, str) or len(text) > _LONGEST:
        raise UserError(f"The extra lights' places are not text of at most {_LONGEST} letters.")
    places = []
    for words in filter(str.strip, text.split(";")):
        numbers = _numbers(words, "An extra light's place", "centimetres, as in 5 or 0, 0, 5")
        if len(numbers) not in (1, 3):
            raise UserError(
                f"An extra light's place is {words.strip()[:20]!r}; it must be z, or x, y, z, in centimetres."
            )
        places.append(tuple(round(number / 100, 6) for number in (0.0, 0.0, *numbers)[-3:]))
    return replace(view, dock=changed(view.dock, extra_lights_m=tuple(places)))


def extra_lights_text(dock: Dock) -> str:
    """Return the places as :func:`with_extra_lights` reads them; blank where there are none."""
    return "; ".join(", ".join(f"{100 * value:.10g}" for value in place) for place in dock.extra_lights_m)


def dropped_sentence(before: Dock, after: Dock) -> str:
    """Say what was dropped with a new number of lights; empty if nothing was."""
    parts = []
    if before.angles_deg and not after.angles_deg:
        parts.append(f"the {len(before.angles_deg)} angles, so the lights are taken to be evenly spaced")
    if before.offsets_m and not after.offsets_m:
        parts.append(f"the {len(before.offsets_m)} measured places, so the lights are taken to be on the circle")
    if not parts:
        return ""
    return f"With another number of lights these no longer fit: {'; '.join(parts)}. Undo (Ctrl+Z) brings them back."


def _numbers(text: Any, name: str, unit: str) -> tuple[float, ...]:
    if not isinstance(text, str) or len(text) > _LONGEST:
        raise UserError(f"{name} is not text of at most {_LONGEST} letters.")
    numbers = []
    for word in filter(None, re.split(r"[,;\s°]+", text)):
        try:
            numbers.append(checked_number(name, float(word)))
        except ValueError as error:
            raise UserError(f"{name} is {word[:20]!r}; it must be a number of {unit}.") from error
    return tuple(numbers)


def with_method(view: View, method: Any, level: Any = None) -> View:
    """Set the threshold method, and the level of the method "fixed"; None keeps the level. Other methods have none."""
    if method != "fixed":
        return _with_settings(view, method=method, level=None)
    return _with_settings(view if level is None else put(view, "level", level), method=method)


def with_centroid(view: View, centroid: Any) -> View:
    """Set how a light's centre is found: "grey" or "binary"."""
    return _with_settings(view, centroid=centroid)


def with_mask(view: View, left: Any, top: Any, width: Any, height: Any) -> View:
    """Hide a rectangle of the picture, in pixels; what reaches beyond the picture is cut off."""
    if len(view.settings.masks) >= MAX_MASKS:
        raise UserError(f"There are {MAX_MASKS} masks already; remove one first.")
    x, y = checked_number("The mask's left edge", left), checked_number("The mask's top edge", top)
    wide, high = checked_number("The mask's width", width), checked_number("The mask's height", height)
    rows, columns = view.image.shape[:2]
    right, bottom = min(x + wide, columns), min(y + high, rows)
    x, y = max(x, 0.0), max(y, 0.0)
    if right <= x or bottom <= y:
        raise UserError(
            f"A mask of {wide:g} x {high:g} px at ({left:g}, {top:g}) covers nothing of a picture of "
            f"{columns} x {rows} px."
        )
    return _with_settings(view, masks=(*view.settings.masks, (x, y, right - x, bottom - y)))


def without_mask(view: View, label: Any) -> View:
    """Remove the mask of that label, see :func:`mask_labels`."""
    labels = mask_labels(view.settings.masks)
    if label not in labels:
        raise UserError("There is no such mask any more.")
    index = labels.index(label)
    return _with_settings(view, masks=view.settings.masks[:index] + view.settings.masks[index + 1 :])


def without_masks(view: View) -> View:
    """Remove all masks."""
    return _with_settings(view, masks=())


def mask_labels(masks: Sequence[Mask]) -> list[str]:
    """What each mask is called: its number, size and upper left corner, in pixels."""
    return [
        f"{number}: {width:g} × {height:g} px at ({x:g}, {y:g})"
        for number, (x, y, width, height) in enumerate(masks, start=1)
    ]


def _with_settings(view: View, **changes: Any) -> View:
    return replace(view, settings=changed(view.settings, **changes))


def with_pose_by_hand(view: View, pose: CirclePose | None) -> View:
    """Use this pose, whichever is the likelier; None leaves the choice to the program."""
    if pose is None:
        return replace(view, by_hand=None)
    x, y, z = (float(value) for value in pose.normal)
    return replace(view, by_hand=(x, y, z))


def with_set_lights(view: View, lights_px: Any, snap: Any) -> View:
    """Take the lights that the operator set, in pixels, and of each whether the spot there is taken; None: search."""
    if lights_px is None:
        return replace(view, set_lights=None)
    most, count = view.dock.lights or MAX_LIGHTS, len(lights_px)
    if count > most:
        raise UserError(f"{count} lights are set, and the dock has {most}; take one away, or set the number of lights.")
    height, width = view.image.shape[:2]
    return replace(view, set_lights=ByHand.checked(lights_px, snap if count else False, width, height))


def with_measured(view: View, values: Mapping[str, Any] | None) -> View:
    """Compare with a pose measured by hand: centimetres and degrees by the names in ``MEASURED_LIMITS``, or None."""
    if values is None:
        return replace(view, measured=None)
    numbers = []
    for name, limit in MEASURED_LIMITS.items():
        value = values.get(name)
        number = None if value is None else checked_number(f"The measured {name}", value)
        if number is not None and abs(number) > limit:
            raise UserError(f"The measured {name} is {number:g}; it must be from {-limit:g} to {limit:g}.")
        numbers.append(number)
    return replace(view, measured=MeasuredPose(*numbers))


_DEFAULT = Settings()
_MOST_MASKS = 2  # with a chip each; more have one for all


@dataclass(frozen=True)
class Chip:
    """What a button says, what it is for, and what pressing it does to the view; or the tab that it opens instead."""

    label: str
    hint: str
    press: Callable[[View], View]
    opens: str = ""


def chips(view: View, fitting_lights: int | None = None, *, has_pose: bool = True) -> list[Chip]:
    """Return what to do next, and all that holds beyond this picture and is not as the program would have it."""
    found = []
    if fitting_lights is not None:
        press = partial(put, name="lights", value=fitting_lights)
        found.append(Chip(f"Set the number of lights to {fitting_lights}", "Evenly spaced.", press))
    if view.camera_of == "guess":
        found.append(Chip("Load the camera's file", "Or calibrate it: tab Calibrate.", lambda view: view, "Tank"))
    if not has_pose:
        found.append(Chip("Look at all methods", "And take one that finds the dock.", lambda view: view, "Compare"))
    if view.dock_of == "guess":
        hint = "Distances are in proportion to the diameter. Press if it is right; otherwise set it in the tab Tank."
        label = f"The dock's diameter is assumed. Is it {100 * view.dock.diameter:g} cm?"
        found.append(Chip(label, hint, lambda view: with_own_dock(view, view.dock)))
    is_simulated = view.scene is not None  # by its own camera and dock
    if (view.tank.camera is not None or view.camera_of == "tank") and not (is_simulated or is_in_force(view)):
        mine = with_my_tank(view)
        if (mine.camera, mine.dock) != (view.camera, view.dock):
            hint = "Look at this picture with the operator's own camera and dock."
            found.append(Chip("Use My tank for this picture", hint, with_my_tank))
    return found + _removable(view)


def _removable(view: View) -> list[Chip]:
    settings, found = view.settings, []

    def add(words: str, hint: str, press: Callable[[View], View]) -> None:
        found.append(Chip(f"{words}  ✕", f"{hint} Press to remove.", press))

    def reset(*names: str) -> Callable[[View], View]:
        defaults = {name: getattr(_DEFAULT, name) for name in names}
        return lambda view: replace(view, settings=changed(view.settings, **defaults))

    given = with_given_values(view)
    if (given.camera, given.dock) != (view.camera, view.dock):
        add(
            f"Not as given: {difference_words(given, view)}",
            "Camera or dock are not those of the file.",
            with_given_values,
        )
    if view.set_lights is not None:
        add("Lights set by hand", "In this picture.", lambda view: with_set_lights(view, None, None))
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
