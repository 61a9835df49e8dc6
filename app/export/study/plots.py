"""Plots of the study: every method against every factor, HATS against its rivals, and calibration."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

from dockpose.app.drawing.colours import BLUE, GREEN, VERMILLION
from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.plots import draw_intervals
from dockpose.study.judge import HATS, PRODUCT, RIVALS, methods, title_of
from dockpose.study.summary import INTERVALS
from dockpose.thresholds import METHODS as THRESHOLDS
from matplotlib.axes import Axes
from matplotlib.figure import Figure

# Key of a result, title of its panel, factor on its numbers, and whether its scale is logarithmic.
_PANELS = (
    ("success", "success in %", 100, "linear"),
    ("false_dock", "false docks in %", 100, "linear"),
    ("position_error_share", "position error, % of range", 100, "log"),
    ("angle_error_deg", "angle error in degrees", 1, "log"),
)
_STEP = 0.11  # between methods, in bins, so that their intervals stand side by side
_GRID = {"color": "#dddddd", "linewidth": 0.6}


def _looks(label: str) -> tuple[str, str]:
    return (BLUE, "P") if label == PRODUCT else (THRESHOLDS[label].colour, THRESHOLDS[label].mark)


def factor_figure(factor: Mapping[str, Any]) -> Figure:
    """Success, false docks and errors of every method against one factor."""
    figure = new_figure(11.5, 5.6)
    first = [HATS, *RIVALS]  # in two rows, since all would hide each other
    others = [label for label in methods() if label not in first]
    groups = {"HATS and the paper's rivals": first, "with local levels, and others": others}
    axes = figure.subplots(2, len(_PANELS), sharex=True, sharey="col")
    for row, (group, labels) in zip(axes.tolist(), groups.items(), strict=True):
        for panel, (key, title, scale, kind) in zip(row, _PANELS, strict=True):
            shares = {label: [one[key] for one in factor["methods"][label]] for label in labels}
            _lines(panel, shares, 2, scale)
            panel.set_yscale(kind)
            panel.tick_params(labelsize=7)
            panel.grid(axis="y", **_GRID)
            panel.set_title(title if labels[0] == HATS else "", fontsize=9)
            panel.set_xticks(range(len(factor["bins"])), factor["bins"], rotation=40, ha="right")
        row[0].set_ylim(-3, 103)
        row[0].set_ylabel(group, fontsize=8)
        if row[-1].get_legend_handles_labels()[0]:  # no pose was found in a study of a few scenes
            row[-1].legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False)
    figure.supxlabel(factor["title"], fontsize=8)
    # tight_layout would take as long as drawing
    figure.subplots_adjust(0.06, 0.19, 0.87, 0.95, wspace=0.24, hspace=0.1)
    return figure


def methods_figure(summary: Mapping[str, Any]) -> Figure:
    """Success and false docks of every method over all scenes."""
    figure = new_figure(9, 3.2)
    order = sorted(methods(), key=lambda label: summary["methods"][label]["success"]["value"] or 0)
    for axes, (key, title, _, _) in zip(figure.subplots(1, 2, sharey=True), _PANELS, strict=False):
        for place, label in enumerate(order):
            draw_intervals(axes, [place], [summary["methods"][label][key]], _looks(label), across=True)
        axes.set_yticks(range(len(order)), [title_of(label) for label in order])
        axes.set_title(title, fontsize=9)
        axes.set_xlim(left=0)
        axes.grid(axis="x", **_GRID)
    figure.tight_layout()
    return figure


def against_figure(summary: Mapping[str, Any]) -> Figure:
    """HATS less each rival in success on the same scenes, overall and by factor."""
    factors = summary["factors"].values()
    rows = math.ceil((len(factors) + 1) / 4)
    figure = new_figure(11.5, 2.4 * rows)
    axes = figure.subplots(rows, 4, sharey=True).ravel()
    for place, rival in enumerate(RIVALS):
        draw_intervals(axes[0], [place], [summary["against"][HATS][rival]], _looks(rival))
    for panel, factor in zip(axes[1:], factors, strict=False):
        _lines(panel, factor["against"], 1.5, 100)
    names = [("all scenes with a dock", list(map(title_of, RIVALS))), *((one["title"], one["bins"]) for one in factors)]
    for panel, (title, ticks) in zip(axes, names, strict=False):
        panel.set_xticks(range(len(ticks)), ticks, rotation=35, ha="right", fontsize=6)
        panel.set_title(title, fontsize=8)
        panel.axhline(0, color="black", linewidth=0.8)
        panel.grid(axis="y", **_GRID)
        panel.tick_params(axis="y", labelsize=7)
    for panel in axes[len(names) :]:
        panel.axis("off")
    axes[-1].legend(*axes[1].get_legend_handles_labels(), fontsize=8, loc="center")
    figure.supylabel("HATS less the rival, in percentage points of success", fontsize=8)
    figure.tight_layout()
    return figure


def calibration_figure(summary: Mapping[str, Any]) -> Figure:
    """How often it came true against the probability that was given; and the share of truths within the intervals."""
    figure = new_figure(11, 3.4)
    axes = figure.subplots(1, 3)
    titles = {"probability": "chosen pose is the nearer, in %", "detection": "what is reported is the dock, in %"}
    for panel, (key, title) in zip(axes, titles.items(), strict=False):
        rows = [row for row in summary["calibration"][key] if row["came"]["count"]]
        came = [row["came"] for row in rows]
        draw_intervals(panel, range(len(rows)), came, (BLUE, "o"), label="came true, with 95 % interval")
        given = [100 * row["told"] for row in rows]
        panel.plot(given, "x", color=VERMILLION, label="given, on average" if rows else None)
        names = [f"{row['bin']}\n({row['came']['count']})" for row in rows]
        panel.set_xticks(range(len(rows)), names, fontsize=6, rotation=30)
        panel.set_xlabel(f"{key} that was given (cases)", fontsize=8)
        panel.set_title(title, fontsize=9)
    for name, words, looks, aside in (
        ("all", "all poses of the dock", (BLUE, "o"), -0.1),
        ("nearer", "where the nearer was chosen", (GREEN, "s"), 0.1),
    ):
        shares = list(summary["coverage"][name].values())
        draw_intervals(axes[2], [place + aside for place in range(len(shares))], shares, looks, label=words)
    axes[2].axhline(95, color="black", linewidth=0.8, linestyle="--")
    axes[2].set_xticks(range(len(INTERVALS)), INTERVALS)
    axes[2].set_title("truths within the 95 % interval, in %", fontsize=9)
    for panel in axes:
        panel.set_ylim(0, 103)
        panel.tick_params(axis="y", labelsize=7)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(fontsize=7, loc="lower right")
    figure.tight_layout()
    return figure


def _lines(axes: Axes, shares: Mapping[str, Sequence[Mapping[str, Any]]], middle: float, scale: float) -> None:
    """Draw what each method reached in each bin, side by side about the bin's place."""
    for number, (label, of_bins) in enumerate(shares.items()):
        colour, mark = _looks(label)
        places = [place + _STEP * (number - middle) for place in range(len(of_bins))]
        looks = colour, f"{mark}-"
        draw_intervals(axes, places, of_bins, looks, scale=scale, ms=3.5, label=title_of(label))
