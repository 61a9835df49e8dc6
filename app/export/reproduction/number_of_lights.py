"""Figure 17 of the paper: the pose's error against the number of lights."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.reproduction.part import NumberTable, Part, Plot
from dockpose.paper import light_numbers
from dockpose.paper.light_numbers import RING_OF, WHO, Errors, errors_with
from dockpose.pose.pnp import NAMES

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COUNTS = (4, 5, 6, 7, 8, 10, 12, 16, 20, 24)
_WORDS = {"ellipse": "ellipse only", **NAMES, "ours": "ours, with spacing"}
_STYLES = {
    "ellipse": (ORANGE, "^", "--"),
    "epnp": (VERMILLION, "s", "-"),
    "ippe": (PURPLE, "D", ":"),
    "sqpnp": (GREEN, "x", "-"),
    "iterative": (SKY_BLUE, "+", "--"),
    "ours": (BLUE, "o", "-"),
}
_SHARES = {"median": 0.5, "90 %": 0.9}
Results = dict[tuple[int, int], Errors]


def figure_17(seed: int) -> Part:
    """Make Figure 17."""
    cells = [(count, count) for count in COUNTS] + [(count, RING_OF) for count in COUNTS if count < RING_OF]
    results = {(seen, lights): errors_with(seen, lights, seed) for seen, lights in cells}
    return part_of(results)


def part_of(results: Results) -> Part:
    """The part for errors by the number of lights that are seen, and that the ring has."""
    return Part(
        key="figure_17",
        title="Figure 17: the pose's error against the number of lights",
        paper=(
            "Figure 17 shows the error of the pose against the number of detected lights, for the paper's method by "
            "the ellipse and for EPnP, which has to know which light is which. We do not have the figure's numbers."
        ),
        ours=_ours(results),
        differs=_differs(results),
        plots=[
            Plot.of(
                "figure_17",
                f"Median, and what 90 % of the poses stay below, over {_trials(results)} random poses for each number "
                "of lights. SQPnP, iterative PnP and ours lie on each other nearly everywhere.",
                _figure(results),
            )
        ],
        tables=[*_tables(results), _curves(results)],
    )


def _trials(results: Results) -> int:
    return len(next(iter(results.values())).position["ours"])


def _quantile(values: np.ndarray, share: float) -> float:
    """Without interpolation, so that missing poses, which are infinite, do no harm."""
    return float(np.quantile(values, share, method="inverted_cdf"))


def _ours(results: Results) -> str:
    (near, far), most = light_numbers.RANGE_M, light_numbers.TILT_DEG
    first, last = COUNTS[0], COUNTS[-1]

    def errors(who: str, seen: int, lights: int) -> str:
        one = results[seen, lights]
        return f"{_quantile(one.position[who], 0.5):.2f} % and {_quantile(one.angle_deg[who], 0.5):.2f} degrees"

    return (
        f"Projected lights of a {100 * light_numbers.DIAMETER_M:.0f} cm ring with {light_numbers.NOISE_PX} px of "
        f"noise in x and y, {near:g} to {far:g} m away, tilted by up to {most:g} degrees, seen by a camera of "
        f"{light_numbers.CAMERA.fx:.0f} px. Median errors of position and normal, ours: "
        f"{errors('ours', first, first)} for a complete ring of {first}, {errors('ours', 10, 10)} for 10, "
        f"{errors('ours', last, last)} for {last}. With 10 lights the ellipse alone has {errors('ellipse', 10, 10)}, "
        f"EPnP {errors('epnp', 10, 10)}, IPPE {errors('ippe', 10, 10)}, SQPnP {errors('sqpnp', 10, 10)}, iterative "
        f"PnP {errors('iterative', 10, 10)}. Where only {first} of {RING_OF} lights are seen, ours has "
        f"{errors('ours', first, RING_OF)}, iterative PnP {errors('iterative', first, RING_OF)}, EPnP "
        f"{errors('epnp', first, RING_OF)}."
    )


def _differs(results: Results) -> str:
    def wrong(who: str, seen: int, lights: int) -> str:
        return f"{100 * results[seen, lights].wrong(who):.0f} %"

    ten = results[10, 10]
    ratio = _quantile(ten.angle_deg["ellipse"], 0.5) / _quantile(ten.angle_deg["ours"], 0.5)
    return (
        "Ours is given no numbers of the lights, only their spacing, and is as exact as methods that are given them "
        "wherever it tells the lights right: all of SQPnP, iterative PnP and ours minimise an error of all lights over "
        f"the same six parameters. The ellipse alone ignores where along it the lights stand; its angle is {ratio:.1f} "
        "times worse with 10 lights, it needs 5 lights, and it cannot choose between its two poses, so that the better "
        "one is counted here. The spacing decides less well where few of many lights are seen: off by more than 10 "
        f"degrees are, with 5 of {RING_OF} lights, {wrong('ours', 5, RING_OF)} of ours and "
        f"{wrong('iterative', 5, RING_OF)} of iterative PnP; with 6 lights {wrong('ours', 6, RING_OF)} and "
        f"{wrong('iterative', 6, RING_OF)}. EPnP is worse than all others on a flat, symmetric ring, and off by more "
        f"than 10 degrees with 10 of 10 lights in {wrong('epnp', 10, 10)} and with 12 of 12 in {wrong('epnp', 12, 12)} "
        "of the poses. That is OpenCV's EPnP, run in three frames of the model because it is degenerate in some; the "
        "paper's may be another. The paper's errors are of pictures, ours here of projected lights with noise."
    )


def _tables(results: Results) -> list[NumberTable]:
    def table(name: str, caption: str, cell: Callable[[Errors, str], float]) -> NumberTable:
        rows = []
        for (seen, lights), errors in results.items():
            missing = {who: np.isinf(errors.position[who]).all() for who in WHO}
            cells = [None if missing[who] else cell(errors, who) for who in WHO]
            rows.append([f"{seen} of {lights}", *cells])
        return NumberTable(name, caption, ["lights seen", *_WORDS.values()], rows, digits=2)

    return [
        table(
            "figure_17_position",
            "Median error of the position in per cent of the range.",
            lambda errors, who: _quantile(errors.position[who], 0.5),
        ),
        table(
            "figure_17_angle",
            "Median error of the normal in degrees.",
            lambda errors, who: _quantile(errors.angle_deg[who], 0.5),
        ),
        table(
            "figure_17_wrong",
            "Poses whose normal is off by more than 10 degrees, in per cent.",
            lambda errors, who: 100 * errors.wrong(who),
        ),
    ]


def _curves(results: Results) -> NumberTable:
    head = ["lights seen", "lights of the ring", "method", "what", "median", "90 %"]
    rows: list[list[str | int | float | None]] = []
    for (seen, lights), errors in results.items():
        for who in WHO:
            for what, values in (("position (%)", errors.position[who]), ("angle (deg)", errors.angle_deg[who])):
                both = [_quantile(values, share) for share in _SHARES.values()]
                finite = [value if np.isfinite(value) else None for value in both]
                rows.append([seen, lights, _WORDS[who], what, *finite])
    return NumberTable("figure_17_curves", "The points of the figure.", head, rows, is_shown=False)


def _figure(results: Results) -> Figure:
    figure = new_figure(8.0, 9.0)
    figure.set_layout_engine("constrained")
    grid = figure.subplots(4, 2, sharex="col", sharey="row")
    for column, title in enumerate(("complete ring", f"some lights of a ring of {RING_OF}")):
        grid[0, column].set_title(title, fontsize=9)
        grid[3, column].set_xlabel("number of lights seen")
        cells = [
            (seen, lights) for seen, lights in results if (seen == lights) == (column == 0) or seen == RING_OF == lights
        ]
        for row, (what, share) in enumerate((what, share) for what in ("position", "angle_deg") for share in _SHARES):
            _draw(grid[row, column], results, cells, what, _SHARES[share])
            name = "position (% of range)" if what == "position" else "normal (°)"
            if column == 0:
                grid[row, 0].set_ylabel(f"{name}\n{share}")
    figure.legend(
        *grid[0, 0].get_legend_handles_labels(), loc="outside upper center", ncols=6, fontsize=8, frameon=False
    )
    return figure


def _draw(axes: Axes, results: Results, cells: list[tuple[int, int]], what: str, share: float) -> None:
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

    cells = sorted(cells)
    for who in WHO:
        values = np.array([_quantile(getattr(results[cell], what)[who], share) for cell in cells])
        values[~np.isfinite(values)] = np.nan
        colour, mark, dash = _STYLES[who]
        axes.plot([seen for seen, _ in cells], values, dash, marker=mark, color=colour, ms=4, lw=1, label=_WORDS[who])
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.grid(lw=0.4, color="0.85")
    axes.set_xticks([seen for seen, _ in cells])
