"""Playing: which frames are shown, in which order, and what the buttons do. The source here shows only its numbers."""

import threading
import time

import numpy as np
import pytest
from dockpose.app.processing.player import FramePlayer
from dockpose.sources import Frame, Frames, SourceError


class Numbers(Frames):
    """A recording of so many tiny frames, a thousand a second; one of them may end it."""

    def __init__(self, count=20, bad=None, is_live=False):
        super().__init__("numbers")
        self.count, self.rate_hz, self.is_live = count, 1000.0, is_live
        self.frames = count
        self.bad, self.is_closed = bad, threading.Event()

    def __iter__(self):
        number = 0
        while not self.is_closed.wait(0.001):
            yield self._frame(number)
            number += 1

    def between(self, start, stop):
        for number in range(start, min(stop, self.frames)):
            if number == self.bad:
                raise SourceError(f"numbers: frame {number} is gone")
            yield self._frame(number)

    def close(self):
        self.is_closed.set()

    def _frame(self, number):
        return Frame(np.zeros((2, 2), np.uint8), number, number / 1000, "numbers")


class Screen:
    """Remembers what was shown, and may hold the next frame up."""

    def __init__(self):
        self.shown, self.errors, self.ends = [], [], 0
        self.may_go = threading.Event()
        self.may_go.set()

    def show(self, frame):
        self.may_go.wait(60)
        self.shown.append(frame.index)

    def end(self):
        self.ends += 1


def until(check):
    end = time.monotonic() + 60
    while not check():
        assert time.monotonic() < end
        time.sleep(0.002)


@pytest.fixture
def screen():
    return Screen()


@pytest.fixture
def play(screen):
    players = []

    def start(frames):
        players.append(FramePlayer(frames, screen.show, screen.end, screen.errors.append))
        return players[-1]

    yield start
    screen.may_go.set()
    for player in players:
        player.close()
        assert not player._thread.is_alive()
        assert player.frames.is_closed.is_set()


def play_to_end(player, screen):
    until(lambda: screen.shown == [0])
    player.play()
    until(lambda: screen.ends == 1)


def test_first_frame_is_shown_and_no_other(play, screen):
    player = play(Numbers())
    until(lambda: screen.shown == [0])
    time.sleep(0.02)
    assert screen.shown == [0]
    assert not player.is_playing


def test_all_frames_are_shown_in_order_up_to_the_end(play, screen):
    player = play(Numbers(20))
    play_to_end(player, screen)
    assert screen.shown == list(range(20))
    assert not player.is_playing


def test_from_the_end_it_begins_again(play, screen):
    player = play(Numbers(3))
    play_to_end(player, screen)
    player.play()
    until(lambda: screen.ends == 2)
    assert screen.shown == [0, 1, 2, 0, 1, 2]


def test_slow_screen_loses_no_frame(play, screen):
    player = play(Numbers(5))
    screen.may_go.clear()
    player.play()
    time.sleep(0.05)
    screen.may_go.set()
    until(lambda: screen.ends == 1)
    assert screen.shown == [0, 1, 2, 3, 4]


def test_steps_pause_and_show_one_frame_each(play, screen):
    player = play(Numbers())
    until(lambda: screen.shown == [0])
    for by, expected in ((1, 1), (1, 2), (-1, 1), (-5, 0)):
        player.step(by)
        until(lambda expected=expected: player.index == expected)
    assert screen.shown == [0, 1, 2, 1, 0]
    assert not player.is_playing


def test_it_goes_where_it_is_told_and_plays_on_from_there(play, screen):
    player = play(Numbers(20))
    until(lambda: screen.shown == [0])
    player.go_to(17)
    until(lambda: screen.shown == [0, 17])
    player.play()
    until(lambda: screen.ends == 1)
    assert screen.shown == [0, 17, 18, 19]


def test_beyond_the_ends_it_goes_to_the_last_frame(play, screen):
    player = play(Numbers(20))
    until(lambda: screen.shown == [0])
    player.go_to(1000)
    until(lambda: player.index == 19)
    player.go_to(-7)
    until(lambda: player.index == 0)


@pytest.mark.slow
def test_a_frame_that_a_pause_held_back_comes_when_it_goes_on(play, screen):
    frames = Numbers(20)
    frames.rate_hz = 0.5  # two seconds a frame: the pause falls between the first and the second
    player = play(frames)
    until(lambda: screen.shown == [0])
    player.play()
    time.sleep(0.05)
    player.play(False)
    time.sleep(0.05)
    assert screen.shown == [0]
    frames.rate_hz = 1000.0
    player.play()
    until(lambda: screen.ends == 1)
    assert screen.shown == list(range(20))


def test_speed_is_that_of_the_frames_times_what_was_chosen(play, screen):
    frames = Numbers(6)
    frames.rate_hz = 10.0
    player = play(frames)
    until(lambda: screen.shown == [0])
    player.set_speed(4.0)
    began = time.monotonic()
    player.play()
    until(lambda: screen.ends == 1)
    assert time.monotonic() - began >= 4 / 40  # five frames later, less what may be made up for


def test_error_ends_the_playing_and_is_told(play, screen):
    player = play(Numbers(bad=3))
    until(lambda: screen.shown == [0])
    player.play()
    until(lambda: len(screen.errors) == 1)
    assert "frame 3 is gone" in str(screen.errors[0])
    assert screen.shown == [0, 1, 2]
    assert not player.is_playing


def test_live_source_plays_at_once_and_shows_nothing_while_it_is_paused(play, screen):
    player = play(Numbers(is_live=True))
    until(lambda: len(screen.shown) > 5)
    player.play(False)
    time.sleep(0.02)
    shown = len(screen.shown)
    time.sleep(0.05)
    assert len(screen.shown) == shown
    player.play()
    until(lambda: len(screen.shown) > shown)
    assert screen.shown == sorted(set(screen.shown))
