"""The one judgement of an estimated pose by the truth; and the rows of the study."""

import math
from collections.abc import Sequence

import numpy as np
from dockpose.estimate import Estimate, estimate
from dockpose.pose.choice import Choice
from dockpose.pose.circle import CirclePose
from dockpose.settings import Settings
from dockpose.simulate.scene import Truth
from dockpose.study.draw import Drawn, Picture, draw, picture_of
from dockpose.thresholds import METHODS as THRESHOLDS

RIGHT_SHARE, RIGHT_DEG = 0.05, 5.0  # of the range, and of the direction of the dock's normal
HOLD_SIGMAS = 1.96  # standard errors of a 95 % interval
OUTCOMES = ("success", "wrong pose", "refused", "false dock", "correct refusal")
SUCCESS, WRONG_POSE, REFUSED, FALSE_DOCK, CORRECT_REFUSAL = OUTCOMES
UNITS = {"x": "m", "y": "m", "z": "m", "theta_x": "deg", "theta_y": "deg"}
# Columns of a judgement in a table, in order.
COLUMNS = (
    *("status", "outcome", "chosen_right", "either_right", "chosen_nearer", "position_right"),
    *("position_error_m", "position_error_share", "angle_error_deg", "probability", "detection", "selected_by"),
    *("lights_found", "lights_on_ring"),
    *(f"error_{name}_{unit}" for name, unit in UNITS.items()),
    *(f"sigma_{name}_{unit}" for name, unit in UNITS.items()),
    *(f"{name}_in_95" for name in UNITS),
    *(f"sigma_total_{name}_{unit}" for name, unit in UNITS.items()),
)
Value = str | int | float | bool | None
Row = dict[str, Value]


def pose_errors(pose: CirclePose, truth: CirclePose | Truth) -> tuple[float, float]:
    """Distance in metres between two positions, and angle in degrees between two normals."""
    angle = math.degrees(_between_rad(pose.normal, truth.normal))
    return float(np.linalg.norm(pose.position_m - truth.position_m)), angle


def is_right(pose: CirclePose | None, truth: CirclePose | Truth) -> bool:
    """Whether a pose is the true one, within ``RIGHT_SHARE`` of the range and ``RIGHT_DEG``."""
    if pose is None:
        return False
    off_m, angle_deg = pose_errors(pose, truth)
    return off_m / float(np.linalg.norm(truth.position_m)) <= RIGHT_SHARE and angle_deg <= RIGHT_DEG


def nearest(candidates: Sequence[CirclePose], normal: np.ndarray) -> CirclePose:
    """The candidate whose normal is nearest to the true one."""
    return max(candidates, key=lambda pose: float(pose.normal @ normal))


def signed_errors(pose: CirclePose, position_m: np.ndarray, normal: np.ndarray) -> tuple[float, ...]:
    """What was found less the truth: x, y, z in metres, theta_x and theta_y in degrees."""
    true = CirclePose(position_m, normal, np.zeros(2))
    x, y, z = (pose.position_m - position_m).tolist()
    turned = math.remainder(pose.theta_y_rad - true.theta_y_rad, 2 * math.pi)
    return x, y, z, math.degrees(pose.theta_x_rad - true.theta_x_rad), math.degrees(turned)


def judge_choice(choice: Choice, position_m: np.ndarray, normal: np.ndarray) -> tuple[tuple[float, ...], bool]:
    """Signed errors (5,) of that of two poses which is nearer to the truth, and whether it was the chosen one."""
    best = nearest(choice.candidates, normal)
    return signed_errors(best, position_m, normal), best is choice.candidates[choice.selected]


def verdicts(found: Estimate, chosen: CirclePose, truth: Truth | CirclePose) -> dict[str, bool]:
    """What the chosen of an estimate's poses is by the truth, see ``NUMBERS``: the one judgement, of tests as well."""
    best = nearest(found.candidates, truth.normal)
    return {
        "chosen_right": is_right(chosen, truth),
        "either_right": any(is_right(pose, truth) for pose in found.candidates),
        "chosen_nearer": bool(chosen.normal @ truth.normal >= best.normal @ truth.normal),
        "position_right": pose_errors(chosen, truth)[0] <= RIGHT_SHARE * float(np.linalg.norm(truth.position_m)),
    }


