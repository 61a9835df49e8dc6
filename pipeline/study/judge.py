"""What came of a method on a scene, by physics: right poses, wrong ones, refusals and false docks."""

import math
from collections.abc import Sequence

import numpy as np
from dockpose.estimate import Estimate
from dockpose.pose.circle import CirclePose
from dockpose.simulate.truth import Truth

RIGHT_SHARE, RIGHT_DEG = 0.05, 5.0  # of the range, and of the direction of the dock's normal
HOLD_SIGMAS = 1.96  # standard errors of a 95 % interval
OUTCOMES = ("success", "wrong pose", "refused", "false dock", "correct refusal")
SUCCESS, WRONG_POSE, REFUSED, FALSE_DOCK, CORRECT_REFUSAL = OUTCOMES
_UNITS = {"x": "m", "y": "m", "z": "m", "theta_x": "deg", "theta_y": "deg"}
# Columns of a judgement in a table, in order.
COLUMNS = (
    *("status", "outcome", "chosen_right", "either_right", "chosen_nearer", "position_right"),
    *("position_error_m", "position_error_share", "angle_error_deg", "probability", "detection", "selected_by"),
    *("lights_found", "lights_on_ring"),
    *(f"error_{name}_{unit}" for name, unit in _UNITS.items()),
    *(f"sigma_{name}_{unit}" for name, unit in _UNITS.items()),
    *(f"{name}_in_95" for name in _UNITS),
    *(f"sigma_total_{name}_{unit}" for name, unit in _UNITS.items()),
)
Value = str | int | float | bool | None


def pose_errors(pose: CirclePose, truth: CirclePose | Truth) -> tuple[float, float]:
    """Distance in metres between two positions, and angle in degrees between two normals."""
    angle = math.degrees(_between_rad(pose.normal, truth.normal))
    return float(np.linalg.norm(pose.position_m - truth.position_m)), angle


def nearest(candidates: Sequence[CirclePose], normal: np.ndarray) -> CirclePose:
    """The candidate whose normal is nearest to the true one."""
    return max(candidates, key=lambda pose: float(pose.normal @ normal))


def signed_errors(pose: CirclePose, position_m: np.ndarray, normal: np.ndarray) -> tuple[float, ...]:
    """What was found less the truth: x, y, z in metres, theta_x and theta_y in degrees."""
    true = CirclePose(position_m, normal, np.zeros(2))
    x, y, z = (pose.position_m - position_m).tolist()
    turned = math.remainder(pose.theta_y_rad - true.theta_y_rad, 2 * math.pi)
    return x, y, z, math.degrees(pose.theta_x_rad - true.theta_x_rad), math.degrees(turned)


def judge(found: Estimate, truth: Truth, radius_m: float, *, has_dock: bool) -> dict[str, Value]:
    """Judge what a method found against the truth, as the page of a study says.

    A dock that is reported off the true direction by more than the ring's radius is false: a vehicle would steer by it.
    """
    row: dict[str, Value] = dict.fromkeys(COLUMNS)
    row["status"] = found.status
    row["lights_found"] = None if found.markers is None else len(found.markers)
    row["lights_on_ring"] = found.lights_on_ring
    chosen = found.selected
    if found.status != "ok" or chosen is None:
        row["outcome"] = REFUSED if has_dock else CORRECT_REFUSAL
        return row
    row |= {"probability": chosen.probability, "detection": found.detection}
    row["selected_by"] = None if found.choice is None else found.choice.selected_by
    for prefix, position_m, theta_rad in (
        ("sigma", chosen.sigma_position_m, chosen.sigma_theta_rad),
        ("sigma_total", chosen.sigma_total_position_m, chosen.sigma_total_theta_rad),
    ):
        thetas_deg = [None if sigma is None else math.degrees(sigma) for sigma in theta_rad or [None] * 2]
        sigmas = (*(position_m or [None] * 3), *thetas_deg)
        row |= {f"{prefix}_{name}_{unit}": sigma for (name, unit), sigma in zip(_UNITS.items(), sigmas, strict=True)}
    if not has_dock:
        row["outcome"] = FALSE_DOCK
        return row
    range_m = float(np.linalg.norm(truth.position_m))
    errors = [pose_errors(pose, truth) for pose in found.candidates]
    off_m, angle_deg = pose_errors(chosen, truth)
    is_near, is_right = off_m / range_m <= RIGHT_SHARE, _is_right(off_m, angle_deg, range_m)
    row |= {
        "chosen_right": is_right,
        "either_right": any(_is_right(*each, range_m) for each in errors),
        "chosen_nearer": angle_deg <= min(angle for _, angle in errors),
        "position_right": is_near,
        "position_error_m": off_m,
        "position_error_share": off_m / range_m,
        "angle_error_deg": angle_deg,
    }
    signed = signed_errors(chosen, truth.position_m, truth.normal)
    for (name, unit), error in zip(_UNITS.items(), signed, strict=True):
        sigma = row[f"sigma_{name}_{unit}"]
        row[f"error_{name}_{unit}"] = error
        row[f"{name}_in_95"] = abs(error) <= HOLD_SIGMAS * sigma if isinstance(sigma, float) else None
    is_beside = _between_rad(chosen.position_m, truth.position_m) > math.atan2(radius_m, range_m)
    row["outcome"] = SUCCESS if is_right else FALSE_DOCK if is_beside else WRONG_POSE
    return row


def _is_right(off_m: float, angle_deg: float, range_m: float) -> bool:
    return off_m / range_m <= RIGHT_SHARE and angle_deg <= RIGHT_DEG


def _between_rad(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two directions, exact for small ones too."""
    return math.atan2(float(np.linalg.norm(np.cross(one, other))), float(np.dot(one, other)))
