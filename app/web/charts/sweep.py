"""The chart of a level sweep: how far three guesses at the dock's centre are off (the paper's Figure 14)."""

import math
import time
from collections.abc import Callable
from html import escape

import numpy as np
import viser
from dockpose.app.drawing.colours import BLUE, ORANGE, VERMILLION
from dockpose.app.processing.comparison import CENTRES, SWEPT_LEVELS, LevelSweep
from dockpose.app.web.charts.chart import Chart, Curve, axis, round_above
from dockpose.app.web.html import small
from dockpose.thresholds import LEVELS

_LOOKS = ((VERMILLION, (8.0, 4.0)), (ORANGE, (2.0, 3.0)), (BLUE, ()))
_HEIGHT_PX = 190
_EVERY_S = 0.2


def sweep_data(sweep: LevelSweep) -> tuple[np.ndarray, ...]:
    """Return levels, and the error of each guess in pixels; NaN where a level shows no dock."""
    return (sweep.levels.astype(float), *sweep.errors_px.T)


def sweep_top_px(sweep: LevelSweep) -> float:
    """Return the end of the vertical axis: a round number with nearly all errors below."""
    known = sweep.errors_px[~np.isnan(sweep.errors_px)]
    return round_above(1.1 * float(np.quantile(known, 0.97)) if len(known) else 1.0)


def sweep_sentence(sweep: LevelSweep) -> str:
    """Say over which levels a dock was found, and the median error of each guess."""
    found = ~np.isnan(sweep.errors_px[:, 0])
    if not found.any():
        return f"No level shows a dock (measured against {sweep.reference})."
    medians = np.median(sweep.errors_px[found], axis=0)
    guesses = "; ".join(f"{name} {error:.2f} px" for name, error in zip(CENTRES, medians, strict=True))
    levels = sweep.levels[found]
    return (
        f"A dock at {len(levels)} of {len(sweep.levels)} levels, from {levels[0]} to {levels[-1]}. Median distance "
        f"from {sweep.reference}: {guesses}."
    )


def swept_so_far(sweep: LevelSweep) -> str:
    """Describe an unfinished sweep."""
    last = f"{sweep.levels[-1]}" if len(sweep.levels) else "none"
    return f"Levels up to {last} of {SWEPT_LEVELS[-1]} are drawn. {sweep_sentence(sweep)}"


class SweepChart:
    """Draws a sweep; hidden until the first. ``clock`` returns seconds."""

    def __init__(self, gui: viser.GuiApi, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock, self._drawn_s = clock, -math.inf
        curves = [Curve(name, colour, dash) for name, (colour, dash) in zip(CENTRES, _LOOKS, strict=True)]
        axes = axis("fixed level (0-255)", 26, 16), axis("centre off by (px)", 34, 16)
        self._chart = Chart(gui, "level", curves, axes, _HEIGHT_PX)
        self._sentence = gui.add_html("")

    def grow(self, sweep: LevelSweep) -> None:
        """Draw what was swept so far, a few times a second."""
        if self._clock() - self._drawn_s >= _EVERY_S or len(sweep.levels) == 1:
            self._draw(sweep, swept_so_far(sweep))
            self._drawn_s = self._clock()

    def show(self, sweep: LevelSweep) -> None:
        """Draw a finished sweep."""
        self._draw(sweep, sweep_sentence(sweep))

    def _draw(self, sweep: LevelSweep, sentence: str) -> None:
        self._chart.show(sweep_data(sweep), x=(0.0, LEVELS - 1.0), y=(0.0, sweep_top_px(sweep)))
        self._sentence.content = small(escape(sentence), 'id="sweep"')
