"""How lights are searched for: the threshold method, the kind of centroid, and masks."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from dockpose.app.errors import UserError
from dockpose.app.state.parameters import checked_number, put
from dockpose.app.state.view import View
from dockpose.lights.markers import CENTROIDS
from dockpose.lights.masks import Mask
from dockpose.thresholds import METHODS
from msgspec.structs import replace as changed

MAX_MASKS = 40


def with_method(view: View, method: Any, level: Any = None) -> View:
    """Set the threshold method, and the level of the method "fixed"; None keeps the level. Other methods have none."""
    if not isinstance(method, str) or method not in METHODS:
        raise UserError(f"There is no threshold method called {method!r}.")
    if method != "fixed":
        return _with_settings(view, method=method, level=None)
    return _with_settings(view if level is None else put(view, "level", level), method=method)


def with_centroid(view: View, centroid: Any) -> View:
    """Set how a light's centre is found: "grey" or "binary"."""
    if centroid not in CENTROIDS:
        raise UserError(f"There is no way to find a light's centre called {centroid!r}.")
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
