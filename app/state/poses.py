"""Poses that the operator gives: which candidate to use, and one that was measured by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from dockpose.app.state.parameters import checked_number
from dockpose.app.state.view import View
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose

# Name and unit of a measured pose's numbers, and how far to either side they may be.
MEASURED_LIMITS = {
    "x (cm)": 5000.0,
    "y (cm)": 5000.0,
    "z (cm)": 5000.0,
    "θx (°)": 90.0,
    "θy (°)": 90.0,
}


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
    return replace(view, measured=KnownPose((x / 100, y / 100, z / 100), theta_x, theta_y))
