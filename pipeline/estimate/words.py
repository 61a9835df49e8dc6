"""An estimate in a few lines of text, and as a table."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from dockpose.checks import InputError
from dockpose.pose.circle import CirclePose

if TYPE_CHECKING:
    from dockpose.estimate.result import Estimate

POSE_NAMES = ("A", "B")


def in_words(found: Estimate) -> str:
    """Return the message, and below it a line for each candidate with its units; the chosen one is named."""
    lines = [found.message]
    for name, pose in zip(POSE_NAMES, found.candidates, strict=False):
        chosen = ", chosen" if pose is found.selected else ""
        chance = "" if pose.probability is None else f" ({100 * pose.probability:.0f} %{chosen})"
        lines.append(f"{name}{chance or (chosen and ' (chosen)')}: {_place(pose)}")
    return "\n".join(lines)


def in_short(found: Estimate) -> str:
    """Return the status and the chosen pose in one line."""
    pose = found.selected
    level = "" if found.threshold is None else f" level {found.threshold.level}"
    where = "" if pose is None else f", {found.lights_on_ring} lights, {_place(pose)}"
    return f"<Estimate {found.status}: {found.width} x {found.height}, {_method(found)}{level}{where}>"


def _method(found: Estimate) -> str:
    """The method that the threshold is of: hats may have given each light a level of its own."""
    return found.settings.method if found.threshold is None else found.threshold.method


def _place(pose: CirclePose) -> str:
    """Position and attitude, with their standard errors where these are known."""
    x, y, z = (100 * float(value) for value in pose.position_m)
    theta_x, theta_y = math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad)
    sigma_z = "" if pose.sigma_position_m is None else f" ± {100 * pose.sigma_position_m[2]:.2g}"
    return f"x {x:.1f} y {y:.1f} z {z:.1f}{sigma_z} cm, theta x {theta_x:.1f} y {theta_y:.1f} deg"


def frame_of(found: Estimate) -> Any:
    """Return the table of :meth:`Estimate.to_frame`."""
    try:
        import pandas  # pyright: ignore[reportMissingImports]  # needed for tables alone
    except ImportError as error:
        raise InputError("to_frame() needs pandas: pip install pandas") from error
    names = POSE_NAMES[: len(found.candidates)] or ("",)
    poses = found.candidates or (None,)
    return pandas.DataFrame([_row(found, name, pose) for name, pose in zip(names, poses, strict=True)])


def _row(found: Estimate, name: str, pose: CirclePose | None) -> dict[str, Any]:
    line = {} if pose is None else pose.to_dict()
    place, sigma = line.get("position_m") or [None] * 3, line.get("sigma_position_m") or [None] * 3
    sigma_theta = line.get("sigma_theta_deg") or [None] * 2
    values = {f"{axis}_m": value for axis, value in zip("xyz", place, strict=True)}
    values |= {key: line.get(key) for key in ("theta_x_deg", "theta_y_deg", "roll_deg", "probability", "rms_px")}
    values |= {f"sigma_{axis}_m": value for axis, value in zip("xyz", sigma, strict=True)}
    values |= {f"sigma_theta_{axis}_deg": value for axis, value in zip("xy", sigma_theta, strict=True)}
    return {
        "status": found.status,
        "pose": name,
        "selected": pose is not None and pose is found.selected,
        **{key: math.nan if value is None else value for key, value in values.items()},
        "detection": math.nan if found.detection is None else found.detection,
        "method": _method(found),
        "level": math.nan if found.threshold is None else float(found.threshold.level),
        "lights_on_ring": 0 if found.lights_on_ring is None else found.lights_on_ring,
        "elapsed_ms": found.elapsed_ms,
        "message": found.message,
    }
