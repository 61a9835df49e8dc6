import threading

import pytest
from dockpose.app.web.server.looks import UpdatePacing

from tests.support.clock import Clock


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def slow():
    return threading.Event()


def shown(pacing, clock, frames, rate_hz):
    """How many of the frames that come at a rate are shown."""
    count = 0
    for _ in range(frames):
        if pacing.shows_next():
            count += 1
        clock.now_s += 1 / rate_hz
    return count


def test_each_frame_is_shown_while_none_follows_by_itself(clock, slow):
    assert shown(UpdatePacing(slow.is_set, lambda: False, clock), clock, 50, 100) == 50


def test_each_frame_is_shown_at_30_hz_and_no_more_than_33_a_second(clock, slow):
    assert shown(UpdatePacing(slow.is_set, lambda: True, clock), clock, 300, 30) == 300
    assert shown(UpdatePacing(slow.is_set, lambda: True, clock), clock, 1000, 100) <= 334


def test_scene_is_hidden_only_without_a_graphics_card_and_while_playing_altogether(clock, slow):
    playing, still = (UpdatePacing(slow.is_set, lambda plays=plays: plays, clock) for plays in (True, False))
    assert (playing.drawing_rest_s(), playing.hides_scene()) == (0, False)
    slow.set()
    assert (playing.hides_scene(), still.hides_scene()) == (True, False)
    assert still.drawing_rest_s() > 0.25
