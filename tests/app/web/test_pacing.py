import threading

import pytest
from dockpose.app.web.pacing import UpdatePacing


class Clock:
    now_s = 100.0

    def __call__(self):
        return self.now_s


@pytest.fixture
def clock():
    return Clock()


@pytest.fixture
def slow():
    return threading.Event()


def shown(pacing, clock, frames, rate_hz):
    """What is shown of frames that come at a rate: how often all, and how often the picture alone."""
    alls = pictures = 0
    for _ in range(frames):
        if pacing.shows_all():
            alls += 1
            pacing.note(all_panels=True)
        elif pacing.shows_picture():
            pictures += 1
            pacing.note(all_panels=False)
        clock.now_s += 1 / rate_hz
    return alls, pictures


def test_all_of_each_frame_is_shown_while_none_follows_by_itself(clock, slow):
    assert shown(UpdatePacing(slow, lambda: False, clock), clock, 50, 100) == (50, 0)


def test_all_is_shown_four_times_a_second_and_each_picture_at_25_hz(clock, slow):
    alls, pictures = shown(UpdatePacing(slow, lambda: True, clock), clock, 250, 25)
    assert 36 <= alls <= 41  # ten seconds; every seventh frame is the first beyond a quarter of a second
    assert alls + pictures == 250


def test_no_more_than_33_pictures_a_second(clock, slow):
    alls, pictures = shown(UpdatePacing(slow, lambda: True, clock), clock, 1000, 100)
    assert alls <= 41
    assert pictures <= 334  # those that are part of all come on top


def test_without_a_graphics_card_all_is_shown_every_two_seconds(clock, slow):
    slow.set()
    alls, pictures = shown(UpdatePacing(slow, lambda: True, clock), clock, 250, 25)
    assert 4 <= alls <= 6
    assert alls + pictures == 250


def test_scene_rests_only_without_a_graphics_card_and_longer_while_playing(clock, slow):
    assert UpdatePacing(slow, lambda: True, clock).drawing_rest_s() == 0
    slow.set()
    still, playing = (UpdatePacing(slow, lambda plays=plays: plays, clock).drawing_rest_s() for plays in (False, True))
    assert 0.25 < still < playing
