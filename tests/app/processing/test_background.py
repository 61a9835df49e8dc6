import pytest
from dockpose.app.processing.background import CancelledError, Progress


def test_part_of_a_work_stops_with_it():
    told = []
    whole = Progress(told.append)
    part = whole.silent()
    assert list(part.over([1, 2])) == [1, 2]
    assert told == []
    whole.stop()
    with pytest.raises(CancelledError):
        list(part.over([1]))
