import numpy as np
import pytest
from dockpose.app.export.reproduction import poses
from dockpose.app.export.reproduction.poses import figure_17, figure_17_part, table_1_part
from dockpose.paper.closed_loop import RULES, Course
from dockpose.paper.light_numbers import errors_with


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(monkeypatch, tmp_path):
    monkeypatch.setattr(poses, "errors_with", lambda seen, lights, seed: errors_with(seen, lights, seed, 4))
    part = figure_17(3)
    part.write(tmp_path)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *("figure_17.png", "figure_17.svg", "figure_17_angle.csv", "figure_17_curves.csv"),
        *("figure_17_position.csv", "figure_17_wrong.csv"),
    ]
    assert figure_17(3) == part


@pytest.mark.slow
def test_four_lights_have_no_ellipse_in_the_table():
    counts = ((4, 4), (10, 10), (24, 24), (12, 12), (4, 12), (5, 12), (6, 12))
    part = figure_17_part({cell: errors_with(*cell, seed=1, trials=4) for cell in counts})
    position = part.tables[0].rows
    assert position[0][:2] == ["4 of 4", None]
    assert all(value is not None for value in position[1][1:])
    assert "0.3 px" in part.ours


def course(right, off_axis_deg=0.5):
    flags = np.array(right, dtype=bool)
    return Course(2.0, 20.0, flags, np.linspace(20.0, off_axis_deg, len(flags)))


def courses():
    """Ten approaches each: all right but three of the letter, that are wrong at the end, one of them astray."""
    good, lost, astray = course([0, 1, 1]), course([1, 1, 0]), course([1, 1, 0], off_axis_deg=30)
    return {rule: [good] * 10 if rule != "literal" else [good] * 7 + [lost] * 2 + [astray] for rule in RULES}


def test_what_is_counted():
    part = table_1_part(courses())
    rows = {row[0]: row[1:] for row in part.tables[0].rows}
    assert rows["Table 1 by the letter"][::2] == [10, 7, 9]
    assert rows["tracker"][::2] == [10, 10, 10]
    # By Wilson 7 of 10 is 39.7 to 89.2 %, 10 of 10 is 72.2 to 100 %.
    assert rows["Table 1 by the letter"][3] == "39.7 to 89.2"
    assert rows["tracker"][1] == "72.2 to 100.0"
    assert "3 approaches by the letter and 0 as we read it" in part.differs
    assert "1 approaches by the letter and 0 as we read it" in part.differs


def test_the_same_approaches_give_the_same_bytes():
    assert table_1_part(courses()) == table_1_part(courses())
