"""The paper's figures and tables: what is counted, said in words, and the same from the same seed."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dockpose.app.export.parts import NumberTable
from dockpose.app.export.reproduction import poses, tank
from dockpose.app.export.reproduction.levels import figure_3, figure_16
from dockpose.app.export.reproduction.methods import share_rows
from dockpose.paper.closed_loop import FRAMES, Course
from dockpose.paper.error_budget import CAMERA
from dockpose.paper.tables import TABLES


def rows_of(table) -> dict[str, Any]:
    """Rows of a table by their first cell."""
    return {row[0]: list(row[1:]) for row in table.rows}


@pytest.mark.slow
def test_the_figures_on_levels_say_in_words_what_their_tables_have():
    part = figure_3(11)
    (table,), (plot,) = part.tables, part.plots
    seen = rows_of(table)
    assert list(seen) == ["lights run together", "background shows", "HATS", "lights are lost"]
    for name, (level, *_) in seen.items():
        assert f"Level {level} ({name})" in part.text
    # By their rules: at most half as many groups as lights, half of the background, each light, at most half of them.
    (low, _, merged, *_), (_, kept, flooded, *_), (right, _, twelve, *_), (high, _, lost, *_) = seen.values()
    assert low < right < high
    assert merged <= 6 >= lost
    assert (0.1 < kept < 0.6, flooded > 1000, twelve) == (True, True, 12)
    assert plot.png[:4] == b"\x89PNG"
    assert len(plot.png) < 300_000
    for exact, *errors in list(rows_of(figure_16(11).tables[0]).values())[:4]:
        assert exact > 10 > 20 * max(map(abs, errors))


def test_shares_in_the_table_by_hand():
    came = np.array([True, True, False, False])
    tally = {"exact": {"a": came}, "plain_chain": {"a": ~came}, "right": {"a": came}}
    rows = share_rows(tally, {"a": "method A", "b": "of which nothing is known"})
    table = NumberTable.of("figure_15", "main", "shares", rows, cases=4)
    first, second = table.shown
    assert first == ["method A", "50", "15", "85", "50", "15", "85", "50", "15", "85", "100", "0"]
    assert second[1:] == ["–"] * (len(table.head) - 1)


@pytest.mark.slow
def test_the_errors_by_the_number_of_lights(monkeypatch, tmp_path):
    monkeypatch.setattr(poses, "_TRIALS", 12)
    part = poses.figure_17(3)
    assert poses.figure_17(3) == part
    part.write(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *("figure_17.png", "figure_17.svg", "figure_17_angle.csv", "figure_17_curves.csv"),
        *("figure_17_position.csv", "figure_17_wrong.csv"),
    ]
    position, angle, wrong, _ = (  # by lights seen and method
        {name: dict(zip(table.head[1:], row, strict=True)) for name, row in rows_of(table).items()}
        for table in part.tables
    )
    # Four lights are no ellipse; many lights, and their spacing, help.
    assert {position[f"4 of {ring}"]["ellipse only"] for ring in (4, 12)} == {None}
    ours = "ours, with spacing"
    assert position["24 of 24"][ours] < position["6 of 6"][ours]
    assert angle["24 of 24"][ours] < angle["24 of 24"]["ellipse only"]
    assert wrong["12 of 12"][ours] == 0
    monkeypatch.setattr(poses, "_NOISE_PX", 0.0)
    exact = poses._errors_with(10, 10, 1)
    assert all((exact[who] < (1e-3, 1e-2)).all() for who in ("ellipse", "ours", "sqpnp"))
    by_hand = np.array([[1.0, 1.0], [2.0, 11.0], [np.inf, np.inf], [3.0, 9.0]])
    monkeypatch.setattr(poses, "_errors_with", lambda *_: dict.fromkeys(exact, by_hand))
    cells = [rows_of(table)["5 of 12"] for table in poses.figure_17(1).tables[:3]]
    assert cells == [[2.0] * 6, [9.0] * 6, [50.0] * 6]


def test_what_is_counted_of_the_approaches(monkeypatch):
    def course(second, last, off_axis_deg=0.5):
        return Course(2.0, np.array([False, second, *[last] * (FRAMES - 2)]), np.linspace(20, off_axis_deg, FRAMES))

    # Ten approaches each: all right but three of the letter, that are wrong at the end, one of them astray.
    lost, astray = course(True, False), course(True, False, off_axis_deg=30)
    by_letter = [course(False, True)] * 7 + [lost] * 2 + [astray]
    runs = {"literal": by_letter}
    monkeypatch.setattr(poses, "APPROACHES", 10)
    monkeypatch.setattr(
        poses, "run_approach", lambda seed, number, rule: runs.get(rule, [course(False, True)] * 10)[number]
    )
    part = poses.table_1(1)
    rows = rows_of(part.tables[0])
    # By Wilson 7 of 10 is 39.7 to 89.2 %, 10 of 10 is 72.2 to 100 %, none at most 27.8 %.
    assert rows["Table 1 by the letter"][:5] == [3, "10.8 to 60.3", 7, "39.7 to 89.2", 9]
    assert rows["tracker"] == [0, "0.0 to 27.8", 10, "72.2 to 100.0", 10, "72.2 to 100.0"]
    assert part.tables[1].rows[9] == [10, 2.0, 20.0, 30.0, 0, 1, *[0] * (FRAMES - 2)]


@pytest.fixture
def table_off_by(monkeypatch):
    """A table all of whose estimates are off by so much, each right in one picture of two."""

    def table_of(name, ours, epnp=0.0):
        offsets = np.array([[ours], [epnp]]) * np.ones(5)
        made = [
            (*(row + offset * np.ones((2, 1)) for offset in offsets), [True, False]) for row in TABLES[name].measured
        ]
        monkeypatch.setattr(tank, "DRAWS", 2)
        monkeypatch.setattr(tank, "reproduced", lambda asked, seed: made)
        return getattr(tank, f"table_{name}")(1)

    return table_of


@pytest.mark.parametrize("name", list(TABLES))
def test_errors_as_they_were_put_in(name, table_off_by):
    part = table_off_by(name, 0.5, epnp=-0.25)
    errors, count = rows_of(part.tables[1]), len(TABLES[name].measured)
    assert errors["1 ours"] == errors["mean absolute: ours, 2 pictures a pose"] == [0.5] * 5
    assert errors["mean absolute: paper"] == pytest.approx(TABLES[name].mean_errors.tolist(), abs=1e-4)
    assert (errors.get("median absolute: our EPnP") == [0.25] * 5) == (name == "4")
    assert f"right pose chosen in {count} of them" in part.text


@pytest.mark.parametrize("together", [-0.3, 0.05])
def test_the_budget_as_it_was_put_in(together, monkeypatch):
    def errors_of(items, *_):
        return np.full((2, 12, 5), 0.1 if len(items) == 1 else together)

    monkeypatch.setattr(tank.budgets, "rendered_calibration", lambda *_: SimpleNamespace(error_px=0.1))
    monkeypatch.setattr(tank.budgets, "calibrations", lambda *_: [CAMERA, CAMERA])
    monkeypatch.setattr(tank.budgets, "errors_of", errors_of)
    monkeypatch.setattr(tank.budgets, "errors_of_pictures", lambda *_, **sensor: (np.full((2, 12, 5), 0.01), 0.02))
    part = tank.error_budget(1)
    rows, by_table = map(rows_of, part.tables[:2])
    assert rows["diameter off by 1 mm"] == pytest.approx([0.1] * 5)
    assert rows["all together, without ignored distortion"] == pytest.approx([abs(together)] * 5)
    # Half a centimetre and a degree, by their rounding: over the square root of 12.
    assert rows["rounding of the measured values"] == pytest.approx([0.1443] * 3 + [0.2887] * 2)
    assert rows["all together, and rounding"][0] == pytest.approx(np.hypot(together, 0.1443), abs=1e-3)
    assert rows["the paper"][2] == pytest.approx(1.39, abs=0.01)
    assert by_table["Table 4: ours, believable camera and ring"] == pytest.approx([abs(together)] * 5)
