"""What the operator adds to a view by hand: masks, the kind of centroid, the choice of a pose, a measured pose.

As in :mod:`dockpose.app.state.view`, every value is checked here, and what cannot be used is refused with a sentence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import msgspec
from dockpose.app.errors import UserError
from dockpose.app.state.view import View, checked_number
from dockpose.lights.markers import CENTROIDS
from dockpose.lights.masks import Mask
from dockpose.pose.circle import CirclePose

MAX_MASKS = 40
# Name and unit of a measured pose's numbers, and how far to either side they may be.
MEASURED_LIMITS = {
    "x (cm)": 5000.0,
    "y (cm)": 5000.0,
    "z (cm)": 5000.0,
    "θx (°)": 90.0,
    "θy (°)": 90.0,
}


def with_centroid(view: View, centroid: Any) -> View:
    """Set how a light's centre is found: "grey" or "binary"."""
    if centroid not in CENTROIDS:
        raise UserError(f"There is no way to find a light's centre called {centroid!r}.")
    return replace(view, settings=msgspec.structs.replace(view.settings, centroid=centroid))


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
    return _with_masks(view, (*view.settings.masks, (x, y, right - x, bottom - y)))


def without_mask(view: View, label: Any) -> View:
    """Remove the mask of that label, see :func:`mask_labels`."""
    labels = mask_labels(view.settings.masks)
    if label not in labels:
        raise UserError("There is no such mask any more.")
    index = labels.index(label)
    return _with_masks(view, view.settings.masks[:index] + view.settings.masks[index + 1 :])


def without_masks(view: View) -> View:
    """Remove all masks."""
    return _with_masks(view, ())


def mask_labels(masks: Sequence[Mask]) -> list[str]:
    """What each mask is called: its number, size and upper left corner, in pixels."""
    return [
        f"{number}: {width:g} × {height:g} px at ({x:g}, {y:g})"
        for number, (x, y, width, height) in enumerate(masks, start=1)
    ]


def with_pose_by_hand(view: View, pose: CirclePose | None) -> View:
    """Use this pose, whichever is the likelier; None leaves the choice to the program.

    It is remembered by its normal: which of the two is called A changes with the numbers.
    """
    if pose is None:
        return replace(view, by_hand=None)
    x, y, z = (float(value) for value in pose.normal)
    return replace(view, by_hand=(x, y, z))


def with_measured(view: View, values: Mapping[str, Any] | None) -> View:
    """Compare with a pose measured by hand: centimetres and degrees by the names in ``MEASURED_LIMITS``, or None."""
    if values is None:
        return replace(view, measured=None)
    numbers = []
    for name, limit in MEASURED_LIMITS.items():
        number = checked_number(f"The measured {name}", values.get(name))
        numbers.append(min(max(number, -limit), limit))
    x, y, z, theta_x, theta_y = numbers
    measured = {"position_m": [x / 100, y / 100, z / 100], "theta_x_deg": theta_x, "theta_y_deg": theta_y}
    return replace(view, measured=measured)


def _with_masks(view: View, masks: tuple[Mask, ...]) -> View:
    return replace(view, settings=msgspec.structs.replace(view.settings, masks=masks))
