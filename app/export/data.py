"""Results of a picture as JSON and rows of a table, and its settings as YAML."""

import csv
import io
import json
from collections.abc import Iterable
from typing import Any

import cv2
import msgspec
import numpy as np
import yaml
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import with_versions

_CANDIDATE_COLUMNS = ("x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg", "probability", "rms_px")
_TRACK_KEYS = ("probability", "age", "predicted", "lost")
# One pose of the frame, as other programs take it: the chosen candidate; as the frames before predict it, filtered over
# the frames up to this one, and smoothed over all frames of the recording.
_POSES = ("chosen", "predicted", "filtered", "smoothed")
_POSE_COLUMNS = (
    *("x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg"),
    *("sigma_x_m", "sigma_y_m", "sigma_z_m", "sigma_theta_x_deg", "sigma_theta_y_deg"),
)
_TOTAL_COLUMNS = tuple(f"sigma_total_{name}" for name in ("x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg"))
_VEHICLE = ("vehicle_x_m", "vehicle_y_m", "vehicle_z_m")
_TURNED = tuple(f"vehicle_q{axis}" for axis in "xyzw")
_VEHICLE_SIGMAS = tuple(f"vehicle_sigma_total_{axis}_m" for axis in "xyz")
_GUIDANCE = (
    *("along_m", "across_m", "above_m", "yaw_off_deg", "pitch_off_deg", "off_axis_deg", "inside_cone", "target"),
    *("target_x_m", "target_y_m", "target_z_m"),
)
CSV_COLUMNS = (
    *("source", "frame", "time_s", "time_unix_s", "status", "method", "level", "groups", "lights_on_ring"),
    *("selected", "selected_by"),
    *(f"{name.lower()}_{column}" for name in POSE_NAMES for column in _CANDIDATE_COLUMNS),
    *(f"track_{key}" for key in _TRACK_KEYS),
    *("elapsed_ms", "message"),
    *(f"{name}_{column}" for name in _POSES for column in _POSE_COLUMNS),
    "smoothed_probability",
    *(f"{name}_{column}" for name in _POSES for column in _TOTAL_COLUMNS),
    "ring",
    *("vehicle_frame", *_VEHICLE, *_TURNED, *_VEHICLE_SIGMAS),
    *(f"guidance_{column}" for column in _GUIDANCE),
)


def result_line(analysis: Analysis, sha256: str | None = None) -> dict[str, Any]:
    """Return the JSON object of schema 1, with version numbers; ``sha256`` is the checksum of the picture's file."""
    return with_versions(analysis.estimate.to_dict(analysis.view.source, frame=0, sha256=sha256))


def to_json(line: dict[str, Any]) -> bytes:
    """Return a JSON object as an indented file."""
    return (json.dumps(line, allow_nan=False, indent=2) + "\n").encode()


def to_csv(lines: Iterable[dict[str, Any]]) -> bytes:
    """Return a table with one row per JSON object and the columns of ``dockpose estimate --csv``."""
    text = io.StringIO(newline="")
    table = csv.DictWriter(text, CSV_COLUMNS)
    table.writeheader()
    table.writerows(to_row(line) for line in lines)
    return text.getvalue().encode()


def to_row(line: dict[str, Any]) -> dict[str, Any]:
    """Return the row of one JSON object; what is not known is left out."""
    threshold, track = line["threshold"] or {}, line.get("track") or {}
    row: dict[str, Any] = {
        **{key: line[key] for key in ("source", "frame", "time_s", "status", "selected_by", "elapsed_ms", "message")},
        "time_unix_s": line.get("time_unix_s"),  # lines of older versions have none
        **{key: threshold.get(key) for key in ("method", "level", "groups")},
        "lights_on_ring": sum(marker["on_ring"] is True for marker in line["markers"]),
        "selected": None if line["selected"] is None else POSE_NAMES[line["selected"]],
        **{f"track_{key}": track.get(key) for key in _TRACK_KEYS},
        "ring": "+".join(line.get("ring") or ()),
        "smoothed_probability": (line.get("smoothed") or {}).get("probability"),
    }
    for name, candidate in zip(POSE_NAMES, line["candidates"], strict=False):
        values = (*candidate["position_m"], *(candidate[key] for key in _CANDIDATE_COLUMNS[3:]))
        row |= {f"{name.lower()}_{key}": value for key, value in zip(_CANDIDATE_COLUMNS, values, strict=True)}
    for name in _POSES:
        row |= _pose_cells(name, line.get(name))
    return row | _vehicle_cells(line.get("vehicle")) | _guidance_cells(line.get("guidance"))


def _vehicle_cells(pose: dict[str, Any] | None) -> dict[str, Any]:
    if pose is None:
        return {}
    values = (*pose["position_m"], *pose["quaternion_xyzw"], *(pose["sigma_total_position_m"] or (None,) * 3))
    cells = zip((*_VEHICLE, *_TURNED, *_VEHICLE_SIGMAS), values, strict=True)
    return {"vehicle_frame": pose["frame"], **dict(cells)}


def _guidance_cells(guidance: dict[str, Any] | None) -> dict[str, Any]:
    if guidance is None:
        return {}
    values = (*(guidance[key] for key in _GUIDANCE[:-3]), *guidance["target_m"])
    return {f"guidance_{key}": value for key, value in zip(_GUIDANCE, values, strict=True)}


def _pose_cells(name: str, pose: dict[str, Any] | None) -> dict[str, Any]:
    if pose is None:
        return {}
    sigmas, totals = (
        (*(pose.get(f"{sigma}_position_m") or (None,) * 3), *(pose.get(f"{sigma}_theta_deg") or (None,) * 2))
        for sigma in ("sigma", "sigma_total")
    )
    values = (*pose["position_m"], pose["theta_x_deg"], pose["theta_y_deg"], *sigmas, *totals)
    return {f"{name}_{key}": value for key, value in zip((*_POSE_COLUMNS, *_TOTAL_COLUMNS), values, strict=True)}


def settings_yaml(analysis: Analysis) -> str:
    """Return the settings, dock and camera that were used and, where there is one, the measured pose as YAML."""
    view, found = analysis.view, analysis.estimate
    content: dict[str, Any] = {
        "source": view.source,
        "settings": _plain(found.settings),
        "dock": _plain(found.dock),
        "camera": _plain(found.camera),
    }
    if view.measured is not None:
        content["measured"] = _plain(view.measured)
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)


def to_png(picture: np.ndarray) -> bytes:
    """Encode a picture as PNG, losslessly."""
    return cv2.imencode(".png", picture)[1].tobytes()


def _plain(value: Any) -> Any:
    """Convert to the plain lists, dictionaries and numbers that YAML can hold."""
    return msgspec.json.decode(msgspec.json.encode(value))
