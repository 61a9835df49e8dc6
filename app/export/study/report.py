"""The study's page, its plots and its summary, from ``study.csv`` and ``cost.csv``."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import jinja2
import numpy as np
from dockpose.app.errors import writing
from dockpose.app.experiment.versions import versions
from dockpose.app.export.reproduction.part import NumberTable, Part, Plot
from dockpose.app.export.study.plots import against_plot, calibration_plot, cost_plot, factor_plot, methods_plot
from dockpose.app.export.study.words import advice_text, calibration_text, claim_text, factor_text
from dockpose.app.processing.study import COST_CSV, STUDY_CSV
from dockpose.app.resources import static_path
from dockpose.camera.durable_files import write_whole
from dockpose.study.methods import HATS, METHODS, PRODUCT, RIVALS
from dockpose.study.scenes import ELAPSED
from dockpose.study.summary import summary_of
from dockpose.study.table import Columns, columns_of, of_method
from markupsafe import Markup

PLOTS = "plots"  # folder of the plots and tables
_RANGES = ("range_diameters", "ring_radius_px", "attenuation_lengths")


def write_report(folder: Path) -> Path:
    """Write the page of a finished study, its plots, tables and summary; returns the page's path."""
    columns = columns_of((folder / STUDY_CSV).read_text(encoding="utf-8"))
    cost = columns_of((folder / COST_CSV).read_text(encoding="utf-8"))
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
    environment = jinja2.Environment(autoescape=True, trim_blocks=True, lstrip_blocks=True)
    template = environment.from_string(static_path("study_report.html").read_text(encoding="utf-8"))
    return template.render(summary=summary, parts=parts, advice=Markup(advice_html(summary)), versions=versions())


def advice_html(summary: Mapping[str, Any], *, with_tables: bool = True) -> str:
    """Which method when, and how far to trust the pose at which range, as a fragment of HTML."""
    text = Markup("").join(Markup("<li>{}</li>\n").format(sentence) for sentence in advice_text(summary))
    tables = [trust_table(summary, name) for name in _RANGES] if with_tables else [_short_table(summary)]
    source = f"From {summary['scenes']} simulated scenes of seed {summary['seed']}, {summary['docks']} with a dock."
    limits = (
        "The camera and the number of lights are known exactly in them, and the pictures are simulated: a real camera, "
        "calibrated with errors, and a dock that is not built to its drawing do worse."
    )
    return str(
        Markup("<p>{} {}</p>\n<ul>\n{}</ul>\n{}").format(
            source, limits, text, Markup("").join(map(_table_html, tables))
        )
    )


def trust_table(summary: Mapping[str, Any], name: str) -> NumberTable:
    """How far the program's pose can be trusted, by the bins of a factor."""
    factor = summary["factors"][name]
    rows = []
    for label, result in zip(factor["bins"], factor["methods"][PRODUCT], strict=True):
        shares = [_hundred(result[key]["value"]) for key in ("success", "right_of_reported", "nearer", "z_in_95")]
        errors = [_hundred(result["position_error_share"]["value"]), _hundred(result["position_error_share_90"])]
        angles = [result["angle_error_deg"]["value"], result["angle_error_deg_90"]]
        rows.append([label, result["success"]["count"], *shares, *errors, *angles])
    head = [
        factor["title"],
        "docks",
        "found and right in %",
        "right of those reported in %",
        "nearer pose chosen in %",
        "z within its 95 % interval in %",
        "position error, median, in % of range",
        "9 of 10 within",
        "angle error, median, in degrees",
        "9 of 10 within",
    ]
    return NumberTable(f"trust_{name}", f"The program's pose, by {factor['title']}", head, rows)


def _short_table(summary: Mapping[str, Any]) -> NumberTable:
    """Of the pose's errors by range, what an operator needs."""
    whole = trust_table(summary, _RANGES[0])
    columns = [0, 2, 3, 7, 9]
    head = [
        "range in dock diameters",
        "found, %",
        "right if found, %",
        "position off, % of range",
        "angle off, degrees",
    ]
    rows = [[row[column] for column in columns] for row in whole.rows]
    return NumberTable("trust", "Nine of ten poses are off by at most so much, by range.", head, rows, digits=2)


