"""The study: its scenes by several processes, and its page, its plots and its summary."""

import dataclasses
import functools
import itertools
import json
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import cv2
from dockpose.app.errors import writing
from dockpose.app.experiment.record import csv_text
from dockpose.app.export.parts import (
    Cell,
    NumberTable,
    Part,
    Plot,
    Rows,
    by_verdict,
    listed,
    make_folder,
    page,
    sentences,
    words,
    write_page,
)
from dockpose.app.export.study import plots
from dockpose.app.processing.parallel import workers
from dockpose.files import write_whole
from dockpose.study.judge import HATS, PRODUCT, RIVALS, Row, as_text, methods, scene_rows, title_of
from dockpose.study.summary import columns_of, summary_of

_RANGES = ("range_diameters", "ring_radius_px", "attenuation_lengths")
_TRUSTED = 0.9  # of the poses reported, from which on a range counts as one where they can be relied on
_SHORT = (0, 2, 3, 7, 9)  # columns of the table by range that an operator needs
_OF_ALL = ("either_right", "position_right", "wrong_pose", "refused", "false_dock_beside", "false_dock_without")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def study(out: Path, scenes: int, seed: int, jobs: int, done: Callable[[], None]) -> Path:
    """Try every method on random scenes, and write the report of that; ``done`` hears of each scene."""
    make_folder(out)
    os.environ |= dict.fromkeys(_THREADS, "1")  # idle threads of the workers' linear algebra would take their cores
    rows: list[Row] = []
    with workers(jobs) as (executor, _):
        for found in executor.map(functools.partial(_rows_of, seed), range(scenes)):
            rows += found
            done()
    table = csv_text([[*rows[0]], *([as_text(value) for value in row.values()] for row in rows)])
    with writing(f"--out {out}"):
        write_whole(out / "study.csv", table.encode())
    return write_report(out, summary_of(columns_of(table)))


def _rows_of(seed: int, scene: int) -> list[Row]:
    """Rows of one scene. Runs in a worker."""
    cv2.setNumThreads(1)
    return scene_rows(seed, scene)


def write_report(out: Path, summary: Mapping[str, Any]) -> Path:
    """Write the page, its plots and tables, the summary and the advice for the help; returns the page's path."""
    parts = parts_of(summary)
    with writing(f"--out {out}"):
        write_whole(out / "summary.json", (json.dumps(summary, indent=1) + "\n").encode())
        write_whole(out / "advice.html", advice_html(summary).encode())
        for part in parts:
            part.write(out)
    return write_page(out / "study.md", parts, summary=summary)


def advice_html(summary: Mapping[str, Any]) -> str:
    """Which method when, and of the pose's errors by range what an operator needs, as a fragment of HTML."""
    rows = [[row[column] for column in _SHORT] for row in trust_table(summary, _RANGES[0]).rows]
    short = NumberTable.of("advice", "short", "trust", rows)
    return page("advice.html", summary=summary, sentences=advice_text(summary), by_range=short)


def trust_table(summary: Mapping[str, Any], name: str) -> NumberTable:
    """How far the program's pose can be trusted, by the bins of a factor."""
    factor, rows = summary["factors"][name], []
    for label, result in _product_by(factor).items():
        shares = (result[key]["value"] for key in ("success", "right_of_reported", "nearer", "z_in_95"))
        cells = [*shares, result["position_error_share"]["value"], result["position_error_share_90"]]
        angles = result["angle_error_deg"]["value"], result["angle_error_deg_90"]
        rows.append([label, result["success"]["count"], *map(_hundred, cells), *angles])
    return NumberTable.of("advice", "trust", f"trust_{name}", rows, title=factor["title"])


def parts_of(summary: Mapping[str, Any]) -> list[Part]:
    """All that the page shows."""
    numbers = {"scenes": summary["scenes"], "docks": summary["docks"], "product": title_of(PRODUCT)}
    against = [
        [title_of(first), title_of(rival), *_with_interval(one), one["first_only"], one["second_only"], one["p_value"]]
        for first, of in summary["against"].items()
        for rival, one in of.items()
    ]
    of_all: list[list[Cell]] = []
    for one in summary["methods"].values():
        others = (_hundred(one[key]["value"]) for key in (*_OF_ALL, "position_error_share"))
        of_all.append([one["title"], *_with_interval(one["success"]), *others, one["angle_error_deg"]["value"]])
    by = [
        Plot.of(f"by_{name}", words("factors", "plots", "by", title=factor["title"]), plots.factor_figure(factor))
        for name, factor in summary["factors"].items()
    ]
    claims, held = [*claim_text(summary), *factor_text(summary)], calibration_text(summary)
    figures = plots.against_figure(summary), plots.methods_figure(summary), plots.calibration_figure(summary)
    advice = Part.of("advice", {}, {}, text="\n\n".join(advice_text(summary)))
    return [
        dataclasses.replace(advice, tables=[trust_table(summary, name) for name in _RANGES]),
        Part.of("hats_against", {"main": figures[0]}, {"main": against}, text="\n\n".join(claims)),
        Part.of("methods", {"main": figures[1]}, {"main": of_all}, **numbers),
        dataclasses.replace(Part.of("factors", {}, {"main": _factors_rows(summary)}), plots=by),
        Part.of("calibration", {"main": figures[2]}, {}, text="\n\n".join(held), **numbers),
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
