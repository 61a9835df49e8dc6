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
from tests.bench.peers.methods import METHODS, OF_LIGHTS, prints
from tests.bench.peers.scenes import POSES, RANGES, TURBIDITIES, Seen, drawn_by_lamps, seen, waters
from tests.bench.peers.thresholds import angle_deg

ROOT = Path(__file__).resolve().parents[3]
PAGE, FIGURE = ROOT / "docs" / "peers.md", ROOT / "docs" / "figures" / "peers.svg"
SEED, OF_THRESHOLDS = 2016, 14
MARKS = "oPs^DvX<>"


class Row(NamedTuple):
    """What a method made of a picture."""

    method: str
    water: str
    range_diameters: float
    is_found: bool
    is_right: bool
    is_placed: bool
    is_sure: bool
    off_share: float
    off_deg: float
    took_ms: float


def rows_of(job: tuple[float | None, float, int]) -> list[Row]:
    """All methods on one pose; without a turbidity the other drawer's ring."""
    turbidity, range_diameters, number = job
    if turbidity is None:
        return [_row(name, drawn_by_lamps(SEED, range_diameters, number)) for name in OF_LIGHTS]
    one = seen(SEED, turbidity, range_diameters, number, prints())
    return [_row(name, one) for name in METHODS]


def _row(name: str, one: Seen) -> Row:
    began_s = time.process_time()
    answer = METHODS[name](one)
    took_ms = 1000 * (time.process_time() - began_s)
    about = (name, one.water, one.range_diameters)
    if answer is None or not np.isfinite([*answer.position_m, *answer.normal]).all():
        return Row(*about, False, False, False, False, np.nan, np.nan, took_ms)
    off = float(np.linalg.norm(answer.position_m - one.position_m) / np.linalg.norm(one.position_m))
    turned = angle_deg(answer.normal, one.normal)
    is_placed = off <= RIGHT_SHARE
    return Row(*about, True, is_placed and turned <= RIGHT_DEG, is_placed, answer.is_sure, off, turned, took_ms)


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


def by_method(rows: Sequence[Row]) -> str:
    """Each method over all ranges and waters."""
    body = []
    for name in METHODS:
        own = [row for row in rows if row.method == name and row.water != "lamps.py"]
        right = [row for row in own if row.is_right]
        wrong = sum(row.is_found and not row.is_right for row in own)
        sure = sum(row.is_found and not row.is_right and row.is_sure for row in own)
        body.append(
            [
                *(name, str(sum(row.is_found for row in own)), interval(wilson(len(right), len(own)))),
                *(str(sum(row.is_placed for row in own)), str(wrong), str(sure)),
                f"{100 * np.median([row.off_share for row in right]):.2f}",
                *(f"{np.median([row.off_deg for row in right]):.2f}", f"{np.median([row.took_ms for row in own]):.1f}"),
            ]
        )
    head = ["way", "found", "right, %", "position right", "wrong", "sure and wrong", "position off, % of range"]
    return table([*head, "angle off, degrees", "ms"], body)


def by_factor(rows: Sequence[Row], factor: str, values: Sequence[object], titles: Sequence[str]) -> str:
    """Share of right poses by range or by water."""
    body = []
    for name in METHODS:
        own = [[row for row in rows if row.method == name and getattr(row, factor) == value] for value in values]
        body.append(
            [name, *(interval(wilson(sum(row.is_right for row in some), len(some))) if some else "" for some in own)]
        )
    return table(["right, %", *titles], body)


def of_thresholds(rows: Sequence[tuple[str, str, bool, bool, float]]) -> str:
    """Each threshold over all scenes of each drawer: groups exactly the lights, and poses right."""
    drawers = sorted({row[0] for row in rows}, reverse=True)
    body = []
    for name in thresholds.names():
        cells = []
        for drawer, column in itertools.product(drawers, (2, 3)):
            own = [row for row in rows if row[:2] == (drawer, name)]
            cells.append(interval(wilson(sum(bool(row[column]) for row in own), len(own))))
        took_ms = np.median([row[4] for row in rows if row[1] == name])
        body.append([thresholds.METHODS.title(name).partition(" (")[0], *cells, f"{took_ms:.1f}"])
    what = [f"{drawer}: {words}" for drawer, words in itertools.product(drawers, ("lights, %", "pose, %"))]
    return table(["threshold", *what, "ms"], body)


def draw_figure(rows: Sequence[Row]) -> None:
    """Share of right poses by range, a panel for each water."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    style: Any = {"svg.hashsalt": "dockpose", "svg.fonttype": "path", "font.size": 9, "axes.spines.top": False}
    with plt.rc_context(style):
        figure, panels = plt.subplots(1, len(TURBIDITIES), figsize=(11, 3.4), sharey=True, layout="constrained")
        for panel, water in zip(panels, waters(), strict=True):
            for number, (name, mark) in enumerate(zip(METHODS, MARKS, strict=True)):
                own = [
                    [r for r in rows if (r.method, r.water, r.range_diameters) == (name, water, at)] for at in RANGES
                ]
                shares = [wilson(sum(row.is_right for row in some), len(some)) for some in own]
                values = np.array([share.value for share in shares])
                ends = [values - [share.low for share in shares], [share.high for share in shares] - values]
                places = np.array(RANGES) * (1 + 0.012 * (number - 4))
                how = {"color": f"C{number}", "lw": 2.0 if number == 0 else 0.9, "markersize": 4, "elinewidth": 0.4}
                panel.errorbar(places, 100 * values, 100 * np.maximum(ends, 0), marker=mark, label=name, **how)
            panel.set(xscale="log", xlabel="range (diameters)", title=f"{water} per m")
            panel.set_xticks(RANGES, [f"{at:g}" for at in RANGES])
            panel.minorticks_off()
        panels[0].set_ylabel("right poses (%)")
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside lower center", ncols=5, frameon=False)
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
    in_water = [row for row in rows if row.water != "lamps.py"]
    of_range = by_factor(in_water, "range_diameters", RANGES, [f"{at:g} diameters" for at in RANGES])
    of_water = by_factor(rows, "water", [*waters(), "lamps.py"], [*(f"{one} per m" for one in waters()), "lamps.py"])
    count = sum(row.method == OF_LIGHTS[0] for row in in_water)
    write({"ways": f"{count} poses.\n\n{by_method(rows)}", "ranges": of_range, "waters": of_water})


def write(parts: dict[str, str]) -> None:
    """Put tables into the page."""
    page = PAGE.read_text(encoding="utf-8")
    for name, text in parts.items():
        page = put(page, name, text)
    PAGE.write_text(page, encoding="utf-8")
