"""Table 1 of the paper: which of the two poses an approach ends on."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, VERMILLION
from dockpose.app.export.parts import Cell, Part, Rows
from dockpose.app.export.reproduction.pictures import canvas, draw_intervals, legend_above
from dockpose.paper import closed_loop
from dockpose.paper.closed_loop import RULES, Course, run_approach
from dockpose.study.statistics import Share, wilson
from matplotlib.figure import Figure

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


def table_1(seed: int) -> Part:
    """Make Table 1 in closed loop."""
    return part_of({rule: [run_approach(seed, number, rule) for number in range(APPROACHES)] for rule in RULES})


def part_of(courses: dict[str, list[Course]]) -> Part:
    """The part for approaches that were run by each of ``RULES``."""
    number = len(courses[RULES[0]])
    shares = {
        rule: {what: wilson(sum(map(is_so, ran)), number) for what, is_so in _COUNTS.items()}
        for rule, ran in courses.items()
    }
    return Part.of(
        "table_1",
        {"frames": _figure(courses)},
        {"main": _rows(shares, number), **{rule: _approaches(ran) for rule, ran in courses.items()}},
        number=number,
        set_up=closed_loop,
        names={rule: name for rule, (name, _) in _RULES.items()},
        shares=shares,
        lost={rule: sum(bool(c.right[1]) and not c.right[-1] for c in ran) for rule, ran in courses.items()},
        wrong={rule: sum(int((~course.right).sum()) for course in ran) for rule, ran in courses.items()},
    )


def _rows(shares: dict[str, dict[str, Share]], number: int) -> Rows:
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


def _figure(courses: dict[str, list[Course]]) -> Figure:
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
