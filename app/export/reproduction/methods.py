"""Figure 15, the threshold methods on one scene and over random scenes; and HATS from its literal reading to ours."""

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from dockpose.app.drawing.annotated import kept_pixels
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE
from dockpose.app.export.parts import Cell, Part, Rows, by_verdict, verdict
from dockpose.app.export.reproduction import pictures as draw
from dockpose.app.export.reproduction.pictures import PHOTO_DPI, SMALL, canvas, show
from dockpose.app.processing.comparison import compare
from dockpose.estimate import Estimate
from dockpose.paper.lights import rivals
from dockpose.paper.lights.levels import Picture, picture_of, pose_errors, pose_is_right
from dockpose.paper.lights.scenes import tank_scenes
from dockpose.study.statistics import Difference, Share, paired_difference, wilson
from matplotlib.figure import Figure

NAMES = {
    "hats": "HATS",
    "otsu": "Otsu",
    "sezan": "Sezan",
    "kittler": "Kittler-Illingworth",
    "kapur": "maximum entropy",
}
# What is judged, in words and as the head of a column; colour and mark.
_COLUMNS = {
    "exact": ("the groups are exactly the lights", "exactly the lights (%)", (BLUE, "o")),
    "plain_chain": ("a pose of the ellipse through all groups is right", "ellipse of all right (%)", (ORANGE, "s")),
    "right": ("the pose that our further steps choose is right", "chosen pose right (%)", (GREEN, "^")),
}
_ONE_SCENE = "uneven lighting"
_LITERAL = "literal"


def figure_15(seed: int) -> Part:
    """HATS against its four rivals."""
    pictures = {name: picture_of(scene) for name, scene in tank_scenes(seed).items()}
    found_in = {
        name: compare(picture.image, picture.scene.camera, picture.scene.dock, methods=rivals.METHODS_COMPARED)
        for name, picture in pictures.items()
    }
    picture, found = pictures[_ONE_SCENE], found_in[_ONE_SCENE]
    tally = rivals.compare_methods(seed)
    differences = {rival: _differences(tally, "hats", rival) for rival in rivals.RIVALS}
    in_tank = [
        (name, *(_cell(found_in[name][method], pictures[name]) for method in rivals.METHODS_COMPARED))
        for name in pictures
    ]
    return Part.of(
        "figure_15",
        {"main": _draw_methods(picture, found)},
        {
            "one_scene": [_one_scene(name, one, picture) for name, one in found.items()],
            "tank": [("scene", *(NAMES[name] for name in rivals.METHODS_COMPARED)), *in_tank],
            "main": share_rows(
                tally, {**NAMES, rivals.PER_LIGHT: "HATS, a level per light", rivals.ANY_LEVEL: rivals.ANY_LEVEL}
            ),
            "differences": _difference_rows("HATS less", {NAMES[rival]: of for rival, of in differences.items()}),
        },
        scene=_ONE_SCENE,
        picture=picture,
        found=found,
        right={name: pose_is_right(one, picture.truth) for name, one in found.items()},
        names=NAMES,
        columns=_COLUMNS,
        cases=len(tally.is_hard),
        shares={
            column: {name: _share(getattr(tally, column)[name]) for name in NAMES} for column in ("exact", "right")
        },
        best=_share(tally.exact[rivals.ANY_LEVEL]),
        per_light=_share(tally.right[rivals.PER_LIGHT]),
        claims={
            column: by_verdict({NAMES[rival]: vars(of[column]) for rival, of in differences.items()})
            for column in _COLUMNS
        },
    )


def literal_hats(seed: int) -> Part:
    """The ladder from the literal reading to ours."""
    tally = rivals.compare_schemes(seed)
    steps = list(tally.exact)
    gains = {after: _differences(tally, after, before) for before, after in pairwise(steps)}
    changes = {step.split("+ ")[-1]: of for step, of in gains.items()}
    beyond = {
        step: {column: one for column, one in of.items() if verdict(vars(one)) != "open"}
        for step, of in changes.items()
    }
    return Part.of(
        "literal_hats",
        {"main": _draw_steps(tally, steps)},
        {
            "main": share_rows(tally, {**{name: name for name in steps}, rivals.PER_LIGHT: "ours, a level per light"}),
            "steps": _difference_rows("step", gains),
        },
        cases=len(tally.is_hard),
        exact=[_share(tally.exact[name]) for name in (_LITERAL, rivals.OURS)],
        right=[_share(tally.right[name]) for name in (_LITERAL, rivals.OURS)],
        whole=_differences(tally, rivals.OURS, _LITERAL),
        columns=_COLUMNS,
        gains=len(gains) * len(_COLUMNS),
        sure={step: sure for step, sure in beyond.items() if sure},
        nothing=[step for step, of in changes.items() if all(one.value == 0 for one in of.values())],
    )


