"""The study's page, its plots and its summary, from ``study.csv`` and ``cost.csv``."""

import dataclasses
import itertools
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from dockpose.app.errors import writing
from dockpose.app.export.parts import Cell, NumberTable, Part, Plot, Rows, by_verdict, listed, page, sentences, words
from dockpose.app.export.study import plots
from dockpose.app.processing.study import COST_CSV, STUDY_CSV
from dockpose.app.resources import versions
from dockpose.files import write_whole
from dockpose.study.judge import ELAPSED, HATS, PRODUCT, RIVALS, methods, title_of
from dockpose.study.summary import Columns, columns_of, of_method, summary_of
from markupsafe import Markup
from matplotlib.figure import Figure

PLOTS = "plots"  # folder of the plots and tables
_RANGES = ("range_diameters", "ring_radius_px", "attenuation_lengths")
_TRUSTED = 0.9  # of the poses reported, from which on a range counts as one where they can be relied on
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
    tables = [trust_table(summary, name) for name in _RANGES]
    if not with_tables:  # of the pose's errors by range, what an operator needs
        rows = [[row[column] for column in _SHORT] for row in tables[0].rows]
        tables = [NumberTable.of("trust", "short", "trust", rows)]
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


def parts_of(summary: Mapping[str, Any], cost: Columns) -> list[Part]:
    """All that the page shows after the advice."""
    numbers = {"scenes": summary["scenes"], "docks": summary["docks"], "product": title_of(PRODUCT)}

    def part(key: str, figures: Mapping[str, Figure], tables: Mapping[str, Rows], *paragraphs: str) -> Part:
        return Part.of(key, figures, tables, files="", text="\n\n".join(paragraphs), **numbers)

    against = {"hats_against": plots.against_figure(summary)}
    claims = *claim_text(summary), *factor_text(summary)
    calibration = {"calibration": plots.calibration_figure(summary)}
    by = [
        Plot.of(f"by_{name}", words("factors", "plots", "by", title=factor["title"]), plots.factor_figure(factor))
        for name, factor in summary["factors"].items()
    ]
    return [
        part("claim", against, {"hats_against": _against_rows(summary)}, *claims),
        part("all", {"methods": plots.methods_figure(summary)}, {"methods": _methods_rows(summary)}),
        dataclasses.replace(part("factors", {}, {"factors": _factors_rows(summary)}), plots=by),
        part("calibration", calibration, {}, *calibration_text(summary)),
        part("cost", {"cost": plots.cost_figure(_cost_by_width(cost))}, {"cost_of_methods": _cost_rows(cost)}),
    ]


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
    for first, rival in itertools.product((HATS, PRODUCT), RIVALS):
        one = summary["against"][first][rival]
        points = [_hundred(one[key]) for key in ("value", "low", "high")]
        counts = [one[key] for key in ("first_only", "second_only", "p_value")]
        rows.append([title_of(first), title_of(rival), *points, *counts])
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
    for label in methods():
        one = of_method(cost, label)
        widths = sorted({int(width) for width in one["width_px"]})
        found[label] = {width: float(np.median(one[ELAPSED][one["width_px"] == width])) for width in widths}
    return found


def _cost_rows(cost: Columns) -> Rows:
    return [
        [title_of(label), *np.quantile(of_method(cost, label)[ELAPSED], (0.5, 0.95, 1.0)).tolist()]
        for label in methods()
    ]


def _hundred(value: float | None) -> float | None:
    return None if value is None else 100 * value


def claim_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether HATS's claim against its rivals stands."""
    against = {first: by_verdict(differences) for first, differences in summary["against"].items()}
    return sentences("study.txt", "claim", summary, HATS, PRODUCT, against)


def factor_text(summary: Mapping[str, Any]) -> list[str]:
    """For each rival, where HATS is better or worse than it by more than chance."""
    where: dict[str, dict[str, list[str]]] = {rival: {} for rival in RIVALS}
    for rival, found in where.items():
        for sort in ("better", "worse"):
            if bins := _bins(summary, rival, sort):
                found[sort] = bins
    return sentences("study.txt", "factors", summary, where)


def _bins(summary: Mapping[str, Any], rival: str, sort: str) -> list[str]:
    """The bins of each factor in which HATS is better, or worse."""
    found = []
    for factor in summary["factors"].values():
        names = by_verdict(dict(zip(factor["bins"], factor["against"][rival], strict=True))).get(sort)
        if names:
            found.append(f"{factor['title']} {'throughout' if names == factor['bins'] else listed(names)}")
    return found


def calibration_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether probabilities and intervals hold, and what a range that is too long or too short does to them."""
    off = {}
    for key, rows in summary["calibration"].items():
        given = [row for row in rows if row["came"]["count"]]
        off[key] = [row for row in given if not row["came"]["low"] <= row["told"] <= row["came"]["high"]]
    too_far, lamps = summary["methods"][PRODUCT]["too_far"], _product_by(summary["factors"]["lamp_spacings"])
    return sentences("study.txt", "calibration", summary, off, too_far, lamps)


def advice_text(summary: Mapping[str, Any]) -> list[str]:
    """Which method when, and how far to trust the pose at which range."""
    best = max(methods(), key=lambda label: summary["methods"][label]["success"]["value"] or 0)
    others = [label for label in (PRODUCT, HATS) if label != best]
    reached = {}
    for factor in (summary["factors"][name] for name in (*_RANGES, "lit_share")):
        reached[factor["title"]] = {name: one["right_of_reported"] for name, one in _product_by(factor).items()}
    return sentences("study.txt", "advice", summary, best, others, PRODUCT, _exceptions(summary), reached, _TRUSTED)


def _product_by(factor: Mapping[str, Any]) -> dict[str, Any]:
    return dict(zip(factor["bins"], factor["methods"][PRODUCT], strict=True))


def _exceptions(summary: Mapping[str, Any]) -> list[str]:
    """Where some other method does better than the program's by more than both intervals."""
    found = []
    for factor in summary["factors"].values():
        for number, name in enumerate(factor["bins"]):
            shares = {label: factor["methods"][label][number]["success"] for label in methods()}
            ours = shares[PRODUCT]["high"]
            lows = {label: one["low"] for label, one in shares.items() if None not in (one["low"], ours)}
            better = [title_of(label) for label, low in lows.items() if low > ours]
            if better:
                found.append(f"{listed(better)} at {factor['title']} {name}")
    return found