def parts_of(summary: Mapping[str, Any], cost: Columns) -> list[Part]:
    """All that the page shows after the advice."""
    claim = "\n".join([*claim_text(summary), *factor_text(summary)])
    factors = [factor_plot(name, factor) for name, factor in summary["factors"].items()]
    by_width = _cost_by_width(cost)
    return [
        _part("claim", "HATS against its rivals", claim, [against_plot(summary)], [_against_table(summary)]),
        _part("all", "All methods", "", [methods_plot(summary)], [_methods_table(summary)]),
        _part("factors", "What makes it hard", "", factors, [_factors_table(summary)]),
        _part(
            "calibration",
            "Probabilities and intervals",
            "\n".join(calibration_text(summary)),
            [calibration_plot(summary)],
        ),
        _part("cost", "Cost", "", [cost_plot(by_width)], [_cost_table(cost)]),
    ]


def _part(key: str, title: str, text: str, plots: Sequence[Plot], tables: Sequence[NumberTable] = ()) -> Part:
    return Part(key, title, "", text, "", plots, tables)


def _methods_table(summary: Mapping[str, Any]) -> NumberTable:
    shares = ("success", "either_right", "position_right", "wrong_pose", "refused")
    false = ("false_dock_beside", "false_dock_without")
    head = ["method", "success", "from", "to", "either pose right", "position right", "wrong pose", "refused"]
    head += ["false dock beside one", "false dock where none is", "position error, % of range", "angle error, degrees"]
    rows = []
    for result in summary["methods"].values():
        success = [_hundred(result["success"][key]) for key in ("value", "low", "high")]
        others = [_hundred(result[key]["value"]) for key in (*shares[1:], *false)]
        errors = [_hundred(result["position_error_share"]["value"]), result["angle_error_deg"]["value"]]
        rows.append([result["title"], *success, *others, *errors])
    return NumberTable("methods", "Shares in %, of the scenes with or without a dock; errors are medians", head, rows)


def _against_table(summary: Mapping[str, Any]) -> NumberTable:
    rows = []
    for first in (HATS, PRODUCT):
        for rival in RIVALS:
            one = summary["against"][first][rival]
            points = [_hundred(one[key]) for key in ("value", "low", "high")]
            names = [METHODS[first].title, METHODS[rival].title]
            rows.append([*names, *points, one["first_only"], one["second_only"], one["p_value"]])
    head = [
        "method",
        "rival",
        "difference",
        "from",
        "to",
        "only the method right",
        "only the rival right",
        "p (McNemar)",
    ]
    caption = "Difference in success in percentage points on the same scenes, with its 95 % interval"
    return NumberTable("hats_against", caption, head, rows)


def _factors_table(summary: Mapping[str, Any]) -> NumberTable:
    """Everything in the plots, as a file."""
    keys = ("success", "false_dock", "position_error_share", "angle_error_deg")
    head = ["factor", "bin", "method", *(f"{key}_{part}" for key in keys for part in ("value", "low", "high", "count"))]
    rows = [
        [name, label, method, *(result[key][part] for key in keys for part in ("value", "low", "high", "count"))]
        for name, factor in summary["factors"].items()
        for method, results in factor["methods"].items()
        for label, result in zip(factor["bins"], results, strict=True)
    ]
    return NumberTable("factors", "All methods by factor", head, rows, is_shown=False)


def _cost_by_width(cost: Columns) -> dict[str, dict[int, float]]:
    found = {}
    for label in METHODS:
        one = of_method(cost, label)
        widths = sorted({int(width) for width in one["width_px"]})
        found[label] = {width: float(np.median(one[ELAPSED][one["width_px"] == width])) for width in widths}
    return found


def _cost_table(cost: Columns) -> NumberTable:
    rows = []
    for label, method in METHODS.items():
        elapsed_ms = of_method(cost, label)[ELAPSED]
        rows.append([method.title, *(float(np.quantile(elapsed_ms, share)) for share in (0.5, 0.95, 1.0))])
    return NumberTable(
        "cost_of_methods", "Time of a scene in ms", ["method", "median", "19 of 20 within", "longest"], rows
    )


def _table_html(table: NumberTable) -> Markup:
    head = Markup("").join(Markup("<th>{}</th>").format(cell) for cell in table.head)
    rows = Markup("\n").join(
        Markup("<tr>{}</tr>").format(Markup("").join(Markup("<td>{}</td>").format(cell) for cell in row))
        for row in table.shown
    )
    body = "<caption>{}</caption>\n<thead><tr>{}</tr></thead>\n<tbody>\n{}\n</tbody>"
    return Markup(f'<div class="wide"><table>{body}</table></div>\n').format(table.caption, head, rows)


def _hundred(value: float | None) -> float | None:
    return None if value is None else 100 * value
