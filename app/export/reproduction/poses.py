"""Figure 17, the pose's error against the number of lights; Table 1, which of the two poses an approach ends on."""

import itertools
import math
from collections.abc import Callable

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE, PURPLE, SKY_BLUE, VERMILLION
from dockpose.app.export.parts import Part, Rows
from dockpose.app.export.plots import canvas, draw_intervals, legend_above
from dockpose.dock import Dock
from dockpose.lights.ellipse import NoEllipseError
from dockpose.paper import closed_loop
from dockpose.paper.closed_loop import Course, run_approach
from dockpose.paper.levels import poses_of_all
from dockpose.paper.scenes import CAMERA, DIAMETER_M
from dockpose.pose.circle import CirclePose, angles_of, rotation_from_angles
from dockpose.pose.pnp import NAMES, NoPoseError, solve
from dockpose.pose.solve import find_poses
from dockpose.study.draw import tilted_normal
from dockpose.study.judge import nearest, pose_errors
from dockpose.study.statistics import share_of, wilson
from matplotlib.ticker import FormatStrFormatter, LogLocator, NullLocator

_NOISE_PX = 0.3
_RANGE_M, _OFF_AXIS, _MOST_TILT_DEG = (0.7, 2.5), 0.1, 40.0
_RING_OF = 12  # lights, as the paper's coloured dock has, of which some are seen
_TRIALS = 400
_COUNTS_SEEN = (4, 5, 6, 7, 8, 10, 12, 16, 20, 24)
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
_ERRORS = (("position (%)", "position (% of range)"), ("angle (deg)", "normal (°)"))
_WRONG_DEG = 10.0  # off by more, it is a different pose
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
    "right in frame 2": lambda course: course.right[1],
    "right in the last frame": lambda course: course.right[-1],
    "ends square on": lambda course: course.off_axis_deg[-1] <= closed_loop.SQUARE_ON_DEG,
}


def figure_17(seed: int) -> Part:
    """Error of the pose by the number of lights that are seen, and that the ring has."""
    rings = {
        "complete ring": [(count, count) for count in _COUNTS_SEEN],
        f"some lights of a ring of {_RING_OF}": [(count, _RING_OF) for count in _COUNTS_SEEN if count <= _RING_OF],
    }
    cells = list(dict.fromkeys(itertools.chain(*rings.values())))
    errors = {cell: _errors_with(*cell, seed) for cell in cells}
    # By cell and method (2, 2): median and what 90 % stay below, without interpolation, so that infinite ones do no
    # harm; of position and normal.
    quantiles = {
        cell: {who: np.quantile(one, list(_SHARES.values()), axis=0, method="inverted_cdf") for who, one in of.items()}
        for cell, of in errors.items()
    }
    wrong = {cell: {who: (one[:, 1] > _WRONG_DEG).mean() for who, one in of.items()} for cell, of in errors.items()}
    figure = canvas(8.0, 9.0)
    grid = figure.subplots(4, 2, sharex="col", sharey="row")
    for column, (title, ring) in enumerate(rings.items()):
        grid[0, column].set_title(title, fontsize=9)
        grid[3, column].set_xlabel("number of lights seen")
        for row, (what, share) in enumerate(itertools.product((0, 1), (0, 1))):
            axes = grid[row, column]
            grid[row, 0].set_ylabel(f"{_ERRORS[what][1]}\n{list(_SHARES)[share]}")
            for who, (colour, mark, dash) in _STYLES.items():
                values = np.array([quantiles[cell][who][share, what] for cell in ring])
                values[~np.isfinite(values)] = np.nan
                looks = {"marker": mark, "color": colour, "ms": 4, "lw": 1, "label": _WORDS[who]}
                axes.plot([seen for seen, _ in ring], values, dash, **looks)
            axes.set_yscale("log")
            axes.yaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            axes.yaxis.set_major_formatter(FormatStrFormatter("%g"))
            axes.yaxis.set_minor_locator(NullLocator())
            axes.grid(lw=0.4, color="0.85")
            axes.set_xticks([seen for seen, _ in ring])
    legend_above(figure, grid[0, 0], ncols=6, fontsize=8)

    def table(cell_of: Callable[[tuple[int, int], str], float]) -> Rows:
        known = {cell: [who for who in of if np.isfinite(of[who]).any()] for cell, of in errors.items()}
        rows = [[cell_of(cell, who) if who in known[cell] else None for who in _WORDS] for cell in cells]
        named = [f"{seen} of {lights}" for seen, lights in cells]
        return [["lights seen", *_WORDS.values()], *([name, *row] for name, row in zip(named, rows, strict=True))]

    return Part.of(
        "figure_17",
        {"main": figure},
        {
            "position": table(lambda cell, who: float(quantiles[cell][who][0, 0])),
            "angle": table(lambda cell, who: float(quantiles[cell][who][0, 1])),
            "wrong": table(lambda cell, who: 100 * float(wrong[cell][who])),
            "curves": [
                [*cell, _WORDS[who], name, *(x if np.isfinite(x) else None for x in of[who][:, what].tolist())]
                for cell, of in quantiles.items()
                for who in _WORDS
                for what, (name, _) in enumerate(_ERRORS)
            ],
        },
        set_up={"ring": _RING_OF, "noise_px": _NOISE_PX, "range_m": _RANGE_M},
        medians={cell: {who: tuple(one[0]) for who, one in of.items()} for cell, of in quantiles.items()},
        wrong=wrong,
        first=_COUNTS_SEEN[0],
        trials=_TRIALS,
    )


