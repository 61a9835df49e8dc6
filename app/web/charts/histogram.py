"""The chart in the Detect panel: the histogram, the threshold, the peaks, and how many groups each level leaves."""

from __future__ import annotations

import math

import numpy as np
import viser
from dockpose.thresholds import LEVELS, Peak, Threshold
from viser import uplot

THRESHOLD_COLOUR = "#D55E00"
PEAKS_COLOUR = "#CC79A7"
GROUPS_COLOUR = "#0072B2"
_BARS_COLOUR = "#7f8fa6"
_HEIGHT_PX = 165
_BELOW = -1.0  # out of sight below the chart: a gap would need NaN, which blanks the whole chart
_BESIDE = 0.01  # levels; how wide the threshold's line is drawn
_LEAST_GROUPS = 10
_APART = 16  # levels; in a panel of 380 px that is as wide as three digits
# Sides of the chart that are no plot: the box's margin, and the axis with its label.
_BEFORE_PX, _AFTER_PX = 10 + 40, 10 + 40
_PEAKS_LINE = (
    f"position: relative; height: 1.3em; margin: 0 {_AFTER_PX}px -0.2em {_BEFORE_PX}px; font-size: 0.75em; "
    "font-weight: 600; white-space: nowrap"
)


def histogram_data(threshold: Threshold) -> tuple[np.ndarray, ...]:
    """Grey levels, and over each of them the four curves of the chart; five arrays of one length.

    They are log10(1 + pixels), a spike at the threshold, points at the peaks, and the number of groups. The chart draws
    every series over the same levels, so the spike needs two levels of its own beside the threshold. Elsewhere it runs
    below the chart, out of sight, as do peaks and groups where there are none or they were not counted.
    """
    beside = [threshold.level - _BESIDE, threshold.level + _BESIDE]
    levels = np.sort(np.concatenate([np.arange(LEVELS + 1), beside]))
    counts = np.interp(levels, np.arange(LEVELS + 1), np.append(np.log10(1 + threshold.histogram), 0))
    spike = np.where(levels == threshold.level, histogram_top(threshold), _BELOW)
    peaks = np.where(np.isin(levels, [peak.level for peak in threshold.peaks]), counts, _BELOW)
    steps = np.append(threshold.groups_at_level, -1)[np.clip(np.floor(levels + _BESIDE), 0, LEVELS).astype(int)]
    return levels, counts, spike, peaks, np.where(steps < 0, _BELOW * groups_top(threshold), steps)


def labelled_peaks(threshold: Threshold) -> list[Peak]:
    """The peaks whose number of groups is written over the chart, bright to dark.

    Where several are closer to each other than a number is wide, the one that holds over most levels has it.
    """
    chosen: list[Peak] = []
    for peak in sorted(threshold.peaks, key=lambda one: (one.votes, one.level), reverse=True):
        if all(abs(peak.level - other.level) >= _APART for other in chosen):
            chosen.append(peak)
    return sorted(chosen, key=lambda one: one.level, reverse=True)


def peaks_html(threshold: Threshold) -> str:
    """A line over the chart: at each of :func:`labelled_peaks` the number of groups that it votes for."""
    labels = "".join(
        f'<span data-peak="{peak.level}" title="peak at level {peak.level}: votes for {peak.groups} groups" '
        f'style="position: absolute; transform: translateX(-50%); left: {100 * peak.level / LEVELS:.2f}%">'
        f"{peak.groups}</span>"
        for peak in labelled_peaks(threshold)
    )
    words = '<span style="position: absolute; left: -40px; opacity: 0.75">votes</span>' if labels else ""
    return f'<div id="peaks" style="{_PEAKS_LINE}">{words}{labels}</div>'


def histogram_top(threshold: Threshold) -> float:
    """Where the left axis ends: a whole power of ten, so that it seldom moves."""
    return math.ceil(math.log10(1 + int(threshold.histogram.max())) + 0.1)


def groups_top(threshold: Threshold) -> int:
    """Where the right axis ends: twice the groups at the threshold, in tens; far more at low levels is noise."""
    at_level = int(threshold.groups_at_level[threshold.level]) if threshold.level < LEVELS else 0
    return max(_LEAST_GROUPS, 10 * math.ceil(2 * at_level / 10))


class HistogramChart:
    """Draws thresholds in the Detect panel."""

    def __init__(self, gui: viser.GuiApi) -> None:
        self._tops = (1.0, _LEAST_GROUPS)
        self._peaks = gui.add_html("")
        flat = np.zeros(2)
        no_points = uplot.Series_Points(show=False)
        self._chart = gui.add_uplot(
            data=(np.array([0.0, 1.0]), flat, flat, flat, flat),
            series=(
                uplot.Series(label="grey level"),
                uplot.Series(
                    label="log10(1 + pixels)", stroke=_BARS_COLOUR, fill=f"{_BARS_COLOUR}60", width=1, points=no_points
                ),
                uplot.Series(label="threshold", stroke=THRESHOLD_COLOUR, width=2, points=no_points),
                uplot.Series(
                    label="peaks",
                    stroke="transparent",
                    width=0,
                    points=uplot.Series_Points(show=True, size=7, fill=PEAKS_COLOUR, stroke=PEAKS_COLOUR),
                ),
                uplot.Series(
                    label="groups", stroke=GROUPS_COLOUR, width=1.5, dash=(5.0, 3.0), points=no_points, scale="groups"
                ),
            ),
            scales=_scales(1.0, _LEAST_GROUPS),
            axes=(
                _axis("grey level (0-255)", (50.0,)),
                _axis("log10(1 + pixels)", (1.0, 2.0)),
                _axis("groups (number)", (5.0, 10.0, 20.0, 50.0, 100.0, 200.0), scale="groups", side=1),
            ),
            legend=uplot.Legend(show=False),
            height=_HEIGHT_PX,
            padding=(6, 2, 0, 0),
        )

    def show(self, threshold: Threshold) -> None:
        """Draw a threshold and what it was read from."""
        tops = histogram_top(threshold), groups_top(threshold)
        if tops != self._tops:  # with new scales the browser builds the whole chart anew
            self._chart.scales, self._tops = _scales(*tops), tops
        self._chart.data = histogram_data(threshold)
        self._peaks.content = peaks_html(threshold)


def _scales(top: float, groups: float) -> dict[str, uplot.Scale]:
    return {
        "x": uplot.Scale(time=False, range=(0.0, float(LEVELS))),
        "y": uplot.Scale(range=(0.0, top)),
        "groups": uplot.Scale(range=(0.0, float(groups))),
    }


def _axis(label: str, steps: tuple[float, ...], scale: str | None = None, side: int | None = None) -> uplot.Axis:
    font, ticks = "11px sans-serif", uplot.Axis_Ticks(width=1, size=4)
    axis = uplot.Axis(
        incrs=steps,
        space=20,
        label=label,
        labelSize=16,
        size=24,
        gap=2,
        font=font,
        labelFont=font,
        ticks=ticks,
    )
    if scale is not None and side is not None:
        axis["scale"] = scale
        axis["side"] = side  # pyright: ignore[reportGeneralTypeIssues]
        axis["grid"] = uplot.Axis_Grid(show=False)
    return axis
