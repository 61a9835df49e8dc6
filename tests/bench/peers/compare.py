"""Compare with other ways on the same pictures; writes the tables of ``docs/peers.md``, and its figure."""

import argparse
import itertools
import multiprocessing
import re
import time
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, NamedTuple

import cv2
import numpy as np
from dockpose.study.judge import RIGHT_DEG, RIGHT_SHARE
from dockpose.study.statistics import Share, wilson

from tests.bench.peers import thresholds
from tests.bench.peers.methods import METHODS, OF_LIGHTS
from tests.bench.peers.scenes import (
    AUTOMATIC,
    FIXED,
    POSES,
    RANGES,
    RULES,
    TURBIDITIES,
    Seen,
    drawn_by_lamps,
    seen,
    waters,
)
from tests.bench.peers.thresholds import angle_deg

ROOT = Path(__file__).resolve().parents[3]
PAGE, FIGURE = ROOT / "docs" / "peers.md", ROOT / "docs" / "figures" / "peers.svg"
SEED, OF_THRESHOLDS = 2016, 14
OTHER = "lamps.py"  # the other drawer, in place of a rule
MARKS = "oPs^DvX<>h"


class Row(NamedTuple):
    """What a method made of a picture."""

    method: str
    rule: str
    water: str
    range_diameters: float
    is_found: bool
    is_right: bool
    is_sure: bool
    off_share: float
    off_deg: float
    took_ms: float


def rows_of(job: tuple[float | None, float, int]) -> list[Row]:
    """All methods on one pose; without a turbidity the other drawer's ring."""
    turbidity, range_diameters, number = job
    if turbidity is None:
        return [_row(name, OTHER, drawn_by_lamps(SEED, range_diameters, number)) for name in OF_LIGHTS]
    by_rule = seen(SEED, turbidity, range_diameters, number)
    return [_row(name, rule, one) for rule, one in by_rule.items() for name in METHODS]


def _row(name: str, rule: str, one: Seen) -> Row:
    began_s = time.process_time()
    answer = METHODS[name](one)
    took_ms = 1000 * (time.process_time() - began_s)
    about = (name, rule, one.water, one.range_diameters)
    if answer is None or not np.isfinite([*answer.position_m, *answer.normal]).all():
        return Row(*about, False, False, False, np.nan, np.nan, took_ms)
    off = float(np.linalg.norm(answer.position_m - one.position_m) / np.linalg.norm(one.position_m))
    turned = angle_deg(answer.normal, one.normal)
    return Row(*about, True, off <= RIGHT_SHARE and turned <= RIGHT_DEG, answer.is_sure, off, turned, took_ms)


def threshold_rows(number: int) -> list[tuple[str, str, bool, bool, float]]:
    """Drawer and method, whether groups and pose are right, and milliseconds, of scenes with a number."""
    return [
        (lit.drawer, name, *thresholds.judged(lit, name))
        for lit in thresholds.scenes(SEED, number)
        for name in thresholds.names()
    ]


def _start() -> None:
    cv2.setNumThreads(1)


def table(head: Sequence[str], body: Iterable[Sequence[str]]) -> str:
    """A table in Markdown."""
    return "\n".join("| " + " | ".join(row) + " |" for row in (head, ["---"] * len(head), *body))


def interval(share: Share) -> str:
    """A share in per cent with its 95 % interval."""
    return f"{100 * share.value:.0f} ({100 * share.low:.0f} to {100 * share.high:.0f})"


def right(rows: Sequence[Row], **of: object) -> list[bool]:
    """Whether each pose is right, of the rows that have these values."""
    return [row.is_right for row in rows if all(getattr(row, name) == value for name, value in of.items())]


def share_right(rows: Sequence[Row], **of: object) -> Share:
    """Share of right poses among the rows that have these values."""
    some = right(rows, **of)
    return wilson(sum(some), len(some))


def summary(rows: Sequence[Row]) -> str:
    """Each method by each rule of exposure; how exact its right poses are with automatic exposure, and its time."""
    body = []
    for name in METHODS:
        own = [row for row in rows if row.method == name and row.rule == AUTOMATIC]
        off, turned = np.median([(row.off_share, row.off_deg) for row in own if row.is_right], axis=0)
        shares = [interval(share_right(rows, method=name, rule=rule)) for rule in RULES]
        shares.append(interval(share_right(rows, method=name, rule=OTHER)) if name in OF_LIGHTS else "")
        took_ms = np.median([row.took_ms for row in own])
        body.append([name, *shares, f"{100 * off:.2f}", f"{turned:.2f}", f"{took_ms:.1f}"])
    head = ["right, %", *RULES, OTHER, "position off, % of range", "angle off, degrees", "ms"]
    return table(head, body)


def by_range(rows: Sequence[Row]) -> str:
    """Each method with a fixed and with automatic exposure: the share of right poses by range, and wrong ones."""
    body = []
    for name in METHODS:
        columns = []
        for rule in (FIXED, AUTOMATIC):
            own = [row for row in rows if row.method == name and row.rule == rule]
            wrong = [row for row in own if row.is_found and not row.is_right]
            shares = [100 * share_right(own, range_diameters=at).value for at in RANGES]
            columns.append(
                [*(f"{share:.0f}" for share in shares), str(len(wrong)), str(sum(row.is_sure for row in wrong))]
            )
        body.append([name, *(", ".join(cells) for cells in zip(*columns, strict=True))])
    return table(["right, %", *(f"{at:g} diameters" for at in RANGES), "wrong", "of these sure"], body)