def _errors_with(seen: int, lights: int, seed: int) -> dict[str, np.ndarray]:
    """Errors (_TRIALS, 2) in per cent of the range and degrees where ``seen`` of ``lights`` are seen, by ``_WORDS``."""
    # Infinite where there is no pose. The ellipse's is that of its better pose; EPnP and its peers are given which
    # light is which, our method is not.
    known = Dock(DIAMETER_M, lights)
    found = {who: np.empty((_TRIALS, 2)) for who in _WORDS}
    for trial in range(_TRIALS):
        rng = np.random.default_rng([seed, 9, seen, lights, trial])
        position = rng.uniform(*_RANGE_M) * np.array([*rng.uniform(-_OFF_AXIS, _OFF_AXIS, 2), 1.0])
        tilt, around = math.radians(rng.uniform(0, _MOST_TILT_DEG)), rng.uniform(0, 2 * math.pi)
        rotation = rotation_from_angles(*angles_of(tilted_normal(np.array([0.0, 0.0, 1.0]), tilt, around)))
        numbers = np.sort(rng.choice(lights, seen, replace=False))
        angles = known.light_angles_rad()[numbers] + rng.uniform(0, 2 * math.pi)
        ring = known.radius * np.column_stack([np.cos(angles), np.sin(angles), np.zeros(seen)])
        points = CAMERA.project(position + ring @ rotation.T) + rng.normal(0, _NOISE_PX, (seen, 2))
        true = CirclePose(position, -rotation[:, 2], np.zeros(2))
        for who in _WORDS:
            pose = _pose_by(who, points, numbers, known, true.normal)
            off_m, angle_deg = (math.inf, math.inf) if pose is None else pose_errors(pose, true)
            found[who][trial] = 100 * off_m / float(np.linalg.norm(position)), angle_deg
    return found


def _pose_by(who: str, points: np.ndarray, numbers: np.ndarray, dock: Dock, normal: np.ndarray) -> CirclePose | None:
    try:
        if who == "ours":
            choice = find_poses(points, CAMERA, dock)[1]
            return choice.candidates[choice.selected]
        if who == "ellipse":
            poses = poses_of_all(points, CAMERA, dock)
            return nearest(poses, normal) if poses else None
        return solve(points, numbers, CAMERA, dock, who)
    except (NoEllipseError, NoPoseError):
        return None


def table_1(seed: int) -> Part:
    """Table 1 in closed loop."""
    courses = {rule: [run_approach(seed, number, rule) for number in range(APPROACHES)] for rule in _RULES}
    shares = {
        rule: {what: wilson(sum(bool(is_so(course)) for course in ran), APPROACHES) for what, is_so in _COUNTS.items()}
        for rule, ran in courses.items()
    }
    figure = canvas(6.5, 3.2)
    axes = figure.add_subplot()
    right = {rule: np.array([course.right for course in ran]) for rule, ran in courses.items()}  # (approaches, frames)
    numbers = 1 + np.arange(closed_loop.FRAMES)
    for place, (rule, (words, looks)) in enumerate(_RULES.items()):
        by_frame = [vars(share_of(column)) for column in right[rule].T]
        draw_intervals(axes, numbers + 0.12 * (place - (len(_RULES) - 1) / 2), by_frame, looks, label=words)
    axes.set(xticks=numbers, xlabel="frame", ylabel="chosen pose is right (%)", ylim=(0, 104))
    axes.grid(axis="y", lw=0.4, color="0.85")
    legend_above(figure, axes, ncols=4, fontsize=8)
    heads = ((f"{what} (of {APPROACHES})", f"{what} (95 % interval in %)") for what in _COUNTS)
    cells = {
        rule: ((one.hits, f"{100 * one.low:.1f} to {100 * one.high:.1f}") for one in of.values())
        for rule, of in shares.items()
    }
    counts = [[_RULES[rule][0], *itertools.chain(*pairs)] for rule, pairs in cells.items()]
    head = ["approach", "range (m)", "tilt (deg)", "off the axis at the end (deg)"]
    head += [f"right in frame {number}" for number in numbers]
    approaches: dict[str, Rows] = {
        rule: [head, *([k, one.range_m, *one.off_axis_deg[[0, -1]].tolist(), *map(int, one.right)] for k, one in ran)]
        for rule, ran in ((rule, enumerate(of, start=1)) for rule, of in courses.items())
    }
    return Part.of(
        "table_1",
        {"frames": figure},
        {"main": [["rule", *itertools.chain(*heads)], *counts], **approaches},
        number=APPROACHES,
        set_up=closed_loop,
    )
