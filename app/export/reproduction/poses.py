"""Figure 17, the pose's error against the number of lights; Table 1, which of the two poses an approach ends on."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from dockpose.app.export.parts import Cell, Part, Rows
from dockpose.app.export.reproduction.pictures import canvas, draw_intervals, legend_above
from dockpose.paper import closed_loop, light_numbers
from dockpose.paper.closed_loop import RULES, Course, run_approach
from dockpose.paper.light_numbers import RING_OF, WHO, Errors, errors_with
from dockpose.pose.pnp import NAMES
from dockpose.study.statistics import Share, wilson
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

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
_ERRORS = {"position": ("position (%)", "position (% of range)"), "angle_deg": ("angle (deg)", "normal (°)")}
Results = dict[tuple[int, int], Errors]
APPROACHES = 100
# Of each rule its name, colour and mark.
_RULES = {
    "literal": ("Table 1 by the letter", (VERMILLION, "s-")),
    "eccentricity": ("Table 1 as we read it", (ORANGE, "^-")),
    "tracker": ("tracker", (BLUE, "o-")),
    "frame": ("each frame alone", (GREEN, "x-")),
}
# What is counted, and in which approaches.
_COUNTS: dict[str, Callable[[Course], bool]] = {
    "right in frame 2": lambda course: bool(course.right[1]),
    "right in the last frame": lambda course: bool(course.right[-1]),
    "ends square on": lambda course: course.ends_square_on,
}


def figure_17(seed: int) -> Part:
    """Make Figure 17."""
    cells = [(count, count) for count in COUNTS] + [(count, RING_OF) for count in COUNTS if count < RING_OF]
    return figure_17_part({(seen, lights): errors_with(seen, lights, seed) for seen, lights in cells})


def figure_17_part(results: Results) -> Part:
    """The part for errors by the number of lights that are seen, and that the ring has."""
    return Part.of(
        "figure_17",
        {"main": _error_curves(results)},
        {
            "position": _table(results, lambda errors, who: errors.quantile("position", who)),
            "angle": _table(results, lambda errors, who: errors.quantile("angle_deg", who)),
            "wrong": _table(results, lambda errors, who: 100 * errors.wrong(who)),
            "curves": _curves(results),
        },
        set_up=light_numbers,
        results=results,
        first=COUNTS[0],
        last=COUNTS[-1],
        trials=len(results[10, 10].position["ours"]),
    )


def _table(results: Results, cell: Callable[[Errors, str], float]) -> Rows:
    rows: list[list[Cell]] = [["lights seen", *_WORDS.values()]]
    for (seen, lights), errors in results.items():
        cells = [None if np.isinf(errors.position[who]).all() else cell(errors, who) for who in WHO]
        rows.append([f"{seen} of {lights}", *cells])
    return rows


def _curves(results: Results) -> Rows:
    rows: list[list[Cell]] = []
    for (seen, lights), errors in results.items():
        for who in WHO:
            for what, (name, _) in _ERRORS.items():
                both = [errors.quantile(what, who, share) for share in _SHARES.values()]
                finite = [value if np.isfinite(value) else None for value in both]
                rows.append([seen, lights, _WORDS[who], name, *finite])
    return rows


def _error_curves(results: Results) -> Figure:
    figure = canvas(8.0, 9.0)
    grid = figure.subplots(4, 2, sharex="col", sharey="row")
    rings = {
        "complete ring": [cell for cell in results if cell[0] == cell[1]],
        f"some lights of a ring of {RING_OF}": sorted(cell for cell in results if cell[1] == RING_OF),
    }
    for column, (title, cells) in enumerate(rings.items()):
        grid[0, column].set_title(title, fontsize=9)
        grid[3, column].set_xlabel("number of lights seen")
        for row, (what, share) in enumerate((what, share) for what in _ERRORS for share in _SHARES):
            _draw(grid[row, column], results, cells, what, _SHARES[share])
            grid[row, 0].set_ylabel(f"{_ERRORS[what][1]}\n{share}")
    legend_above(figure, grid[0, 0], ncols=6, fontsize=8)
    return figure


def _draw(axes: Axes, results: Results, cells: list[tuple[int, int]], what: str, share: float) -> None:
    for who in WHO:
        values = np.array([results[cell].quantile(what, who, share) for cell in cells])
        values[~np.isfinite(values)] = np.nan
        colour, mark, dash = _STYLES[who]
        axes.plot([seen for seen, _ in cells], values, dash, marker=mark, color=colour, ms=4, lw=1, label=_WORDS[who])
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.grid(lw=0.4, color="0.85")
    axes.set_xticks([seen for seen, _ in cells])


def table_1(seed: int) -> Part:
    """Make Table 1 in closed loop."""
    return table_1_part({rule: [run_approach(seed, number, rule) for number in range(APPROACHES)] for rule in RULES})


def table_1_part(courses: dict[str, list[Course]]) -> Part:
    """The part for approaches that were run by each of ``RULES``."""
    number = len(courses[RULES[0]])
    shares = {
        rule: {what: wilson(sum(map(is_so, ran)), number) for what, is_so in _COUNTS.items()}
        for rule, ran in courses.items()
    }
    return Part.of(
        "table_1",
        {"frames": _shares_by_frame(courses)},
        {"main": _counts(shares, number), **{rule: _approaches(ran) for rule, ran in courses.items()}},
        number=number,
        set_up=closed_loop,
        names={rule: name for rule, (name, _) in _RULES.items()},
        shares=shares,
        lost={rule: sum(bool(c.right[1]) and not c.right[-1] for c in ran) for rule, ran in courses.items()},
        wrong={rule: sum(int((~course.right).sum()) for course in ran) for rule, ran in courses.items()},
    )


def _counts(shares: dict[str, dict[str, Share]], number: int) -> Rows:
    heads = ((f"{what} (of {number})", f"{what} (95 % interval in %)") for what in _COUNTS)
    rows: list[list[Cell]] = [["rule", *itertools.chain(*heads)]]
    for rule, of in shares.items():
        cells = ((one.hits, f"{100 * one.low:.1f} to {100 * one.high:.1f}") for one in of.values())
        rows.append([_RULES[rule][0], *itertools.chain(*cells)])
    return rows


def _approaches(courses: Sequence[Course]) -> Rows:
    head = ["approach", "range (m)", "tilt (deg)", "off the axis at the end (deg)"]
    return [
        [*head, *(f"right in frame {frame + 1}" for frame in range(len(courses[0].right)))],
        *(
            [number, course.range_m, course.tilt_deg, float(course.off_axis_deg[-1]), *map(int, course.right)]
            for number, course in enumerate(courses, start=1)
        ),
    ]


def _shares_by_frame(courses: dict[str, list[Course]]) -> Figure:
    figure = canvas(6.5, 3.2)
    axes = figure.add_subplot()
    numbers = 1 + np.arange(len(courses[RULES[0]][0].right))
    for place, (rule, ran) in enumerate(courses.items()):
        words, looks = _RULES[rule]
        right = np.sum([course.right for course in ran], axis=0)
        shares = [vars(wilson(int(count), len(ran))) for count in right]
        draw_intervals(axes, numbers + 0.12 * (place - (len(courses) - 1) / 2), shares, looks, label=words)
    axes.set(xticks=numbers, xlabel="frame", ylabel="chosen pose is right (%)", ylim=(0, 104))
    axes.grid(axis="y", lw=0.4, color="0.85")
    legend_above(figure, axes, ncols=4, fontsize=8)
    return figure
