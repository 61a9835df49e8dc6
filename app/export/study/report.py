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
_OF_ALL = ("either_right", "position_right", "wrong_pose", "refused", "false_dock_beside", "false_dock_without")


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
    factor, rows = summary["factors"][name], []
    for label, result in _product_by(factor).items():
        shares = (result[key]["value"] for key in ("success", "right_of_reported", "nearer", "z_in_95"))
        cells = [*shares, result["position_error_share"]["value"], result["position_error_share_90"]]
        angles = result["angle_error_deg"]["value"], result["angle_error_deg_90"]
        rows.append([label, result["success"]["count"], *map(_hundred, cells), *angles])
    return NumberTable.of("trust", "main", f"trust_{name}", rows, title=factor["title"])


def parts_of(summary: Mapping[str, Any], cost: Columns) -> list[Part]:
    """All that the page shows after the advice."""
    numbers = {"scenes": summary["scenes"], "docks": summary["docks"], "product": title_of(PRODUCT)}

    def part(key: str, figures: Mapping[str, Figure], tables: Mapping[str, Rows], *paragraphs: str) -> Part:
        return Part.of(key, figures, tables, files="", text="\n\n".join(paragraphs), **numbers)

    against = [
        [title_of(first), title_of(rival), *_with_interval(one), one["first_only"], one["second_only"], one["p_value"]]
        for first, of in summary["against"].items()
        for rival, one in of.items()
    ]
    of_all: list[list[Cell]] = []
    for one in summary["methods"].values():
        others = (_hundred(one[key]["value"]) for key in (*_OF_ALL, "position_error_share"))
        of_all.append([one["title"], *_with_interval(one["success"]), *others, one["angle_error_deg"]["value"]])
    times = {label: of_method(cost, label) for label in methods()}
    costs = [[title_of(label), *np.quantile(one[ELAPSED], (0.5, 0.95, 1.0)).tolist()] for label, one in times.items()]
    by = [
        Plot.of(f"by_{name}", words("factors", "plots", "by", title=factor["title"]), plots.factor_figure(factor))
        for name, factor in summary["factors"].items()
    ]
    claims = *claim_text(summary), *factor_text(summary)
    return [
        part("claim", {"hats_against": plots.against_figure(summary)}, {"hats_against": against}, *claims),
        part("all", {"methods": plots.methods_figure(summary)}, {"methods": of_all}),
        dataclasses.replace(part("factors", {}, {"factors": _factors_rows(summary)}), plots=by),
        part("calibration", {"calibration": plots.calibration_figure(summary)}, {}, *calibration_text(summary)),
        part("cost", {}, {"cost_of_methods": costs}),
    ]


def _factors_rows(summary: Mapping[str, Any]) -> Rows:
    """Everything in the plots, as a file."""
    keys = ("success", "false_dock", "position_error_share", "angle_error_deg")
    pairs = list(itertools.product(keys, ("value", "low", "high", "count")))
    rows: list[list[Cell]] = [["factor", "bin", "method", *(f"{key}_{part}" for key, part in pairs)]]
    for name, factor in summary["factors"].items():
        for method, results in factor["methods"].items():
            for label, result in zip(factor["bins"], results, strict=True):
                rows.append([name, label, method, *(result[key][part] for key, part in pairs)])
    return rows


def _with_interval(one: Mapping[str, Any]) -> list[float | None]:
    return [_hundred(one[key]) for key in ("value", "low", "high")]


def _hundred(value: float | None) -> float | None:
    return None if value is None else 100 * value


def claim_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether HATS's claim against its rivals stands."""
    against = {first: by_verdict(differences) for first, differences in summary["against"].items()}
    return sentences("study.txt", "claim", summary, HATS, PRODUCT, against)


def factor_text(summary: Mapping[str, Any]) -> list[str]:
    """For each rival, where HATS is better or worse than it by more than chance."""
    where: dict[str, dict[str, list[str]]] = {rival: {"better": [], "worse": []} for rival in RIVALS}
    for factor in summary["factors"].values():
        for rival, found in where.items():
            sorts = by_verdict(dict(zip(factor["bins"], factor["against"][rival], strict=True)))
            for sort in found.keys() & sorts.keys():
                bins = "throughout" if sorts[sort] == factor["bins"] else listed(sorts[sort])
                found[sort].append(f"{factor['title']} {bins}")
    known = {rival: {sort: found for sort, found in of.items() if found} for rival, of in where.items()}
    return sentences("study.txt", "factors", summary, known)


def calibration_text(summary: Mapping[str, Any]) -> list[str]:
    """Whether probabilities and intervals hold, and what a range that is too long or too short does to them."""
    off = {
        key: [r for r in rows if r["came"]["count"] and not r["came"]["low"] <= r["told"] <= r["came"]["high"]]
        for key, rows in summary["calibration"].items()
    }
    too_far, lamps = summary["methods"][PRODUCT]["too_far"], _product_by(summary["factors"]["lamp_spacings"])
    return sentences("study.txt", "calibration", summary, off, too_far, lamps)


def advice_text(summary: Mapping[str, Any]) -> list[str]:
    """Which method when, and how far to trust the pose at which range."""
    best = max(methods(), key=lambda label: summary["methods"][label]["success"]["value"] or 0)
    others = [label for label in (PRODUCT, HATS) if label != best]
    reached = {}
    for factor in (summary["factors"][name] for name in (*_RANGES, "lit_share")):
        reached[factor["title"]] = {name: one["right_of_reported"] for name, one in _product_by(factor).items()}
    exceptions = []  # where some other method does better than the program's by more than both intervals
    for factor in summary["factors"].values():
        for number, name in enumerate(factor["bins"]):
            shares = {label: factor["methods"][label][number]["success"] for label in methods()}
            ours = shares[PRODUCT]["high"]
            better = [title_of(label) for label, one in shares.items() if ours is not None and one["low"] > ours]
            if better:
                exceptions.append(f"{listed(better)} at {factor['title']} {name}")
    return sentences("study.txt", "advice", summary, best, others, PRODUCT, exceptions, reached, _TRUSTED)


def _product_by(factor: Mapping[str, Any]) -> dict[str, Any]:
    return dict(zip(factor["bins"], factor["methods"][PRODUCT], strict=True))
