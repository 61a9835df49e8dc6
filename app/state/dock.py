"""Changes of the dock: how many lights it has, and where they are on the ring."""

import re
from dataclasses import replace
from typing import Any

from dockpose import Dock
from dockpose.app.errors import UserError
from dockpose.app.state.parameters import checked_number
from dockpose.app.state.view import View
from msgspec.structs import replace as changed

MAX_LIGHTS = 60
_MIN_LIGHTS = 3
_LONGEST = 1000


def with_lights(view: View, value: Any) -> View:
    """Set the number of lights, 0 for unknown; angles and colours that were given light by light are dropped."""
    number = round(checked_number("The number of lights", value))
    lights = None if number <= 0 else min(max(number, _MIN_LIGHTS), MAX_LIGHTS)
    return view if lights == view.dock.lights else replace(view, dock=Dock(view.dock.diameter, lights))


def with_angles(view: View, text: Any) -> View:
    """Set the angle of each light around the ring, in degrees; the number of lights follows."""
    angles = _numbers(text)
    dock = view.dock
    if not angles:
        return replace(view, dock=changed(dock, angles_deg=()))
    if not _MIN_LIGHTS <= len(angles) <= MAX_LIGHTS:
        raise UserError(
            f"There {'is 1 light angle' if len(angles) == 1 else f'are {len(angles)} light angles'}; a dock has "
            f"{_MIN_LIGHTS} to {MAX_LIGHTS} lights."
        )
    colours = dock.colours if len(dock.colours) == len(angles) else ()
    return replace(view, dock=changed(dock, lights=len(angles), angles_deg=angles, colours=colours))


def angles_text(dock: Dock) -> str:
    """Return the angles as :func:`with_angles` reads them; blank for evenly spaced lights."""
    return ", ".join(f"{angle:.10g}" for angle in dock.angles_deg)


def dropped_sentence(before: Dock, after: Dock) -> str:
    """Say which angles and colours were dropped with a new number of lights; empty if none were."""
    parts = []
    if before.angles_deg and not after.angles_deg:
        parts.append(f"the {len(before.angles_deg)} angles, so the lights are taken to be evenly spaced")
    if before.colours and not after.colours:
        parts.append(f"the {len(before.colours)} colours, so the lights are taken to be all alike")
    if not parts:
        return ""
    return f"With another number of lights these no longer fit: {'; '.join(parts)}. Undo (Ctrl+Z) brings them back."


def _numbers(text: Any) -> tuple[float, ...]:
    if not isinstance(text, str) or len(text) > _LONGEST:
        raise UserError(f"The light angles are not text of at most {_LONGEST} letters.")
    return tuple(_number(word) for word in re.split(r"[,;\s°]+", text) if word)


def _number(word: str) -> float:
    try:
        return checked_number("A light angle", float(word))
    except ValueError as error:
        raise UserError(f"A light angle is {word[:20]!r}; it must be a number of degrees, as in 0, 36, 72.") from error
