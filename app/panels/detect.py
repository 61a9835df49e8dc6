"""How lights are told from water: the threshold method, its level, and the histogram it was read from."""

from __future__ import annotations

import math
from html import escape

import numpy as np
import viser
from viser import uplot

from app.panels import Change, on_change
from app.reading import Reading
from app.state import MAX_AREA_PX, View, with_level, with_method, with_min_area
from pipeline import Estimate
from pipeline.thresholds import LEVELS, METHODS, Threshold

THRESHOLD_COLOUR = "#D55E00"
_METHOD_NAMES = {"hats": "HATS (adaptive)", "fixed": "Fixed level"}
_BARS_COLOUR = "#7f8fa6"
_SMALL = "padding: 0 0.75em 0.5em; font-size: 0.8em; line-height: 1.35"
_HISTOGRAM_HEIGHT_PX = 125


def method_label(method: str) -> str:
    """What a threshold method is called on the page."""
    return _METHOD_NAMES.get(method, method.capitalize())


def histogram_data(threshold: Threshold) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Grey levels, log10(1 + pixels) of each, and a spike at the threshold; three arrays of one length.

    The chart draws every series over the same levels, so the spike needs two levels of its own beside the threshold.
    Elsewhere it runs below the chart, out of sight.
    """
    beside = [threshold.level - 0.01, threshold.level + 0.01]
    levels = np.sort(np.concatenate([np.arange(LEVELS + 1), beside]))
    counts = np.interp(levels, np.arange(LEVELS + 1), np.append(np.log10(1 + threshold.histogram), 0))
    spike = np.where(levels == threshold.level, histogram_top(threshold), -1.0)
    return levels, counts, spike


def histogram_top(threshold: Threshold) -> float:
    """Where the chart's vertical axis ends: a whole power of ten, so that it seldom moves."""
    return math.ceil(math.log10(1 + int(threshold.histogram.max())) + 0.1)


def threshold_sentence(found: Estimate) -> str:
    """The level in use, how many groups it keeps, and why this level."""
    threshold, markers = found.threshold, found.markers
    if threshold is None:
        return "No threshold was reached."
    kept = "" if markers is None else f", which keeps {len(markers)} group{'s' if len(markers) != 1 else ''} of pixels"
    level = "above 255" if threshold.level >= LEVELS else str(threshold.level)
    return f"Threshold (orange line): level {level}{kept}. {threshold.reason}"


class DetectPanel:
    """Method, level, smallest group, and the histogram with the threshold marked."""

    def __init__(self, gui: viser.GuiApi, change: Change) -> None:
        self._labels = {method_label(method): method for method in METHODS}
        with gui.add_folder("Finding the lights"):
            self._method = gui.add_dropdown(
                "Threshold by",
                tuple(self._labels),
                hint="HATS finds the level from the picture's own histogram. Fixed level: you set it.",
            )
            self._level = gui.add_slider(
                "Level (0-255)",
                min=0,
                max=LEVELS - 1,
                step=1,
                initial_value=0,
                hint="Pixels at least this bright count as light. Yours to set under Fixed level; else it was found.",
            )
            self._min_area = gui.add_slider(
                "Min. area (px)",
                min=1,
                max=100,
                step=1,
                initial_value=1,
                hint="Groups of fewer bright pixels than this are taken for noise.",
            )
            self._chart = _add_chart(gui)
            self._sentence = gui.add_html("")
        on_change(self._method, change, self._with_method)
        on_change(self._level, change, self._with_level)
        on_change(self._min_area, change, lambda view: with_min_area(view, self._min_area.value))

    def load(self, view: View) -> None:
        """Set the controls."""
        self._method.value = method_label(view.settings.method)
        self._level.disabled = view.settings.method != "fixed"
        self._level.value = view.settings.level
        self._min_area.max = min(MAX_AREA_PX, max(100, view.settings.min_area_px))
        self._min_area.value = view.settings.min_area_px

    def show(self, reading: Reading) -> None:
        """Draw the histogram; let the level's slider follow a level that was found."""
        threshold = reading.estimate.threshold
        self._sentence.content = f'<div style="{_SMALL}">{escape(threshold_sentence(reading.estimate))}</div>'
        if threshold is None:
            return
        self._chart.scales = _scales(histogram_top(threshold))
        self._chart.data = histogram_data(threshold)
        if self._level.disabled and reading.view.settings.method != "fixed":
            self._level.value = min(threshold.level, LEVELS - 1)

    def _with_method(self, view: View) -> View:
        """Under "fixed" the level starts where the method before it left it."""
        method = self._labels.get(self._method.value, self._method.value)
        self._level.disabled = method != "fixed"
        return with_method(view, method, self._level.value)

    def _with_level(self, view: View) -> View:
        return with_level(view, self._level.value)


def _scales(top: float) -> dict[str, uplot.Scale]:
    return {"x": uplot.Scale(time=False, range=(0.0, float(LEVELS))), "y": uplot.Scale(range=(0.0, top))}


def _axis(label: str, steps: tuple[float, ...]) -> uplot.Axis:
    font, ticks = "11px sans-serif", uplot.Axis_Ticks(width=1, size=4)
    return uplot.Axis(
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


def _add_chart(gui: viser.GuiApi) -> viser.GuiUplotHandle:
    flat = np.zeros(2)
    no_points = uplot.Series_Points(show=False)
    return gui.add_uplot(
        data=(np.array([0.0, 1.0]), flat, flat),
        series=(
            uplot.Series(label="grey level"),
            uplot.Series(
                label="log10(1 + pixels)", stroke=_BARS_COLOUR, fill=f"{_BARS_COLOUR}60", width=1, points=no_points
            ),
            uplot.Series(label="threshold", stroke=THRESHOLD_COLOUR, width=2, points=no_points),
        ),
        scales=_scales(1.0),
        axes=(_axis("grey level (0-255)", (50.0,)), _axis("log10(1 + pixels)", (1.0, 2.0))),
        legend=uplot.Legend(show=False),
        height=_HISTOGRAM_HEIGHT_PX,
        padding=(6, 12, 0, 0),
    )