def judge(found: Estimate, truth: Truth, radius_m: float, *, has_dock: bool) -> Row:
    """Judge what a method found against the truth, as the page of a study says."""
    row: Row = dict.fromkeys(COLUMNS)
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
        sigmas = (*(position_m or ()), *map(math.degrees, theta_rad or ()))
        row |= {f"{prefix}_{name}_{unit}": sigma for (name, unit), sigma in zip(UNITS.items(), sigmas, strict=False)}
    row["outcome"] = FALSE_DOCK
    if not has_dock:
        return row
    off_m, angle_deg = pose_errors(chosen, truth)
    range_m = float(np.linalg.norm(truth.position_m))
    row |= verdicts(found, chosen, truth) | {
        "position_error_m": off_m,
        "position_error_share": off_m / range_m,
        "angle_error_deg": angle_deg,
    }
    signed = signed_errors(chosen, truth.position_m, truth.normal)
    for (name, unit), error in zip(UNITS.items(), signed, strict=True):
        sigma = row[f"sigma_{name}_{unit}"]
        row[f"error_{name}_{unit}"] = error
        row[f"{name}_in_95"] = abs(error) <= HOLD_SIGMAS * sigma if isinstance(sigma, float) else None
    # A dock reported off the true direction by more than the ring's radius is false: a vehicle would steer by it.
    is_beside = _between_rad(chosen.position_m, truth.position_m) > math.atan2(radius_m, range_m)
    row["outcome"] = SUCCESS if row["chosen_right"] else FALSE_DOCK if is_beside else WRONG_POSE
    return row


def _between_rad(one: np.ndarray, other: np.ndarray) -> float:
    """Angle between two directions, exact for small ones too."""
    return math.atan2(float(np.linalg.norm(np.cross(one, other))), float(np.dot(one, other)))


PRODUCT, HATS = "hats_and_local", "hats"
RIVALS = ("otsu", "kapur", "kittler", "sezan")  # those of the paper


def methods() -> list[str]:
    """The program's default first, then all that are registered but a fixed level, which no one sets for each scene."""
    return [PRODUCT, *(name for name in THRESHOLDS if name != "fixed")]


def title_of(label: str) -> str:
    """A method's name for people."""
    title = THRESHOLDS[HATS if label == PRODUCT else label].title.partition(" (")[0]
    return f"{title} + local" if label == PRODUCT else title


def find(label: str, picture: Picture) -> Estimate:
    """Find the dock in a picture by a method, given the camera, the diameter and the number of lights."""
    scene, settings = picture.scene, Settings(method=HATS if label == PRODUCT else label)
    return estimate(picture.image, scene.camera, scene.dock, settings, fall_back=label == PRODUCT)


DIGITS = 6  # of numbers in files; leaves out the last digits, which differ between machines' linear algebra
_OF_WATER = ("absorption_per_m", "scattering_per_m", "attenuation_per_m")
_OF_SENSOR = ("read_noise_levels", "electrons_per_level", "blur_px", "motion_blur_px", "vignetting", "jpeg_quality")


def scene_rows(seed: int, index: int) -> list[Row]:
    """Draw and render scene ``index`` of the study with a seed, and try every method on it."""
    drawn = draw(seed, index)
    picture = picture_of(drawn)
    factors = {"scene": index, "seed": seed, **factors_of(drawn, picture)}
    rows = []
    for label in methods():
        found = find(label, picture)
        judged = judge(found, picture.truth, picture.scene.dock.radius, has_dock=drawn.has_dock)
        rows.append({**factors, "method": label, **judged})
    return rows


def factors_of(drawn: Drawn, picture: Picture) -> Row:
    """All that was drawn for a scene, by name with units."""
    scene, truth = picture.scene, picture.truth
    camera, dock, background, water = scene.camera, scene.dock, scene.background, scene.water
    range_m = float(np.linalg.norm(truth.position_m))
    cosine = float(-truth.normal @ truth.position_m) / range_m
    return {
        "has_dock": drawn.has_dock,
        "width_px": camera.width,
        "height_px": camera.height,
        "focal_px": camera.fx,
        "focal_widths": camera.fx / camera.width,
        "diameter_m": dock.diameter,
        "range_m": range_m,
        "range_diameters": range_m / dock.diameter,
        "attenuation_lengths": water.attenuation_per_m * range_m,
        "ring_radius_px": camera.fx * dock.radius / float(truth.position_m[2]),
        "tilt_deg": math.degrees(math.acos(max(-1.0, min(1.0, cosine)))),
        "turbidity": drawn.turbidity,
        **{name: getattr(water, name) for name in _OF_WATER},
        "ambient_levels": background.level,
        "gradient_levels": math.hypot(background.gradient_x, background.gradient_y),
        "brightest_levels": drawn.brightest,
        "lit_share": picture.lit_share,
        "saturated_share": picture.saturated_share,
        **{name: getattr(scene.sensor, name) for name in _OF_SENSOR},
        "lights": dock.lights,
        "missing": len(scene.lights.missing),
        "lights_in_view": int(truth.visible.sum()),
        "lamp_spacings": scene.lights.radius_m / (2 * math.pi * dock.radius / (dock.lights or 1)),
        "strays": drawn.strays,
        "has_text": bool(scene.texts),
        "has_mirror": scene.mirror is not None,
        "snow_flakes": 0 if scene.snow is None else scene.snow.count,
    }


def as_text(value: Value) -> str:
    """A value in a file: nothing for None, 0 or 1 for truth values, numbers with ``DIGITS`` significant digits."""
    if value is None or (isinstance(value, float) and math.isnan(value)):
        return ""
    if isinstance(value, (bool, np.bool_)):
        return str(int(value))
    return f"{value:.{DIGITS}g}" if isinstance(value, float) else str(value)
