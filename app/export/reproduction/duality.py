"""Table 1 of the paper: which of the two poses an approach ends on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, VERMILLION
from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.reproduction.part import NumberTable, Part, Plot
from dockpose.paper import closed_loop
from dockpose.paper.closed_loop import RULES, Course, run_approach
from dockpose.study.statistics import wilson

if TYPE_CHECKING:
    from matplotlib.figure import Figure

APPROACHES = 100
_WORDS = {
    "literal": "Table 1 by the letter",
    "eccentricity": "Table 1 as we read it",
    "tracker": "tracker",
    "frame": "each frame alone",
}
_STYLES = {"literal": (VERMILLION, "s"), "eccentricity": (ORANGE, "^"), "tracker": (BLUE, "o"), "frame": (GREEN, "x")}
# What is counted, and in which approaches.
_COUNTS: dict[str, Callable[[Course], bool]] = {
    "right in frame 2": lambda course: bool(course.right[1]),
    "right in the last frame": lambda course: course.ends_right,
    "ends square on": lambda course: course.ends_square_on,
}


def table_1(seed: int) -> Part:
    """Make Table 1 in closed loop."""
    courses = {rule: [run_approach(seed, number, rule) for number in range(APPROACHES)] for rule in RULES}
    return part_of(courses)


def part_of(courses: dict[str, list[Course]]) -> Part:
    """The part for approaches that were run by each of ``RULES``."""
    return Part(
        key="table_1",
        title="Table 1: which of the two poses, over frames",
        paper=(
            "Table 1 is a procedure. In the first frame either of the two poses is taken and the vehicle squares up to "
            "it. If the eccentricity of the ring's image falls (e1 against e2), the pose was right and is kept; if it "
            "rises, the other one is taken. After that each frame takes the pose nearest to the one before. The "
            "condition of the else branch is printed as the difference of a quantity with itself, so that the "
            "procedure needs an interpretation. We know of no success rate that the paper gives for it."
        ),
        ours=_ours(courses),
        differs=_differs(courses),
        plots=[
            Plot.of(
                "table_1_frames",
                "Share of the approaches whose chosen pose is right, frame by frame, with 95 % intervals by Wilson. "
                "The markers of one frame stand side by side.",
                _figure(courses),
            )
        ],
        tables=[_shares(courses), *(_approaches(rule, courses[rule]) for rule in courses)],
    )


def _share(courses: Sequence[Course], what: str) -> tuple[int, float, float]:
    """How many, and the 95 % interval of the share in per cent."""
    count = sum(_COUNTS[what](course) for course in courses)
    low, high = wilson(count, len(courses)).interval
    return count, 100 * low, 100 * high


def _in_words(courses: Sequence[Course], what: str) -> str:
    count, low, high = _share(courses, what)
    return f"{count} of {len(courses)} ({low:.0f} to {high:.0f} %)"


def _ours(courses: dict[str, list[Course]]) -> str:
    number = len(next(iter(courses.values())))
    (near, far), (least, most) = closed_loop.RANGE_M, closed_loop.TILT_DEG
    ends = "; ".join(f"{_WORDS[rule]} {_in_words(courses[rule], 'right in the last frame')}" for rule in courses)
    seconds = "; ".join(f"{_WORDS[rule]} {_in_words(courses[rule], 'right in frame 2')}" for rule in courses)
    square = "; ".join(f"{_WORDS[rule]} {_in_words(courses[rule], 'ends square on')}" for rule in courses)
    return (
        f"{number} simulated approaches to a {100 * closed_loop.DOCK.diameter:.0f} cm ring of "
        f"{closed_loop.DOCK.lights} lights from {near:g} to {far:g} m and {least:g} to {most:g} degrees off its axis, "
        f"drawn at random, {closed_loop.FRAMES} frames each. Every frame is rendered and searched, and the vehicle "
        f"moves by the pose that is chosen. The chosen pose is right in the last frame: {ends}. In the second frame, "
        f"where Table 1 decides: {seconds}. The vehicle ends within {np.degrees(closed_loop.SQUARE_ON_RAD):.0f} "
        f"degrees of the dock's axis: {square}. In brackets are 95 % intervals."
    )


def _differs(courses: dict[str, list[Course]]) -> str:
    lost = sum(bool(c.right[1]) and not c.ends_right for c in courses["eccentricity"])
    lost_literal = sum(bool(c.right[1]) and not c.ends_right for c in courses["literal"])
    turned = [sum(not c.ends_square_on for c in courses[rule]) for rule in ("literal", "eccentricity")]
    alone, tracked = (sum(int((~c.right).sum()) for c in courses[rule]) for rule in ("frame", "tracker"))
    second = [sum(bool(c.right[1]) for c in courses[rule]) for rule in ("literal", "eccentricity")]
    return (
        "The two readings of Table 1 differ in that the letter compares theta x alone, and keeps the first pose "
        "where the eccentricity did not change; ours compares whole normals. The idea itself works: what is decided "
        f"in frame 2 is right in {second[0]} approaches by the letter and in {second[1]} as we read it. What fails is "
        f"the rule for the frames after it: {lost_literal} approaches by the letter and {lost} as we read it are "
        "right in frame 2 and wrong at the end. Near the dock's axis the two poses nearly coincide, the nearest to "
        "the one before may be either, and nothing corrects it. Often this does no harm, since both poses are then "
        f"nearly the same; but a vehicle that goes on by the wrong one leaves the axis again, and {turned[0]} "
        f"approaches by the letter and {turned[1]} as we read it do not end square on. The spacing of the lights, "
        "which Table 1 does not use, decides in each frame anew: of "
        f"{_number(courses) * closed_loop.FRAMES} frames the choice is wrong in {alone} by each frame alone and in "
        f"{tracked} by the tracker. At these ranges, with all lights lit, a frame alone leaves the tracker little to "
        "gain; it is for rings farther away or with lights missing. The paper's vehicle, its steps between frames "
        "and its currents are not known to us; with others the shares would be others. Where the two poses are the "
        "same within their errors, either counts as right."
    )


def _shares(courses: dict[str, list[Course]]) -> NumberTable:
    head = [
        "rule",
        *(f"{what} {unit}" for what in _COUNTS for unit in (f"(of {_number(courses)})", "(95 % interval in %)")),
    ]
    rows = []
    for rule, ran in courses.items():
        cells: list[str | int] = [_WORDS[rule]]
        for what in _COUNTS:
            count, low, high = _share(ran, what)
            cells += [count, f"{low:.1f} to {high:.1f}"]
        rows.append(cells)
    return NumberTable("table_1", "How many approaches succeed, by what chooses the pose.", head, rows)


def _number(courses: dict[str, list[Course]]) -> int:
    return len(next(iter(courses.values())))


def _approaches(rule: str, courses: Sequence[Course]) -> NumberTable:
    head = ["approach", "range (m)", "tilt (deg)", "off the axis at the end (deg)"]
    head += [f"right in frame {frame + 1}" for frame in range(len(courses[0].right))]
    rows = [
        [number, course.range_m, course.tilt_deg, float(course.off_axis_deg[-1]), *map(int, course.right)]
        for number, course in enumerate(courses, start=1)
    ]
    return NumberTable(f"table_1_{rule}", f"Approaches by {_WORDS[rule]}.", head, rows, is_shown=False)


def _figure(courses: dict[str, list[Course]]) -> Figure:
    figure = new_figure(6.5, 3.2)
    figure.set_layout_engine("constrained")
    axes = figure.add_subplot()
    numbers = 1 + np.arange(len(courses[RULES[0]][0].right))
    for place, (rule, ran) in enumerate(courses.items()):
        right = np.array([course.right for course in ran]).sum(axis=0)
        shares = 100 * right / len(ran)
        bounds = 100 * np.array([wilson(int(count), len(ran)).interval for count in right]).T
        frames = numbers + 0.12 * (place - (len(courses) - 1) / 2)
        colour, mark = _STYLES[rule]
        off = np.maximum(0.0, [shares - bounds[0], bounds[1] - shares])
        axes.errorbar(frames, shares, off, fmt=mark + "-", color=colour, ms=4, lw=0.8, label=_WORDS[rule])
    axes.set_xticks(numbers)
    axes.set_xlabel("frame")
    axes.set_ylabel("chosen pose is right (%)")
    axes.set_ylim(0, 104)
    axes.grid(axis="y", lw=0.4, color="0.85")
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=4, fontsize=8, frameon=False)
    return figure
