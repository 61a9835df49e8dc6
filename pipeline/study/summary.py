"""What the study says: success, false docks and errors by method and factor, HATS against its rivals, calibration."""

import csv
import io
import math
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
from dockpose.study import judge
from dockpose.study.judge import HATS, PRODUCT, RIVALS, methods, title_of
from dockpose.study.statistics import Difference, Share, median, paired_difference, quantile, share_of

_TEXT = frozenset({"method", "status", "outcome", "selected_by"})
Columns = dict[str, np.ndarray]


@dataclass(frozen=True)
class Factor:
    """Something that makes it harder to find the dock, in bins."""

    name: str  # of its column
    title: str  # for people, with its unit
    edges: tuple[float, ...]  # of the bins
    is_whole: bool = False  # whether it is counted, so that a bin is named by the first and last number in it
    is_listed: bool = False  # whether it has a few values only, the lower edges, so that each bin is named by its own

    @property
    def labels(self) -> list[str]:
        """Names of the bins."""
        lows, highs = self.edges[:-1], self.edges[1:]
        if self.is_listed:
            return [f"{low:g}" for low in lows]
        if self.is_whole:
            highs = (*(high - 1 for high in highs[:-1]), highs[-1])
        return [f"{low:g}" if low == high else f"{low:g} to {high:g}" for low, high in zip(lows, highs, strict=True)]

    def bins_of(self, values: np.ndarray) -> np.ndarray:
        """Number of the bin of each value, -1 for none."""
        found = np.searchsorted(self.edges, values, side="right") - 1
        found = np.where(values == self.edges[-1], len(self.edges) - 2, found)
        return np.where((found < 0) | (found > len(self.edges) - 2) | ~np.isfinite(values), -1, found)


FACTORS = {
    factor.name: factor
    for factor in (
        Factor("turbidity", "turbidity (0 clear, 1 harbour)", (0, 0.2, 0.4, 0.6, 0.8, 1)),
        Factor("attenuation_lengths", "range in attenuation lengths", (0, 0.5, 1, 2, 3, 5, 8.5)),
        Factor("range_m", "range in m", (0, 1, 2, 4, 7, 10, 22)),
        Factor("range_diameters", "range in dock diameters", (0, 2, 4, 8, 12, 20, 60)),
        Factor("ring_radius_px", "ring's radius in pixels", (10, 20, 40, 80, 160, 500)),
        Factor("tilt_deg", "tilt in degrees", (0, 10, 20, 30, 40, 50, 60)),
        Factor("ambient_levels", "ambient light in grey levels", (0, 20, 40, 60, 80, 100, 120)),
        Factor("lit_share", "lit share of the picture", (0, 0.001, 0.003, 0.01, 0.03, 0.1, 1)),
        Factor("read_noise_levels", "read noise in grey levels", (0.5, 1, 1.5, 2, 3, 4, 6)),
        Factor("lights", "number of lights", (4, 5, 6, 8, 11, 15, 20, 24), is_whole=True),
        Factor("missing", "missing lights", (0, 1, 2, 3, 5, 8), is_whole=True),
        Factor("strays", "stray lights", (0, 1, 4, 7, 11, 20, 34), is_whole=True),
        Factor("lamp_spacings", "lamp's radius in spacings of the lights", (0.02, 0.05, 0.1, 0.2, 0.3, 0.4)),
        Factor("focal_widths", "focal length in picture widths", (0.5, 0.75, 1, 1.5, 2, 3)),
        Factor("width_px", "picture's width in pixels", (320, 640, 800, 1280, 1920, 1921), is_listed=True),
    )
}


def columns_of(text: str) -> Columns:
    """Columns of a CSV file: words as text, all else as floats, NaN where a cell is empty."""
    reader = csv.reader(io.StringIO(text))
    head = next(reader)
    cells = list(zip(*reader, strict=True)) or [() for _ in head]
    return {
        name: np.array(values, dtype=object)
        if name in _TEXT
        else np.array([float(value) if value else np.nan for value in values])
        for name, values in zip(head, cells, strict=True)
    }


def of_method(columns: Columns, label: str) -> Columns:
    """The rows of a method, one for each scene."""
    return where(columns, columns["method"] == label)


def where(columns: Columns, rows: np.ndarray) -> Columns:
    """Some of the rows."""
    return {name: values[rows] for name, values in columns.items()}


INTERVALS = tuple(judge.UNITS)
PROBABILITY_EDGES = (0.5, 0.6, 0.7, 0.8, 0.9, 0.95, 0.99, 0.999, 1.0)
DETECTION_EDGES = (0.0, 0.5, 0.8, 0.95, 0.99, 0.999, 1.0)
Summary = dict[str, Any]


