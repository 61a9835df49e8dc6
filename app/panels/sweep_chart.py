"""The chart of a level sweep: how far the dock's centre is off, by three ways to find it (the paper's Figure 14)."""

from __future__ import annotations

import math

import numpy as np
import viser
from viser import uplot

from app.comparison import CENTRES, Sweep
from app.panels.detect import SMALL

# Okabe and Ito's vermillion, orange and blue; the dashes tell them apart too.
_COLOURS = ("#D55E00", "#E69F00", "#0072B2")
_DASHES = ((8.0, 4.0), (2.0, 3.0), ())
_HEIGHT_PX = 190


def sweep_data(sweep: Sweep) -> tuple[np.ndarray, ...]:
    """Levels, and for each way the error in pixels; below the chart, out of sight, where a level shows no dock."""
    hidden = -sweep_top_px(sweep)
    return (
        sweep.levels.astype(float),
        *(np.where(np.isnan(column), hidden, column) for column in sweep.errors_px.T),
    )


def sweep_top_px(sweep: Sweep) -> float:
    """Where the vertical axis ends: nearly all of the errors are below."""
    known = sweep.errors_px[~np.isnan(sweep.errors_px)]
    return 1.0 if len(known) == 0 else float(max(1, math.ceil(1.1 * np.quantile(known, 0.97))))


def sweep_sentence(sweep: Sweep) -> str:
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


class SweepChart:
    """Draws a sweep; not there before the first."""

    def __init__(self, gui: viser.GuiApi) -> None:
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

    def show(self, sweep: Sweep) -> None:
        """Draw it."""
        self._chart.scales = _scales(sweep_top_px(sweep))
        self._chart.data = sweep_data(sweep)
        self._chart.visible = True
        self._sentence.content = f'<div id="sweep" style="{SMALL}">{sweep_sentence(sweep)}</div>'


def _scales(top: float) -> dict[str, uplot.Scale]:
    return {"x": uplot.Scale(time=False, range=(0.0, 255.0)), "y": uplot.Scale(range=(0.0, top))}