def _level(found: Estimate) -> int:
    assert found.threshold is not None
    return found.threshold.level


def _seen(found: Estimate) -> int:
    return 0 if found.markers is None else found.markers.seen


def _one_scene(name: str, found: Estimate, picture: Picture) -> tuple[Cell, ...]:
    pose = (np.nan, np.nan) if found.selected is None else pose_errors(found.selected, picture.truth)
    return NAMES[name], _level(found), _seen(found), found.lights_on_ring, 1000 * pose[0], pose[1], found.message


def _cell(found: Estimate, picture: Picture) -> str:
    return f"{_level(found)}: {_seen(found)}, {'right' if pose_is_right(found, picture.truth) else 'not right'}"


def _share(successes: np.ndarray) -> Share:
    return wilson(int(successes.sum()), len(successes))


def share_rows(tally: rivals.Tally, rows: Mapping[str, str]) -> Rows:
    """Head and shares of each method in per cent with their intervals; ``rows`` has the methods' names in words."""
    table: list[list[Cell]] = [[*_head("method"), "plain half", "hard half"]]
    for method, title in rows.items():
        row: list[Cell] = [title]
        for column in _COLUMNS:
            of = getattr(tally, column).get(method)
            row += [None] * 3 if of is None else _in_per_cent(_share(of))
        of = tally.right.get(method)
        row += [None if of is None else 100 * float(of[tally.is_hard == hard].mean()) for hard in (False, True)]
        table.append(row)
    return table


def _head(first: str) -> list[str]:
    return [first, *(cell for _, column, _ in _COLUMNS.values() for cell in (column, "from", "to"))]


def _in_per_cent(one: Share | Difference) -> list[float]:
    return [100 * one.value, 100 * one.low, 100 * one.high]


def _differences(tally: rivals.Tally, first: str, second: str) -> dict[str, Difference]:
    """By column, the share of the first method less that of the second on the same scenes."""
    return {column: paired_difference(of[first], of[second]) for column in _COLUMNS for of in [getattr(tally, column)]}


def _difference_rows(first: str, differences: Mapping[str, Mapping[str, Difference]]) -> Rows:
    return [
        _head(first),
        *([name, *(x for one in of.values() for x in _in_per_cent(one))] for name, of in differences.items()),
    ]


def _draw_methods(picture: Picture, found: Mapping[str, Estimate]) -> Figure:
    figure = canvas(8.6, 6.2, PHOTO_DPI)
    axes = figure.subplot_mosaic([[0, 1, 2], [3, 4, 5], ["below"] * 3], height_ratios=(3, 3, 2))
    show(axes[0], picture.image, f"the picture: {picture.lights} lights")
    for number, (name, one) in enumerate(found.items(), start=1):
        title = f"{NAMES[name]}: level {_level(one)}, {_seen(one)} groups"
        show(axes[number], kept_pixels(picture.image, one), title, found=one)
    below = axes["below"]
    draw.draw_histogram(below, picture.histogram.counts, _level(found["hats"]))
    top = below.get_ylim()[1]
    for number, (name, one) in enumerate(found.items()):
        below.annotate(
            f"{NAMES[name]}: {_level(one)}",
            (_level(one), top ** (0.95 - 0.15 * number)),
            xytext=(4, 0),
            textcoords="offset points",
            fontsize=SMALL,
            va="center",
            bbox={"fc": "white", "ec": "none", "pad": 0.5, "alpha": 0.8},
        )
        below.axvline(_level(one), color="black", lw=0.8, ls="-." if name == "hats" else ":")
    below.set_xlabel("grey level", fontsize=SMALL)
    return figure


def _draw_steps(tally: rivals.Tally, steps: list[str]) -> Figure:
    figure = canvas(8.6, 4.0)
    axes = figure.add_subplot()
    rows = np.arange(len(steps))
    for number, (column, (label, _, looks)) in enumerate(_COLUMNS.items()):
        shares = [vars(_share(getattr(tally, column)[step])) for step in steps]
        draw.draw_intervals(axes, rows + 0.22 * (number - 1), shares, looks, across=True, ms=5, capsize=2, label=label)
    axes.set_yticks(rows, steps)
    axes.invert_yaxis()
    axes.set(xlim=(0, 100), xlabel="share of scenes (%)")
    axes.grid(axis="x", lw=0.4)
    draw.legend_above(figure, axes, ncols=1)
    return figure
