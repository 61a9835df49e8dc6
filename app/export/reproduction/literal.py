"""HATS as literally as the paper gives it, and what each step from there to ours buys."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from dockpose.app.drawing.colours import BLUE, GREEN, ORANGE
from dockpose.app.drawing.figures import new_figure
from dockpose.app.export.reproduction.methods import (
    COLUMNS,
    DISTRIBUTION,
    difference,
    difference_head,
    share_table,
    share_words,
)
from dockpose.app.export.reproduction.part import NumberTable, Part, Plot
from dockpose.paper.lights.rivals import OURS, PER_LIGHT, Tally, compare_schemes
from dockpose.study.statistics import wilson

_STYLES = {"exact": (BLUE, "o"), "plain_chain": (ORANGE, "s"), "right": (GREEN, "^")}
_LITERAL = "literal"


def literal_hats(seed: int) -> Part:
    """The ladder from the literal reading to ours."""
    tally = compare_schemes(seed)
    steps = list(tally.exact)
    gains = {
        (before, after): {
            column: difference(getattr(tally, column)[after], getattr(tally, column)[before]) for column in COLUMNS
        }
        for before, after in [*pairwise(steps), (_LITERAL, OURS)]
    }
    whole = gains.pop((_LITERAL, OURS))
    return Part(
        key="literal_hats",
        title="HATS as literally as the paper gives it, and ours",
        paper="The histogram's local peaks, from bright to dark, are candidates for the level. At each the picture is "
        "binarised and its groups are counted, the candidates vote on the number of lights, and the level that keeps "
        "the most lights apart is taken. How votes weigh, where to stop and what noise does is left open.",
        ours=f"Over {len(tally.is_hard)} random scenes, the same as in Figure 15, the groups are exactly the lights in "
        f"{share_words(tally.exact[_LITERAL])} by the literal reading and in {share_words(tally.exact[OURS])} by ours: "
        f"{_difference_words(whole['exact'])}. The pose that our further steps choose is right in "
        f"{share_words(tally.right[_LITERAL])} and {share_words(tally.right[OURS])}: "
        f"{_difference_words(whole['right'])}. {_steps_words(gains)}",
        differs="The literal reading takes every local peak of the histogram as it is, down to the darkest; each has "
        "one vote; groups of one pixel count; elected is the number with the most votes, of several the largest; the "
        "level is the brightest candidate with that number. Each step keeps those before it: groups below two pixels "
        "do not count; candidates end above the background and at saturation; every level is a candidate, not peaks "
        "alone; a number's votes are those of its longest unbroken run; votes weigh by the logarithm of brightness "
        "above the background; elected is the largest number with a fifth of the votes; levels at which noise "
        "dissolves do not vote. Ours also looks again, with a lower bound, where the vote is not sure. The order of "
        "the steps matters: "
        "a step that costs something alone may be what the next one rests on. " + DISTRIBUTION,
        plots=[_draw(tally, steps)],
        tables=[
            share_table(
                "literal_hats", tally, {**{name: name for name in steps}, PER_LIGHT: "ours, a level per light"}
            ),
            NumberTable(
                "literal_hats_steps",
                "What each step adds to the one before, in percentage points, with the interval of 95 %.",
                difference_head("step"),
                [
                    (after, *(100 * value for column in COLUMNS for value in of[column]))
                    for (_, after), of in gains.items()
                ],
            ),
        ],
    )


def _difference_words(difference: tuple[float, float, float]) -> str:
    gain, low, high = (100 * value for value in difference)
    return f"{gain:+.0f} points ({low:.0f} to {high:.0f})"


def _steps_words(gains: dict[tuple[str, str], dict[str, tuple[float, float, float]]]) -> str:
    """Which steps gain or cost more than chance in any column, and which change nothing."""
    sure, nothing = [], []
    for (_, step), of in gains.items():
        told = [
            f"{100 * gain:+.0f} points where {COLUMNS[column]}"
            for column, (gain, low, high) in of.items()
            if low > 0 or high < 0
        ]
        if told:
            sure.append(f"“{step.split('+ ')[-1]}” {' and '.join(told)}")
        elif all(gain == 0 for gain, _, _ in of.values()):
            nothing.append(f"“{step.split('+ ')[-1]}”")
    words = f"Of the steps, these change more than chance does: {'; '.join(sure)}." if sure else ""
    if not sure:
        words = "No single step changes more than chance does."
    if nothing:
        words += f" These change nothing on these scenes: {', '.join(nothing)}."
    cases = len(gains) * len(COLUMNS)
    return (
        f"{words} The others cannot be told from chance on so few scenes; of the {cases} intervals, which are not "
        f"corrected for their number, about {cases * 0.05:.1f} would leave out 0 by chance alone."
    )


def _draw(tally: Tally, steps: list[str]) -> Plot:
    figure = new_figure(8.6, 4.0)
    axes = figure.add_subplot()
    rows = np.arange(len(steps))
    for number, (column, words) in enumerate(COLUMNS.items()):
        of = getattr(tally, column)
        shares = np.array([of[step].mean() for step in steps])
        ends = np.array([wilson(int(of[step].sum()), len(of[step])).interval for step in steps])
        colour, marker = _STYLES[column]
        axes.errorbar(
            100 * shares,
            rows + 0.22 * (number - 1),
            xerr=100 * np.abs(ends.T - shares),
            fmt=marker,
            color=colour,
            ms=5,
            capsize=2,
            label=words,
        )
    axes.set_yticks(rows, steps)
    axes.invert_yaxis()
    axes.set_xlim(0, 100)
    axes.set_xlabel("share of scenes (%)")
    axes.grid(axis="x", lw=0.4)
    figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=1, frameon=False)
    figure.set_layout_engine("constrained")
    return Plot.of(
        "literal_hats", "Shares with Wilson's intervals of 95 %, from the literal reading down to ours.", figure
    )
