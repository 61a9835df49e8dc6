"""What came of a method on a scene, by physics: right poses, wrong ones, refusals and false docks."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from dockpose.estimate import Estimate
from dockpose.pose.circle import CirclePose
from dockpose.simulate.truth import Truth

RIGHT_SHARE, RIGHT_DEG = 0.05, 5.0  # of the range, and of the direction of the dock's normal
HOLD_SIGMAS = 1.96  # standard errors of a 95 % interval
SUCCESS, WRONG_POSE, REFUSED, FALSE_DOCK, CORRECT_REFUSAL = OUTCOMES = (
    "success",
    "wrong pose",
    "refused",
    "false dock",
    "correct refusal",
)
_AXES = ("x", "y", "z")
_ANGLES = ("theta_x", "theta_y")
_UNITS = {**dict.fromkeys(_AXES, "m"), **dict.fromkeys(_ANGLES, "deg")}
# Columns of a judgement in a table, in order; those of intervals and sigmas follow.
COLUMNS = (
    "status",
    "outcome",
    "chosen_right",
    "either_right",
    "chosen_nearer",
    "position_right",
    "position_error_m",
    "position_error_share",
    "angle_error_deg",
    "probability",
    "detection",
    "selected_by",
    "lights_found",
    "lights_on_ring",
    *(f"error_{axis}_m" for axis in _AXES),
    *(f"error_{angle}_deg" for angle in _ANGLES),
    *(f"sigma_{axis}_m" for axis in _AXES),
    *(f"sigma_{angle}_deg" for angle in _ANGLES),
    *(f"{name}_in_95" for name in (*_AXES, *_ANGLES)),
)
Value = str | int | float | bool | None


@dataclass(frozen=True)
class _Errors:
    """How far a candidate is from the truth."""

    position_m: float
    share: float
    angle_deg: float

    @property
    def is_right(self) -> bool:
        return self.share <= RIGHT_SHARE and self.angle_deg <= RIGHT_DEG


def judge(found: Estimate, truth: Truth, radius_m: float, *, has_dock: bool) -> dict[str, Value]:
    """Judge what a method found against the truth.

    A pose is right if its position is within 5 % of the range and its normal within 5 degrees. "success": the chosen
    pose is. "false dock": a dock is reported where there is none, or in a direction that is off the true one by more
    than the ring's radius as seen from the camera, so that a vehicle would steer beside it. "wrong pose": any other
    pose reported of a dock in view. "refused": no pose of a dock in view; "correct refusal": no pose where none is.
    """
    row: dict[str, Value] = dict.fromkeys(COLUMNS)
    row["status"] = found.status
    row["lights_found"] = None if found.markers is None else len(found.markers)
    row["lights_on_ring"] = found.lights_on_ring
    chosen = found.selected
    is_ok = found.status == "ok" and chosen is not None
    if not is_ok or chosen is None:
        row["outcome"] = REFUSED if has_dock else CORRECT_REFUSAL
        return row
    row |= {"probability": chosen.probability, "detection": found.detection}
    row["selected_by"] = None if found.choice is None else found.choice.selected_by
    row |= _sigmas(chosen)
    if not has_dock:
        row["outcome"] = FALSE_DOCK
        return row
    errors = [_errors(pose, truth) for pose in found.candidates]
    own = _errors(chosen, truth)
    row |= {
        "chosen_right": own.is_right,
        "either_right": any(each.is_right for each in errors),
        "chosen_nearer": own.angle_deg <= min(each.angle_deg for each in errors),
        "position_right": own.share <= RIGHT_SHARE,
        "position_error_m": own.position_m,
        "position_error_share": own.share,
        "angle_error_deg": own.angle_deg,
    }
    row |= _signed(chosen, truth)
    row |= {f"{name}_in_95": _is_within(row, name, unit) for name, unit in _UNITS.items()}
    range_m = float(np.linalg.norm(truth.position_m))
    is_beside = _between_rad(chosen.position_m, truth.position_m) > math.atan2(radius_m, range_m)
    row["outcome"] = SUCCESS if own.is_right else FALSE_DOCK if is_beside else WRONG_POSE
    return row


def _errors(pose: CirclePose, truth: Truth) -> _Errors:
    off_m = float(np.linalg.norm(pose.position_m - truth.position_m))
    angle = math.degrees(_between_rad(pose.normal, truth.normal))
    return _Errors(off_m, off_m / float(np.linalg.norm(truth.position_m)), angle)


def _between_rad(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two directions, exact for small ones too."""
    return math.atan2(float(np.linalg.norm(np.cross(one, other))), float(np.dot(one, other)))


def _sigmas(pose: CirclePose) -> dict[str, Value]:
    sigmas: dict[str, Value] = {}
    if pose.sigma_position_m is not None:
        sigmas |= {f"sigma_{axis}_m": value for axis, value in zip(_AXES, pose.sigma_position_m, strict=True)}
    if pose.sigma_theta_rad is not None:
        degrees = [math.degrees(value) for value in pose.sigma_theta_rad]
        sigmas |= {f"sigma_{angle}_deg": value for angle, value in zip(_ANGLES, degrees, strict=True)}
    return sigmas


def _signed(pose: CirclePose, truth: Truth) -> dict[str, Value]:
    """What was found less the truth, number by number."""
    true = CirclePose(truth.position_m, truth.normal, truth.centre_px)
    off_m = (pose.position_m - truth.position_m).tolist()
    off_x_deg = math.degrees(pose.theta_x_rad - true.theta_x_rad)
    off_y_deg = math.degrees(math.remainder(pose.theta_y_rad - true.theta_y_rad, 2 * math.pi))
    errors = zip((*_AXES, *_ANGLES), (*off_m, off_x_deg, off_y_deg), strict=True)
    return {f"error_{name}_{_UNITS[name]}": off for name, off in errors}


def _is_within(row: dict[str, Value], name: str, unit: str) -> bool | None:
    """Whether the truth is within the 95 % interval of a number; None where that has none."""
    error, sigma = row[f"error_{name}_{unit}"], row[f"sigma_{name}_{unit}"]
    if not isinstance(error, float) or not isinstance(sigma, float):
        return None
    return abs(error) <= HOLD_SIGMAS * sigma
