from dockpose.app.web.server.looks import UpdatePacing

from tests.support.clock import Clock


def pacing(draws_slowly, is_playing, clock):
    return UpdatePacing(lambda: draws_slowly, lambda: is_playing, clock)


def shown(is_playing, frames, rate_hz):
    """How many of the frames that come at a rate are shown."""
    clock, count = Clock(), 0
    pace = pacing(False, is_playing, clock)
    for _ in range(frames):
        count += pace.shows_next()
        clock.now_s += 1 / rate_hz
    return count


def test_each_frame_is_shown_while_none_follows_by_itself_and_else_no_more_than_33_a_second():
    assert shown(False, 50, 100) == 50
    assert shown(True, 300, 30) == 300
    assert shown(True, 1000, 100) <= 335


def test_no_frame_is_left_out_that_comes_the_sooner_since_the_one_before_was_late():
    clock = Clock()
    pace, count = pacing(False, True, clock), 0
    for number in range(300):
        clock.now_s = number / 30 + (0.028 if number % 2 else 0.0)
        count += pace.shows_next()
    assert count == 300


def test_scene_rests_only_without_a_graphics_card():
    fast, slow = (pacing(draws_slowly, False, Clock()) for draws_slowly in (False, True))
    assert fast.drawing_pauses_s() == (0, 0)
    assert slow.drawing_pauses_s()[0] > 0.25
