"""Plots of the study: every method against every factor, HATS against its rivals, calibration and cost."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from dockpose.app.drawing.colours import BLUE, GREEN, GREY, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.reproduction.part import Plot
from dockpose.study.methods import HATS, METHODS, PRODUCT, RIVALS
from dockpose.study.summary import INTERVALS

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Colour and mark of each method; told apart by the mark alone within a group.
_LOOKS = {
    HATS: (BLUE, "o"),
    "otsu": (VERMILLION, "s"),
    "kapur": (GREEN, "^"),
    "kittler": (PURPLE, "D"),
    "sezan": (ORANGE, "v"),
    PRODUCT: (BLUE, "P"),
    "hats_local": (SKY_BLUE, "s"),
    "li": (GREY, "^"),
    "yen": (PURPLE, "D"),
    "triangle": (ORANGE, "v"),
}
_GROUPS = {"HATS and the paper's rivals": (HATS, *RIVALS), "with local levels, and others": tuple(_LOOKS)[5:]}
# Key of a result, title of its panel, factor on its numbers, and whether its scale is logarithmic.
_PANELS = (
    ("success", "success in %", 100, False),
    ("false_dock", "false docks in %", 100, False),
    ("position_error_share", "position error, % of range", 100, True),
    ("angle_error_deg", "angle error in degrees", 1, True),
)
_STEP = 0.11  # between methods, in bins, so that their intervals stand side by side


def factor_plot(name: str, factor: Mapping[str, Any]) -> Plot:
    """Success, false docks and errors of every method against one factor."""
    figure = new_figure(11.5, 5.6)
    axes = figure.subplots(2, len(_PANELS), sharex=True, sharey="col")
    places = range(len(factor["bins"]))
    for row, (group, labels) in zip(axes.tolist(), _GROUPS.items(), strict=True):
        for panel, (key, title, scale, is_log) in zip(row, _PANELS, strict=True):
            for number, label in enumerate(labels):
                shares = [one[key] for one in factor["methods"][label]]
                _line(panel, [place + _STEP * (number - 2) for place in places], shares, label, scale)
            panel.set_yscale("log" if is_log else "linear")
            panel.tick_params(labelsize=7)
            panel.grid(axis="y", color="#dddddd", linewidth=0.6)
            panel.set_title(title if labels[0] == HATS else "", fontsize=9)
            panel.set_xticks(list(places), factor["bins"], rotation=40, ha="right")
        row[0].set_ylim(-3, 103)
        row[0].set_ylabel(group, fontsize=8)
        row[-1].legend(fontsize=6.5, loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False)
    figure.supxlabel(factor["title"], fontsize=8)
    figure.subplots_adjust(
        0.06, 0.19, 0.87, 0.95, wspace=0.24, hspace=0.1
    )  # tight_layout would take as long as drawing
    caption = f"Every method against {factor['title']}; bars: 95 % intervals. Errors are medians over docks found."
    return Plot.of(f"by_{name}", caption, figure)


def methods_plot(summary: Mapping[str, Any]) -> Plot:
    """Success and false docks of every method over all scenes."""
    figure = new_figure(9, 3.2)
    left, right = figure.subplots(1, 2, sharey=True)
    order = sorted(METHODS, key=lambda label: summary["methods"][label]["success"]["value"] or 0)
    for axes, key, title in ((left, "success", "success in %"), (right, "false_dock", "false docks in %")):
        for place, label in enumerate(order):
            _bar(axes, summary["methods"][label][key], place, *_LOOKS[label])
        axes.set_yticks(range(len(order)), [METHODS[label].title for label in order])
        axes.set_title(title, fontsize=9)
        axes.set_xlim(left=0)
        axes.grid(axis="x", color="#dddddd", linewidth=0.6)
    figure.tight_layout()
    scenes = f"{summary['scenes']} scenes, {summary['docks']} of them with a dock"
    return Plot.of("methods", f"All methods on the same {scenes}; with 95 % intervals.", figure)


def against_plot(summary: Mapping[str, Any]) -> Plot:
    """HATS less each rival in success on the same scenes, overall and by factor."""
    factors = summary["factors"]
    rows = math.ceil((len(factors) + 1) / 4)
    figure = new_figure(11.5, 2.4 * rows)
    axes = figure.subplots(rows, 4, sharey=True).ravel()
    _overall(axes[0], summary)
    for panel, factor in zip(axes[1:], factors.values(), strict=False):
        for number, rival in enumerate(RIVALS):
            places = [place + _STEP * (number - 1.5) for place in range(len(factor["bins"]))]
            _line(panel, places, factor["against"][rival], rival, 100)
        panel.set_xticks(range(len(factor["bins"])), factor["bins"], rotation=35, ha="right", fontsize=6)
        panel.set_title(factor["title"], fontsize=8)
    for panel in axes[: len(factors) + 1]:
        panel.axhline(0, color="black", linewidth=0.8)
        panel.grid(axis="y", color="#dddddd", linewidth=0.6)
        panel.tick_params(axis="y", labelsize=7)
    for panel in axes[len(factors) + 1 :]:
        panel.axis("off")
    marks, names = axes[1].get_legend_handles_labels()
    axes[-1].legend(marks, names, fontsize=8, loc="center")
    figure.supylabel("HATS less the rival, in percentage points of success", fontsize=8)
    figure.tight_layout()
    caption = (
        "HATS less each rival on the same scenes, with 95 % intervals of the difference; above zero HATS is better."
    )
    return Plot.of("hats_against", caption, figure)


def calibration_plot(summary: Mapping[str, Any]) -> Plot:
    """How often it came true against the probability that was told; and the share of truths within the intervals."""
    figure = new_figure(11, 3.4)
    axes = figure.subplots(1, 3)
    titles = {"probability": "chosen pose is the nearer, in %", "detection": "what is reported is the dock, in %"}
    for panel, (key, title) in zip(axes, titles.items(), strict=False):
        rows = [row for row in summary["calibration"][key] if row["came"]["count"]]
        for place, row in enumerate(rows):
            _upright(panel, row["came"], place, BLUE, "o", "came true, with 95 % interval" if not place else None)
            told = 100 * row["told"]
            panel.plot([place], [told], "x", color=VERMILLION, label="told, on average" if not place else None)
        names = [f"{row['bin']}\n({row['came']['count']})" for row in rows]
        panel.set_xticks(range(len(rows)), names, fontsize=6, rotation=30)
        panel.set_xlabel(f"{key} that was told (cases)", fontsize=8)
        panel.set_title(title, fontsize=9)
    panel = axes[2]
    for number, (name, shares) in enumerate(summary["coverage"].items()):
        words = {"all": "all poses of the dock", "nearer": "where the nearer was chosen"}[name]
        for place, share in enumerate(shares.values()):
            colour, mark = ((BLUE, "o"), (GREEN, "s"))[number]
            _upright(panel, share, place + 0.2 * (number - 0.5), colour, mark, words if not place else None)
    panel.axhline(95, color="black", linewidth=0.8, linestyle="--")
    panel.set_xticks(range(len(INTERVALS)), INTERVALS)
    panel.set_title("truths within the 95 % interval, in %", fontsize=9)
    for panel in axes:
        panel.set_ylim(0, 103)
        panel.tick_params(axis="y", labelsize=7)
        if panel.get_legend_handles_labels()[0]:
            panel.legend(fontsize=7, loc="lower right")
    figure.tight_layout()
    return Plot.of("calibration", f"Whether the probabilities and intervals of {METHODS[PRODUCT].title} hold.", figure)


def cost_plot(cost: Mapping[str, Mapping[int, float]]) -> Plot:
    """Median time of a picture by its width; ``cost`` has milliseconds by method and width."""
    figure = new_figure(7.5, 3.4)
    axes = figure.subplots()
    for label, by_width in cost.items():
        colour, mark = _LOOKS[label]
        line = "-" if label in (HATS, *RIVALS) else ":"
        axes.plot(list(by_width), list(by_width.values()), line, marker=mark, color=colour, label=METHODS[label].title)
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.yaxis.set_major_formatter("{x:g}")
    axes.yaxis.set_minor_formatter("{x:g}")
    widths = sorted({width for by_width in cost.values() for width in by_width})
    axes.set_xticks(widths, [str(width) for width in widths])
    axes.set_xticks([], minor=True)
    axes.set_xlabel("picture's width in pixels")
    axes.set_ylabel("median time in ms")
    axes.legend(fontsize=7, loc="center left", bbox_to_anchor=(1.02, 0.5), frameon=False)
    figure.tight_layout()
    return Plot.of("cost", "Time from picture to pose on this machine, one core, other work beside it.", figure)


def _overall(axes: Axes, summary: Mapping[str, Any]) -> None:
    for place, rival in enumerate(RIVALS):
        _upright(axes, summary["against"][HATS][rival], place, *_LOOKS[rival], None)
    names = [METHODS[rival].title for rival in RIVALS]
    axes.set_xticks(range(len(RIVALS)), names, rotation=35, ha="right", fontsize=6)
    axes.set_title("all scenes with a dock", fontsize=8)


def _line(axes: Axes, places: Sequence[float], shares: Sequence[Mapping[str, Any]], label: str, scale: float) -> None:
    """A method's values against the bins, with their intervals; bins without any are left out."""
    known = [(place, share) for place, share in zip(places, shares, strict=True) if share["value"] is not None]
    colour, mark = _LOOKS[label]
    values = [scale * share["value"] for _, share in known]
    axes.plot(
        *([place for place, _ in known], values), marker=mark, color=colour, ms=3.5, lw=1, label=METHODS[label].title
    )
    sure = [(place, share) for place, share in known if share["low"] is not None]
    lows, highs = ([scale * share[end] for _, share in sure] for end in ("low", "high"))
    axes.vlines([place for place, _ in sure], lows, highs, color=colour, lw=0.7)


def _bar(axes: Axes, share: Mapping[str, Any], place: float, colour: str, mark: str) -> None:
    if share["value"] is not None:
        axes.plot([100 * share["low"], 100 * share["high"]], [place, place], color=colour)
        axes.plot([100 * share["value"]], [place], mark, color=colour)


def _upright(axes: Axes, share: Mapping[str, Any], place: float, colour: str, mark: str, label: str | None) -> None:
    if share["value"] is not None:
        axes.plot([place, place], [100 * share["low"], 100 * share["high"]], color=colour)
        axes.plot([place], [100 * share["value"]], mark, color=colour, label=label)