def of_thresholds(rows: Sequence[tuple[str, str, bool, bool, float]]) -> str:
    """Each threshold over all scenes of each drawer: shares of those with exactly the lights, and the right pose."""
    drawers = sorted({row[0] for row in rows}, reverse=True)
    body = []
    for name in thresholds.names():
        cells = []
        for drawer, column in itertools.product(drawers, (2, 3)):
            own = [row for row in rows if row[:2] == (drawer, name)]
            cells.append(f"{100 * sum(bool(row[column]) for row in own) / len(own):.0f}")
        took_ms = np.median([row[4] for row in rows if row[1] == name])
        body.append([thresholds.METHODS[name].label, *cells, f"{took_ms:.1f}"])
    what = [f"{drawer}: {words}" for drawer, words in itertools.product(drawers, ("lights, %", "pose, %"))]
    return table(["threshold", *what, "ms"], body)


def draw_figure(rows: Sequence[Row]) -> None:
    """Share of right poses by range: a row of panels for a rule of exposure, a panel for each water."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    style: Any = {"svg.hashsalt": "dockpose", "svg.fonttype": "path", "font.size": 9, "axes.spines.top": False}
    with plt.rc_context(style):
        figure, grid = plt.subplots(
            2, len(TURBIDITIES), figsize=(11, 6), sharex=True, sharey=True, layout="constrained"
        )
        for (rule, water), panel in zip(itertools.product((FIXED, AUTOMATIC), waters()), grid.flat, strict=True):
            for number, (name, mark) in enumerate(zip(METHODS, MARKS, strict=True)):
                about = {"method": name, "rule": rule, "water": water}
                shares = [100 * share_right(rows, **about, range_diameters=at).value for at in RANGES]
                places = np.array(RANGES) * (1 + 0.012 * (number - 4))
                panel.plot(places, shares, f"C{number}{mark}-", lw=2.0 if number == 0 else 0.9, ms=4, label=name)
            panel.set(xscale="log")
            panel.set_xticks(RANGES, [f"{at:g}" for at in RANGES])
            panel.minorticks_off()
        for water, above, below in zip(waters(), *grid, strict=True):
            above.set_title(f"{water} per m")
            below.set_xlabel("range (diameters)")
        for rule, panel in zip((FIXED, AUTOMATIC), grid[:, 0], strict=True):
            panel.set_ylabel(f"exposure {rule}\nright poses (%)")
        handles = grid.flat[0].get_legend_handles_labels()
        figure.legend(*handles, loc="outside lower center", ncols=5, frameon=False)
        figure.savefig(FIGURE, metadata={"Date": None, "Creator": None}, bbox_inches="tight")
        plt.close(figure)


def put(page: str, name: str, text: str) -> str:
    """A page with what stands between two marks of a name replaced."""
    pattern = rf"(<!-- {name} -->\n).*?(<!-- end -->)"
    assert re.search(pattern, page, re.S), name
    return re.sub(pattern, lambda match: f"{match[1]}\n{text}\n\n{match[2]}", page, count=1, flags=re.S)


def main() -> None:
    """Try every way on every pose, and write the page's tables and its figure."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--poses", type=int, default=POSES, help="of each range in each water")
    parser.add_argument("--scenes", type=int, default=OF_THRESHOLDS, help="of each drawer, for the thresholds")
    parser.add_argument("--jobs", type=int, default=2)
    arguments = parser.parse_args()
    began_s = time.monotonic()
    jobs = list(itertools.product((*TURBIDITIES, None), RANGES, range(arguments.poses)))
    rows_of(jobs[0])  # compiles, before there are two processes to do it
    with ProcessPoolExecutor(arguments.jobs, multiprocessing.get_context("spawn"), _start) as pool:
        rows = [row for some in pool.map(rows_of, jobs, chunksize=2) for row in some]
        write_ways(rows)
        print(f"{len(jobs)} poses in {time.monotonic() - began_s:.0f} s", flush=True)
        ours = [row for some in pool.map(threshold_rows, range(arguments.scenes)) for row in some]
        write({"thresholds": f"{arguments.scenes} scenes of each drawer.\n\n{of_thresholds(ours)}"})
    print(f"and the thresholds: {time.monotonic() - began_s:.0f} s; {PAGE.relative_to(ROOT)}")


def write_ways(rows: Sequence[Row]) -> None:
    """Write the figure, and the tables of all ways."""
    draw_figure(rows)
    count = len(right(rows, method=OF_LIGHTS[0], rule=FIXED))
    write({"ways": f"{count} poses.\n\n{summary(rows)}", "ranges": by_range(rows)})


def write(parts: dict[str, str]) -> None:
    """Put tables into the page."""
    page = PAGE.read_text(encoding="utf-8")
    for name, text in parts.items():
        page = put(page, name, text)
    PAGE.write_text(page, encoding="utf-8")