def summary_of(columns: Columns) -> Summary:
    """Summarise the study's table."""
    by_method = {label: of_method(columns, label) for label in methods()}
    product = by_method[PRODUCT]
    docks = product["has_dock"] == 1
    seen = np.isin(product["outcome"], [judge.SUCCESS, judge.WRONG_POSE])  # at a right pose or a wrong one
    parts = {"all": seen, "nearer": seen & (product["chosen_nearer"] == 1)}
    made = {
        "seed": int(product["seed"][0]),
        "scenes": len(docks),
        "docks": int(docks.sum()),
        "methods": {
            label: {"title": title_of(label), **_result(one), **_more(one)} for label, one in by_method.items()
        },
        "against": {
            first: {rival: _difference(by_method[first], by_method[rival]) for rival in RIVALS}
            for first in (HATS, PRODUCT)
        },
        "factors": {name: _by_factor(factor, by_method) for name, factor in FACTORS.items()},
        # How often the chosen one of two poses is the nearer to the truth, and what is reported the dock, as was given.
        "calibration": {
            "probability": _reliability(product["probability"], parts["nearer"], seen, PROBABILITY_EDGES),
            "detection": _reliability(
                product["detection"], product["outcome"] != judge.FALSE_DOCK, np.ones_like(seen), DETECTION_EDGES
            ),
        },
        # How often the truth is within the 95 % interval: of all poses of the dock, and where the nearer was chosen.
        "coverage": {
            name: {key: _held(product[f"{key}_in_95"][rows]) for key in INTERVALS} for name, rows in parts.items()
        },
        # The factor on the standard errors with which 95 % intervals would hold 95 %.
        "widen": {
            name: quantile(np.abs(product[f"error_{key}"] / product[f"sigma_{key}"])[seen], 0.95) / judge.HOLD_SIGMAS
            for name, key in ((name, f"{name}_{unit}") for name, unit in judge.UNITS.items())
        },
    }
    return msgspec.json.decode(msgspec.json.encode(made))  # as JSON has it: in dicts, null where a number is none


def _result(one: Columns) -> dict[str, Any]:
    """What a method reached on some scenes."""
    docks, outcome = one["has_dock"] == 1, one["outcome"]
    hits = docks & (outcome == judge.SUCCESS)
    seen = hits | docks & (outcome == judge.WRONG_POSE)
    share, angle = one["position_error_share"][seen], one["angle_error_deg"][seen]
    return {
        "success": share_of(hits, docks),
        "false_dock": share_of(outcome == judge.FALSE_DOCK),
        "right_of_reported": share_of(hits, docks & (outcome != judge.REFUSED)),
        "nearer": share_of(one["chosen_nearer"] == 1, seen),
        "z_in_95": _held(one["z_in_95"][seen]),
        "too_far": _held(np.where(np.isfinite(one["error_z_m"]), one["error_z_m"] > 0, np.nan)[seen]),
        "position_error_share": median(share),
        "angle_error_deg": median(angle),
        "position_error_share_90": quantile(share, 0.9),
        "angle_error_deg_90": quantile(angle, 0.9),
    }


def _more(one: Columns) -> dict[str, Any]:
    """The rest of what a method reached, given over all scenes only."""
    docks, outcome = one["has_dock"] == 1, one["outcome"]
    return {
        "either_right": share_of(one["either_right"] == 1, docks),
        "position_right": share_of(one["position_right"] == 1, docks),
        "wrong_pose": share_of(outcome == judge.WRONG_POSE, docks),
        "refused": share_of(outcome == judge.REFUSED, docks),
        "false_dock_without": share_of(outcome == judge.FALSE_DOCK, ~docks),
        "false_dock_beside": share_of(outcome == judge.FALSE_DOCK, docks),
    }


def _difference(first: Columns, second: Columns) -> Difference:
    """First less second in success, on the scenes with a dock."""
    docks = first["has_dock"] == 1
    return paired_difference(*((one["outcome"] == judge.SUCCESS)[docks] for one in (first, second)))


def _by_factor(factor: Factor, by_method: dict[str, Columns]) -> dict[str, Any]:
    bins = factor.bins_of(by_method[PRODUCT][factor.name])
    rows = [bins == number for number in range(len(factor.labels))]
    parts = {label: [where(one, each) for each in rows] for label, one in by_method.items()}
    return {
        "title": factor.title,
        "bins": factor.labels,
        "scenes": [int(each.sum()) for each in rows],
        "methods": {label: [_result(part) for part in each] for label, each in parts.items()},
        "against": {
            rival: [_difference(*pair) for pair in zip(parts[HATS], parts[rival], strict=True)] for rival in RIVALS
        },
    }


def _reliability(
    given: np.ndarray, came: np.ndarray, among: np.ndarray, edges: tuple[float, ...]
) -> list[dict[str, Any]]:
    """By the probability that was given, its mean and how often what it was given for came true."""
    factor, rows = Factor("", "", edges), []
    bins = np.where(among, factor.bins_of(given), -1)
    for number, label in enumerate(factor.labels):
        here = bins == number
        told = float(given[here].mean()) if here.any() else math.nan
        rows.append({"bin": label, "told": told, "came": share_of(came, here)})
    return rows


def _held(held: np.ndarray) -> Share:
    return share_of(held == 1, np.isfinite(held))
