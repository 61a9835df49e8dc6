import numpy as np
from dockpose.app.export.parts import NumberTable
from dockpose.app.export.reproduction.methods import share_rows
from dockpose.paper.lights.rivals import Tally


def test_shares_in_the_table_by_hand():
    successes = np.array([True, True, False, False])
    tally = Tally(np.array([False, False, True, True]), {"a": successes}, {"a": ~successes}, {"a": successes})
    rows = share_rows(tally, {"a": "method A", "b": "of which nothing is known"})
    table = NumberTable.of("figure_15", "main", "shares", rows, cases=4)
    first, second = table.shown
    assert first == ["method A", "50", "15", "85", "50", "15", "85", "50", "15", "85", "100", "0"]
    assert second[1:] == ["–"] * (len(table.head) - 1)
