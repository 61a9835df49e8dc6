"""Table 1 of the paper: which of the two poses an approach ends on."""

import math
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
    "right in the last frame": lambda course: course.ends_right,
    "ends square on": lambda course: course.ends_square_on,
}


def table_1(seed: int) -> Part:
    """Make Table 1 in closed loop."""
    return part_of({rule: [run_approach(seed, number, rule) for number in range(APPROACHES)] for rule in RULES})


def part_of(courses: dict[str, list[Course]]) -> Part:
    """The part for approaches that were run by each of ``RULES``."""
    (near, far), (least, most) = closed_loop.RANGE_M, closed_loop.TILT_DEG
    seconds, ends, square = ("; ".join(_in_words(rule, ran, what) for rule, ran in courses.items()) for what in _COUNTS)
    number = len(courses[RULES[0]])
    return Part.of(
        "table_1",
        {"frames": _figure(courses)},
        {"main": _shares(courses), **{rule: _approaches(ran) for rule, ran in courses.items()}},
        **{"near": near, "far": far, "least": least, "most": most, "number": number},
        diameter_cm=100 * closed_loop.DOCK.diameter,
        dock=closed_loop.DOCK,
        frames=closed_loop.FRAMES,
        all_frames=number * closed_loop.FRAMES,
        square_deg=math.degrees(closed_loop.SQUARE_ON_RAD),
        seconds=seconds,
        ends=ends,
        square=square,
        second={rule: sum(bool(course.right[1]) for course in ran) for rule, ran in courses.items()},
        lost={rule: sum(bool(c.right[1]) and not c.ends_right for c in ran) for rule, ran in courses.items()},
        turned={rule: sum(not course.ends_square_on for course in ran) for rule, ran in courses.items()},
        wrong={rule: sum(int((~course.right).sum()) for course in ran) for rule, ran in courses.items()},
    )


def _share(courses: Sequence[Course], what: str) -> Share:
    return wilson(sum(_COUNTS[what](course) for course in courses), len(courses))


def _in_words(rule: str, courses: Sequence[Course], what: str) -> str:
    share = _share(courses, what)
    return f"{_RULES[rule][0]} {share.hits} of {share.count} ({100 * share.low:.0f} to {100 * share.high:.0f} %)"


def _shares(courses: dict[str, list[Course]]) -> Rows:
    number = len(courses[RULES[0]])
    rows: list[list[Cell]] = [["rule"]]
    for what in _COUNTS:
        rows[0] += [f"{what} (of {number})", f"{what} (95 % interval in %)"]
    for rule, ran in courses.items():
        rows.append([_RULES[rule][0]])
        for what in _COUNTS:
            share = _share(ran, what)
            rows[-1] += [share.hits, f"{100 * share.low:.1f} to {100 * share.high:.1f}"]
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
