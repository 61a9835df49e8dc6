"""The chart of a level sweep: how far the dock's centre is off, by three ways to find it (the paper's Figure 14)."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from html import escape

import numpy as np
import viser
from dockpose.app.processing.comparison import CENTRES, SWEPT_LEVELS, LevelSweep
from dockpose.app.web.html import SMALL
from viser import uplot

# Okabe and Ito's vermillion, orange and blue; the dashes tell them apart too.
_COLOURS = ("#D55E00", "#E69F00", "#0072B2")
_DASHES = ((8.0, 4.0), (2.0, 3.0), ())
_HEIGHT_PX = 190
_EVERY_S = 0.2


def sweep_data(sweep: LevelSweep) -> tuple[np.ndarray, ...]:
    """Levels, and for each way the error in pixels; below the chart, out of sight, where a level shows no dock."""
    hidden = -sweep_top_px(sweep)
    return (
        sweep.levels.astype(float),
        *(np.where(np.isnan(column), hidden, column) for column in sweep.errors_px.T),
    )


def sweep_top_px(sweep: LevelSweep) -> float:
    """Where the vertical axis ends: 1, 2 or 5 times a power of ten with nearly all of the errors below.

    It seldom moves while a sweep grows: with another axis the browser builds the chart anew.
    """
    known = sweep.errors_px[~np.isnan(sweep.errors_px)]
    least = 1.0 if len(known) == 0 else max(1.0, 1.1 * float(np.quantile(known, 0.97)))
    power = 10.0 ** math.floor(math.log10(least))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= least)


def sweep_sentence(sweep: LevelSweep) -> str:
    """Over which levels a dock was found, and the middle error of each way."""
    found = ~np.isnan(sweep.errors_px[:, 0])
    if not found.any():
        return f"No level shows a dock (measured against {sweep.reference})."
    medians = np.median(sweep.errors_px[found], axis=0)
    ways = "; ".join(f"{name} {error:.2f} px" for name, error in zip(CENTRES, medians, strict=True))
    levels = sweep.levels[found]
    return (
        f"A dock at {len(levels)} of {len(sweep.levels)} levels, from {levels[0]} to {levels[-1]}. Middle distance "
        f"from {sweep.reference}: {ways}."
    )


def swept_so_far(sweep: LevelSweep) -> str:
    """How far a sweep is that goes on, or was stopped."""
    last = f"{sweep.levels[-1]}" if len(sweep.levels) else "none"
    return f"Levels up to {last} of {SWEPT_LEVELS[-1]} are drawn. {sweep_sentence(sweep)}"


class SweepChart:
    """Draws a sweep; not there before the first.

    Parameters
    ----------
    gui : where to build it.
    clock : gives seconds.
    """

    def __init__(self, gui: viser.GuiApi, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._drawn_s, self._top = clock, -math.inf, 1.0
        flat = np.zeros(2)
        font = "11px sans-serif"
        no_points = uplot.Series_Points(show=False)
        self._chart = gui.add_uplot(
            data=(np.array([0.0, 1.0]), flat, flat, flat),
            series=(
                uplot.Series(label="level"),
                *(
                    uplot.Series(label=name, stroke=colour, dash=dash, width=2, points=no_points)
                    for name, colour, dash in zip(CENTRES, _COLOURS, _DASHES, strict=True)
                ),
            ),
            scales=_scales(1.0),
            axes=(
                uplot.Axis(label="fixed level (0-255)", labelSize=16, size=26, font=font, labelFont=font),
                uplot.Axis(label="centre off by (px)", labelSize=16, size=34, font=font, labelFont=font),
            ),
            legend=uplot.Legend(show=True),
            height=_HEIGHT_PX,
            visible=False,
        )
        self._sentence = gui.add_html("")

    def grow(self, sweep: LevelSweep) -> None:
        """Draw what was swept so far, a few times a second."""
        if self._clock() - self._drawn_s >= _EVERY_S or len(sweep.levels) == 1:
            self._draw(sweep, swept_so_far(sweep))
            self._drawn_s = self._clock()

    def show(self, sweep: LevelSweep) -> None:
        """Draw a sweep to its end."""
        self._draw(sweep, sweep_sentence(sweep))

    def _draw(self, sweep: LevelSweep, sentence: str) -> None:
        top = sweep_top_px(sweep)
        if top != self._top:
            self._chart.scales, self._top = _scales(top), top
        self._chart.data = sweep_data(sweep)
        self._chart.visible = True
        self._sentence.content = f'<div id="sweep" style="{SMALL}">{escape(sentence)}</div>'


def _scales(top: float) -> dict[str, uplot.Scale]:
    return {"x": uplot.Scale(time=False, range=(0.0, 255.0)), "y": uplot.Scale(range=(0.0, top))}
