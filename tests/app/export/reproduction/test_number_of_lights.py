import pytest
from dockpose.app.export.reproduction import number_of_lights
from dockpose.app.export.reproduction.number_of_lights import figure_17, part_of
from dockpose.paper.light_numbers import errors_with


@pytest.mark.slow
def test_the_same_seed_gives_the_same_bytes(monkeypatch, tmp_path):
    monkeypatch.setattr(number_of_lights, "errors_with", lambda seen, lights, seed: errors_with(seen, lights, seed, 4))
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
    part = part_of({cell: errors_with(*cell, seed=1, trials=4) for cell in counts})
    position = part.tables[0].rows
    assert position[0][:2] == ["4 of 4", None]
    assert all(value is not None for value in position[1][1:])
    assert "0.3 px" in part.ours
