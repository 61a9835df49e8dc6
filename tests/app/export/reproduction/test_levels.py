import pytest
from dockpose.app.export.reproduction.levels import figure_3


@pytest.mark.slow
def test_the_figure_on_levels_says_in_words_what_its_table_has():
    part = figure_3(11)
    (table,), (plot,) = part.tables, part.plots
    assert [row[0] for row in table.rows] == ["lights run together", "background shows", "HATS", "lights are lost"]
    assert all(len(row) == len(table.head) for row in table.rows)
    for name, level, *_ in table.rows:
        assert f"At level {level} ({name})" in part.ours
    assert plot.png[:4] == b"\x89PNG"
    assert len(plot.png) < 300_000
