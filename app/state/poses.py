"""Poses that the operator gives: which candidate to use, and one that was measured by hand."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from dockpose.app.errors import UserError
from dockpose.app.state.measured import MeasuredPose
from dockpose.app.state.parameters import checked_number
from dockpose.app.state.view import View
from dockpose.pose.circle import CirclePose

# Name and unit of a measured pose's numbers, and how far to either side they may be.
MEASURED_LIMITS = {
    "x (cm)": 5000.0,
    "y (cm)": 5000.0,
    "z (cm)": 5000.0,
    "θx (°)": 90.0,
    "θy (°)": 90.0,
}


def with_pose_by_hand(view: View, pose: CirclePose | None) -> View:
    """Use this pose, whichever is the likelier; None leaves the choice to the program."""
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
        value = values.get(name)
        number = None if value is None else checked_number(f"The measured {name}", value)
        if number is not None and abs(number) > limit:
            raise UserError(f"The measured {name} is {number:g}; it must be from {-limit:g} to {limit:g}.")
        numbers.append(number)
    return replace(view, measured=MeasuredPose(*numbers))
