"""Figure 15, the threshold methods on one scene and over random scenes; and the literal HATS."""

from collections.abc import Iterable, Mapping
from itertools import chain

import numpy as np
from dockpose.app.export.parts import Part, Rows, by_verdict
from dockpose.app.export.plots import methods_beside, side_by_side
from dockpose.app.processing.comparison import compare
from dockpose.estimate import Estimate
from dockpose.paper import rivals
from dockpose.paper.levels import Picture
from dockpose.paper.rivals import ANY_LEVEL, COLUMNS, LITERAL, NAMES, OURS, PER_LIGHT, Tally
from dockpose.paper.scenes import tank_scenes
from dockpose.study.judge import is_right
from dockpose.study.statistics import Difference, Share, paired_difference, share_of

_ONE_SCENE = "uneven lighting"


def figure_15(seed: int) -> Part:
    """HATS against its four rivals."""
    pictures = {name: Picture(scene) for name, scene in tank_scenes(seed).items()}
    found_in = {
        name: compare(one.image, one.scene.camera, one.scene.dock, methods=NAMES) for name, one in pictures.items()
    }
    beside = (methods_beside(name, pictures[name].image, of, NAMES) for name, of in found_in.items())
    picture, found = pictures[_ONE_SCENE], found_in[_ONE_SCENE]
    one_scene = [
        (NAMES[name], _level(one), _seen(one), one.lights_on_ring, *picture.off(one), one.message)
        for name, one in found.items()
    ]
    tank = [(name, *(_summed_up(one, pictures[name]) for one in of.values())) for name, of in found_in.items()]
    tally = rivals.compare_methods(seed)
    against = {NAMES[rival]: _differences(tally, "hats", rival) for rival in rivals.RIVALS}
    cases = {**NAMES, PER_LIGHT: "HATS, a level per light", ANY_LEVEL: ANY_LEVEL}
    return Part.of(
        "figure_15",
        {"main": side_by_side([*chain.from_iterable(beside)], 1 + len(NAMES))},
        {
            "one_scene": one_scene,
            "tank": [("scene", *NAMES.values()), *tank],
            "main": share_rows(tally, cases),
            "differences": [(name, *_in_percent(of.values())) for name, of in against.items()],
        },
        names=NAMES,
        cases=2 * rivals.SCENES_A_HALF,
        shares=_shares(tally),
        claims=by_verdict({name: vars(of["exact"]) for name, of in against.items()}),
    )


def literal_hats(seed: int) -> Part:
    """The literal reading beside ours."""
    tally = rivals.compare_schemes(seed)
    shares = _shares(tally)
    return Part.of(
        "literal_hats",
        {},
        {"main": share_rows(tally, {LITERAL: LITERAL, OURS: OURS, PER_LIGHT: "ours, a level per light"})},
        cases=2 * rivals.SCENES_A_HALF,
        exact=[shares["exact"][name] for name in (LITERAL, OURS)],
        right=[shares["right"][name] for name in (LITERAL, OURS)],
    )


def _level(found: Estimate) -> int:
    assert found.threshold is not None
    return found.threshold.level


def _seen(found: Estimate) -> int:
    return 0 if found.markers is None else found.markers.seen


def _summed_up(found: Estimate, picture: Picture) -> str:
    """Level, groups, and whether the chosen pose is right."""
    return f"{_level(found)}: {_seen(found)}, {'' if is_right(found.selected, picture.truth) else 'not '}right"


def _shares(tally: Tally) -> dict[str, dict[str, Share]]:
    """By column and method."""
    return {column: {name: share_of(came) for name, came in of.items()} for column, of in tally.items()}


def share_rows(tally: Tally, rows: Mapping[str, str]) -> Rows:
    """Shares of each method in per cent with their intervals; ``rows`` has the methods' names in words."""
    shares, table = _shares(tally), []
    for method, title in rows.items():
        right = tally["right"].get(method)
        halves = [None] * 2 if right is None else [100 * float(half.mean()) for half in np.split(right, 2)]
        table.append([title, *_in_percent(shares[column].get(method) for column in COLUMNS), *halves])
    return table


def _in_percent(found: Iterable[Share | Difference | None]) -> Iterable[float | None]:
    """Values in per cent, each with its interval."""
    return chain.from_iterable(
        [None] * 3 if one is None else [100 * one.value, 100 * one.low, 100 * one.high] for one in found
    )


def _differences(tally: Tally, first: str, second: str) -> dict[str, Difference]:
    """By column, the share of the first method less that of the second on the same scenes."""
    return {column: paired_difference(of[first], of[second]) for column, of in tally.items()}
