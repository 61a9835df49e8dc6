"""The chart in the Detect panel: the histogram, the threshold, the peaks, and how many groups each level leaves."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import viser
from dockpose.app.drawing.colours import BARS_COLOUR, GROUPS_COLOUR, PEAKS_COLOUR, THRESHOLD_COLOUR
from dockpose.app.web.charts.chart import Chart, Curve, axis
from dockpose.thresholds import LEVELS, Peak, Threshold
from viser import uplot

_HEIGHT_PX = 165
_BESIDE = 0.01  # levels; width of the threshold's line
_LEAST_GROUPS = 10
_APART = 16  # levels; as wide as three digits in a panel of 380 px
_AXIS_PX, _LABEL_PX = 24, 16
_BESIDE_PX = 10 + _AXIS_PX + _LABEL_PX  # from the panel's edge to the plot, on both sides
_PEAKS_LINE = (
    f"position: relative; height: 1.3em; margin: 0 {_BESIDE_PX}px -0.2em {_BESIDE_PX}px; font-size: 0.75em; "
    "font-weight: 600; white-space: nowrap"
)


def histogram_data(threshold: Threshold) -> tuple[np.ndarray, ...]:
    """Return grey levels, and over each of them the four curves of the chart; five arrays of one length.

    They are log10(1 + pixels), a spike at the threshold, points at the peaks, and the number of groups; NaN where there
    is no peak, or where groups were not counted. All series share the levels, so the spike needs two levels of its own
    beside the threshold.
    """
    beside = [threshold.level - _BESIDE, threshold.level + _BESIDE]
    levels = np.sort(np.concatenate([np.arange(LEVELS + 1), beside]))
    counts = np.interp(levels, np.arange(LEVELS + 1), np.append(np.log10(1 + threshold.histogram), 0))
    spike = np.where(levels == threshold.level, histogram_top(threshold), np.nan)
    peaks = np.where(np.isin(levels, [peak.level for peak in threshold.peaks]), counts, np.nan)
    groups = np.append(threshold.groups_at_level, -1)[np.clip(np.floor(levels + _BESIDE), 0, LEVELS).astype(int)]
    return levels, counts, spike, peaks, np.where(groups < 0, np.nan, groups)


def labelled_peaks(threshold: Threshold) -> list[Peak]:
    """Return the peaks whose number of groups is written over the chart, bright to dark.

    Of peaks closer together than a number is wide, the one that holds over most levels is labelled.
    """
    chosen: list[Peak] = []
    for peak in sorted(threshold.peaks, key=lambda one: (one.votes, one.level), reverse=True):
        if all(abs(peak.level - other.level) >= _APART for other in chosen):
            chosen.append(peak)
    return sorted(chosen, key=lambda one: one.level, reverse=True)


def peaks_html(threshold: Threshold) -> str:
    """Return a line over the chart with the number of groups that each of :func:`labelled_peaks` votes for."""
    labels = "".join(
        f'<span data-peak="{peak.level}" title="peak at level {peak.level}: votes for {peak.groups} groups" '
        f'style="position: absolute; transform: translateX(-50%); left: {100 * peak.level / LEVELS:.2f}%">'
        f"{peak.groups}</span>"
        for peak in labelled_peaks(threshold)
    )
    words = '<span style="position: absolute; left: -40px; opacity: 0.75">votes</span>' if labels else ""
    return f'<div id="peaks" style="{_PEAKS_LINE}">{words}{labels}</div>'


def histogram_top(threshold: Threshold) -> float:
    """Return the end of the left axis: a whole power of ten, so that it seldom moves."""
    return math.ceil(math.log10(1 + int(threshold.histogram.max())) + 0.1)


def groups_top(threshold: Threshold) -> int:
    """Return the end of the right axis: twice the groups at the threshold, in tens; far more at low levels is noise."""
    at_level = int(threshold.groups_at_level[threshold.level]) if threshold.level < LEVELS else 0
    return max(_LEAST_GROUPS, 10 * math.ceil(2 * at_level / 10))


class HistogramChart:
    """Draws thresholds in the Detect panel."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._peaks = gui.add_html("")
        curves = (
            Curve("log10(1 + pixels)", BARS_COLOUR, width=1, fill=f"{BARS_COLOUR}60"),
            Curve("threshold", THRESHOLD_COLOUR),
            Curve("peaks", PEAKS_COLOUR, marks_px=7),
            Curve("groups", GROUPS_COLOUR, dash=(5.0, 3.0), width=1.5, scale="groups"),
        )
        group_steps, right = (5.0, 10.0, 20.0, 50.0, 100.0, 200.0), {"side": 1, "scale": "groups"}
        axes = (
            _axis("grey level (0-255)", (50.0,)),
            _axis("log10(1 + pixels)", (1.0, 2.0)),
            _axis("groups (number)", group_steps, grid=uplot.Axis_Grid(show=False), **right),
        )
        look: Any = {"legend": False, "visible": True, "padding": (6, 2, 0, 0)}
        self._chart = Chart(gui, "grey level", curves, axes, _HEIGHT_PX, scales=("y", "groups"), **look)

    def show(self, threshold: Threshold) -> None:
        """Draw a threshold and what it was read from."""
        tops = {"y": (0.0, histogram_top(threshold)), "groups": (0.0, float(groups_top(threshold)))}
        self._chart.show(histogram_data(threshold), x=(0.0, float(LEVELS)), **tops)
        self._peaks.content = peaks_html(threshold)


def _axis(label: str, steps: tuple[float, ...], **more: Any) -> uplot.Axis:
    ticks = uplot.Axis_Ticks(width=1, size=4)
    return axis(label, _AXIS_PX, _LABEL_PX, incrs=steps, space=20, gap=2, ticks=ticks, **more)
