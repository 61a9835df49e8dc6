from dataclasses import replace
from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest
from dockpose.app.processing.analysis import Trajectory
from dockpose.app.web.panels.play import SequencePanel, course_points

from tests.app.processing.test_analysis import LOST, frame, seen


def test_points_of_a_course_tell_what_was_seen_predicted_or_lost():
    trajectory = Trajectory()
    guessed = seen(0.1, 0.8)
    predicted = replace(guessed, track=replace(guessed.track, predicted=True))
    for index, tracked in ((0, seen(0.1)), (1, predicted), (2, LOST), (3, seen(0.3, 0.5))):
        trajectory.note(frame(index, index / 25), tracked)
    assert course_points(trajectory) == [
        [0, 0.0, 150.0, 0.9, 0], [1, 0.04, 150.0, 0.8, 1], [2, 0.08, None, None, 2], [3, 0.12, 150.0, 0.5, 0]
    ]  # fmt: skip
    assert [point[0] for point in course_points(trajectory, 2, 9)] == [2, 3]


@pytest.mark.parametrize(("is_live", "shown"), [(False, [3]), (True, [])])
def test_a_live_source_has_no_frame_to_go_to(is_live, shown):
    gone = []
    app = MagicMock(player=SimpleNamespace(frames=SimpleNamespace(is_live=is_live), go_to=gone.append))
    panel = SequencePanel.__new__(SequencePanel)
    panel.app = app
    panel.go_to(3)
    assert gone == shown
