"""One chart of the page, drawn by uPlot: its fonts, axes, gaps and scales."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import viser
from viser import uplot

Ends = tuple[float, float]
_FONT = "11px sans-serif"


@dataclass(frozen=True)
class Curve:
    """A line of a chart, or a row of marks."""

    label: str  # name in the legend
    colour: str
    dash: tuple[float, ...] = ()  # pixels on and off
    marks_px: float | None = None  # draw rings of this size in place of a line

    def series(self) -> uplot.Series:
        """Return the curve as uPlot has it."""
        if self.marks_px is not None:
            look: Any = {"size": self.marks_px, "stroke": self.colour, "width": 1.5, "fill": "transparent"}
            points = uplot.Series_Points(show=True, **look)
            return uplot.Series(label=self.label, stroke="transparent", width=0, points=points, scale="y")
        look = {"stroke": self.colour, "width": 2.0, "dash": self.dash, "fill": "transparent"}
        return uplot.Series(label=self.label, points=uplot.Series_Points(show=False), scale="y", **look)


def axis(label: str = "", size: int = 32, label_size: int = 14, **more: Any) -> uplot.Axis:
    """Return an axis ``size`` pixels wide with a label; ``more`` are uPlot's own options."""
    named: Any = {"label": label, "labelSize": label_size, "labelFont": _FONT} if label else {}
    return uplot.Axis(font=_FONT, size=size, **named, **more)


class Chart:
    """A chart of curves over one axis."""

    def __init__(
        self, gui: viser.GuiApi, across: str, curves: Sequence[Curve], axes: Sequence[uplot.Axis], height: int
    ) -> None:
        self._ends: dict[str, Ends] = {"x": (0.0, 1.0), "y": (0.0, 1.0)}
        self._handle = gui.add_uplot(
            data=(np.array([0.0, 1.0]), *([np.zeros(2)] * len(curves))),
            series=(uplot.Series(label=across), *(curve.series() for curve in curves)),
            scales=_scales(self._ends),
            axes=tuple(axes),
            legend=uplot.Legend(show=True),
            height=height,
            padding=(10, 8, 0, 0),
            visible=False,  # until its first data
        )

    def show(self, data: Sequence[np.ndarray], **ends: Ends) -> None:
        """Draw the curves."""
        if ends != self._ends:  # with other scales the browser rebuilds the chart
            self._ends = ends
            self._handle.scales = _scales(ends)
        across, *values = data
        twice = 2 if len(across) == 1 else 1  # the browser draws nothing of a single point
        curves = [without_gaps(line, ends["y"]) for line in values]
        self._handle.data = tuple(np.repeat(line, twice) for line in (across, *curves))
        self._handle.visible = True

    def hide(self) -> None:
        """Take the chart away until it is shown again."""
        self._handle.visible = False


def without_gaps(values: np.ndarray, ends: Ends) -> np.ndarray:
    """Replace NaN, which would blank the whole chart, with a number out of sight below the axis."""
    low, high = ends
    return np.where(np.isnan(values), low - (high - low), values)


def fitting_ends(numbers: np.ndarray, least: float) -> Ends:
    """Return ends of an axis around all numbers but NaN, in whole steps, so that they seldom move."""
    known = numbers[~np.isnan(numbers)]
    if len(known) == 0:
        return 0.0, 1.0
    low, high = float(known.min()), float(known.max())
    step = 10.0 ** math.floor(math.log10(max(high - low, least)))
    return step * math.floor(low / step - 0.1), step * math.ceil(high / step + 0.1)


def round_above(number: float) -> float:
    """Return 1, 2 or 5 times a power of ten: the least that is not below ``number``, and at least 1."""
    power = 10.0 ** math.floor(math.log10(max(number, 1.0)))
    return next(step * power for step in (1, 2, 5, 10) if step * power >= number)


def _scales(ends: dict[str, Ends]) -> dict[str, uplot.Scale]:
    return {name: uplot.Scale(time=False, range=pair) for name, pair in ends.items()}
