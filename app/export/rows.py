"""Rows of a table from JSON objects of schema 1."""

from __future__ import annotations

from typing import Any

from dockpose.app.drawing.colours import POSE_NAMES

_CANDIDATE_COLUMNS = ("x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg", "probability", "rms_px")
_TRACK_KEYS = ("probability", "age", "predicted", "lost")
CSV_COLUMNS = (
    *("source", "frame", "time_s", "time_unix_s", "status", "method", "level", "groups", "lights_on_ring"),
    *("selected", "selected_by"),
    *(f"{name.lower()}_{column}" for name in POSE_NAMES for column in _CANDIDATE_COLUMNS),
    *(f"track_{key}" for key in _TRACK_KEYS),
    *("elapsed_ms", "message"),
)


def to_row(line: dict[str, Any]) -> dict[str, Any]:
    """Return the row of one JSON object."""
    threshold, track = line["threshold"] or {}, line.get("track") or {}
    row: dict[str, Any] = {
        **{key: line[key] for key in ("source", "frame", "time_s", "status", "selected_by", "elapsed_ms", "message")},
        "time_unix_s": line.get("time_unix_s"),  # lines of older versions have none
        **{key: threshold.get(key) for key in ("method", "level", "groups")},
        "lights_on_ring": sum(marker["on_ring"] is True for marker in line["markers"]),
        "selected": None if line["selected"] is None else POSE_NAMES[line["selected"]],
        **{f"track_{key}": track.get(key) for key in _TRACK_KEYS},
    }
    for name, candidate in zip(POSE_NAMES, line["candidates"], strict=False):
        values = (*candidate["position_m"], *(candidate[key] for key in _CANDIDATE_COLUMNS[3:]))
        row |= {f"{name.lower()}_{key}": value for key, value in zip(_CANDIDATE_COLUMNS, values, strict=True)}
    return row
