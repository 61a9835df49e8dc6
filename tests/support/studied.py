"""A study's table made by hand: factors spread evenly, outcomes by a rule."""

from collections.abc import Callable

import numpy as np
from dockpose.study.judge import COLUMNS, FALSE_DOCK, SUCCESS, WRONG_POSE, methods
from dockpose.study.summary import FACTORS, Columns

_TEXT = ("status", "outcome", "selected_by")


def table(scenes: int, outcome: Callable[[int, str], str], docks: int | None = None) -> Columns:
    """Rows of ``scenes`` scenes, of which the first ``docks`` have a dock; ``outcome`` by scene and method."""
    docks = scenes if docks is None else docks
    keys = [(scene, label) for scene in range(scenes) for label in methods()]
    scene = np.array([key[0] for key in keys], dtype=float)
    columns: Columns = {"scene": scene, "seed": np.full(len(keys), 3.0), "has_dock": (scene < docks).astype(float)}
    for factor in FACTORS.values():
        columns[factor.name] = factor.edges[0] + (factor.edges[-1] - factor.edges[0]) * scene / scenes
    columns["width_px"] = np.where(scene % 2, 320.0, 640.0)
    columns["method"] = np.array([key[1] for key in keys], dtype=object)
    for name in COLUMNS:
        columns[name] = np.full(len(keys), "", dtype=object) if name in _TEXT else np.full(len(keys), np.nan)
    columns["outcome"] = np.array([outcome(*key) for key in keys], dtype=object)
    hit = columns["outcome"] == SUCCESS
    reported = np.isin(columns["outcome"], [SUCCESS, WRONG_POSE, FALSE_DOCK])
    seen = reported & (columns["has_dock"] == 1)
    for name in ("chosen_right", "either_right", "chosen_nearer", "position_right"):
        columns[name] = np.where(seen, hit.astype(float), np.nan)
    for name in COLUMNS:
        if name.endswith("_in_95"):
            columns[name] = np.where(seen, hit.astype(float), np.nan)
    columns["probability"] = np.where(reported, 0.97, np.nan)
    columns["detection"] = np.where(reported, 0.97, np.nan)
    columns["position_error_share"] = np.where(seen, np.where(hit, 0.01, 0.2), np.nan)
    columns["error_z_m"] = np.where(seen, np.where(hit, 0.01, -0.2), np.nan)
    columns["sigma_z_m"] = np.where(seen, 0.01, np.nan)
    columns["angle_error_deg"] = np.where(seen, np.where(hit, 1.0, 30.0), np.nan)
    return columns
