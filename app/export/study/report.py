"""The study's page, its plots and its summary, from ``study.csv`` and ``cost.csv``."""

import dataclasses
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from dockpose.app.errors import writing
from dockpose.app.export.parts import Cell, NumberTable, Part, Plot, Rows, page, words
from dockpose.app.export.study import plots
from dockpose.app.export.study.words import advice_text, calibration_text, claim_text, factor_text
from dockpose.app.processing.study import COST_CSV, STUDY_CSV
from dockpose.app.resources import versions
from dockpose.files.durable_files import write_whole
from dockpose.study.scenes import ELAPSED, HATS, METHODS, PRODUCT, RIVALS
from dockpose.study.summary import Columns, columns_of, of_method, summary_of
from markupsafe import Markup

PLOTS = "plots"  # folder of the plots and tables
_RANGES = ("range_diameters", "ring_radius_px", "attenuation_lengths")
_SHORT = (0, 2, 3, 7, 9)  # columns of the table by range that an operator needs


def write_report(folder: Path) -> Path:
    """Write the page of a finished study, its plots, tables and summary; returns the page's path."""
    columns, cost = (columns_of((folder / name).read_text(encoding="utf-8")) for name in (STUDY_CSV, COST_CSV))
    summary = summary_of(columns)
    parts = parts_of(summary, cost)
    with writing(f"--out {folder}"):
        write_whole(folder / "summary.json", (json.dumps(summary, indent=1) + "\n").encode())
        (folder / PLOTS).mkdir(exist_ok=True)
        for part in parts:
            part.write(folder / PLOTS)
        write_whole(folder / "index.html", page_of(summary, parts).encode())
        write_whole(folder / "advice.html", advice_html(summary, with_tables=False).encode())
    return folder / "index.html"


def page_of(summary: Mapping[str, Any], parts: Sequence[Part]) -> str:
    """The page's HTML, which needs nothing beside it."""
    advice = Markup(advice_html(summary))
    return page("study_report.html", summary=summary, parts=parts, advice=advice, versions=versions())


def advice_html(summary: Mapping[str, Any], *, with_tables: bool = True) -> str:
    """Which method when, and how far to trust the pose at which range, as a fragment of HTML."""
    tables = [trust_table(summary, name) for name in _RANGES] if with_tables else [_short_table(summary)]
    return page("advice.html", summary=summary, sentences=advice_text(summary), tables=tables)


def trust_table(summary: Mapping[str, Any], name: str) -> NumberTable:
    """How far the program's pose can be trusted, by the bins of a factor."""
    factor = summary["factors"][name]
    rows = []
    for label, result in zip(factor["bins"], factor["methods"][PRODUCT], strict=True):
        shares = [_hundred(result[key]["value"]) for key in ("success", "right_of_reported", "nearer", "z_in_95")]
        errors = [_hundred(result["position_error_share"]["value"]), _hundred(result["position_error_share_90"])]
        angles = [result["angle_error_deg"]["value"], result["angle_error_deg_90"]]
        rows.append([label, result["success"]["count"], *shares, *errors, *angles])
    return NumberTable.of("trust", "main", f"trust_{name}", rows, title=factor["title"])


def _short_table(summary: Mapping[str, Any]) -> NumberTable:
    """Of the pose's errors by range, what an operator needs."""
    rows = [[row[column] for column in _SHORT] for row in trust_table(summary, _RANGES[0]).rows]
    return NumberTable.of("trust", "short", "trust", rows)


def parts_of(summary: Mapping[str, Any], cost: Columns) -> list[Part]:
    """All that the page shows after the advice."""
    texts = {
        "claim": "\n".join([*claim_text(summary), *factor_text(summary)]),
        "calibration": "\n".join(calibration_text(summary)),
    }
    figures = {
        "claim": {"hats_against": plots.against_figure(summary)},
        "all": {"methods": plots.methods_figure(summary)},
        "calibration": {"calibration": plots.calibration_figure(summary)},
        "cost": {"cost": plots.cost_figure(_cost_by_width(cost))},
    }
    tables = {
        "claim": {"hats_against": _against_rows(summary)},
        "all": {"methods": _methods_rows(summary)},
        "factors": {"factors": _factors_rows(summary)},
        "cost": {"cost_of_methods": _cost_rows(cost)},
    }
    numbers = {"scenes": summary["scenes"], "docks": summary["docks"], "product": METHODS[PRODUCT].title}
    parts = [
        Part.of(key, figures.get(key, {}), tables.get(key, {}), files="", text=texts.get(key, ""), **numbers)
        for key in ("claim", "all", "factors", "calibration", "cost")
    ]
    by = [
        Plot.of(f"by_{name}", words("factors", "plots", "by", title=factor["title"]), plots.factor_figure(factor))
        for name, factor in summary["factors"].items()
    ]
    return [dataclasses.replace(part, plots=by) if part.key == "factors" else part for part in parts]


def _methods_rows(summary: Mapping[str, Any]) -> Rows:
    shares = ("either_right", "position_right", "wrong_pose", "refused", "false_dock_beside", "false_dock_without")
    rows: list[list[Cell]] = []
    for result in summary["methods"].values():
        success = [_hundred(result["success"][key]) for key in ("value", "low", "high")]
        others = [_hundred(result[key]["value"]) for key in (*shares, "position_error_share")]
        rows.append([result["title"], *success, *others, result["angle_error_deg"]["value"]])
    return rows


def _against_rows(summary: Mapping[str, Any]) -> Rows:
    rows: list[list[Cell]] = []
    for first in (HATS, PRODUCT):
        for rival in RIVALS:
            one = summary["against"][first][rival]
            points = [_hundred(one[key]) for key in ("value", "low", "high")]
            counts = [one[key] for key in ("first_only", "second_only", "p_value")]
            rows.append([METHODS[first].title, METHODS[rival].title, *points, *counts])
    return rows


def _factors_rows(summary: Mapping[str, Any]) -> Rows:
    """Everything in the plots, as a file."""
    keys = ("success", "false_dock", "position_error_share", "angle_error_deg")
    pairs = [(key, part) for key in keys for part in ("value", "low", "high", "count")]
    return [
        ["factor", "bin", "method", *(f"{key}_{part}" for key, part in pairs)],
        *(
            [name, label, method, *(result[key][part] for key, part in pairs)]
            for name, factor in summary["factors"].items()
            for method, results in factor["methods"].items()
            for label, result in zip(factor["bins"], results, strict=True)
        ),
    ]


def _cost_by_width(cost: Columns) -> dict[str, dict[int, float]]:
    found = {}
    for label in METHODS:
        one = of_method(cost, label)
        widths = sorted({int(width) for width in one["width_px"]})
        found[label] = {width: float(np.median(one[ELAPSED][one["width_px"] == width])) for width in widths}
    return found


def _cost_rows(cost: Columns) -> Rows:
    return [
        [method.title, *np.quantile(of_method(cost, label)[ELAPSED], (0.5, 0.95, 1.0)).tolist()]
        for label, method in METHODS.items()
    ]


def _hundred(value: float | None) -> float | None:
    return None if value is None else 100 * value
