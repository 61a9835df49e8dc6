"""Which picture is shown of a row that is far off: that of its film, where it is open, else the row's own."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dockpose.app.web.panels.trajectory import TrajectoryPanel


@pytest.mark.parametrize(
    ("opened", "source", "frame", "expected"),
    [
        ("/films/dive.mkv", "dive.mkv", 40, 40),
        ("/films/other.mkv", "dive.mkv", 40, "row 2"),
        ("/films/dive.mkv", "dive.mkv", None, "row 2"),
        (None, "dive.mkv", 40, "row 2"),
    ],
)
def test_a_row_is_looked_at_in_its_own_film_or_by_itself(opened, source, frame, expected):
    shown: list[Any] = []

    def whole(row):
        shown.append(f"row {row}")
        return np.zeros((4, 4), np.uint8), None

    results = SimpleNamespace(
        track=SimpleNamespace(times_s=np.arange(3.0)), films=[("", None), ("", None), (source, frame)], whole=whole
    )
    film = None if opened is None else SimpleNamespace(name=opened)
    panel: Any = SimpleNamespace(
        _compared=SimpleNamespace(results=results),
        app=SimpleNamespace(opened=film, player=SimpleNamespace(go_to=shown.append)),
        change=lambda *given, **named: None,
    )
    anybody: Any = None
    TrajectoryPanel._do(panel, "2", anybody)
    assert shown == [expected]
