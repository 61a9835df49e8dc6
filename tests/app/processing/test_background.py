"""Newest jobs, work that is stopped, and playing, whose source here shows only its numbers."""

import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from dockpose.app.processing import background
from dockpose.app.processing.background import FramePlayer, LatestWorker
from dockpose.sources import Frame, Frames, SourceError

from tests.support.clock import Clock, until


class Recorder:
    """Work that can be held up, and remembers what it was given."""

    def __init__(self):
        self.done, self.errors = [], []
        self.may_go, self.has_begun = threading.Event(), threading.Event()
        self.may_go.set()

    def __call__(self, job):
        self.has_begun.set()
        assert self.may_go.wait(60)
        if job == "bad":
            raise ValueError("bad job")
        self.done.append(job)


@pytest.fixture
def record():
    return Recorder()


@pytest.fixture
def worker(record):
    running = LatestWorker(record, record.errors.append)
    yield running
    record.may_go.set()
    running.close()
    assert not running._thread.is_alive()


def test_waiting_jobs_are_dropped_for_the_newest(worker, record):
    record.may_go.clear()
    worker.submit(0)
    assert record.has_begun.wait(60)
    for job in range(1, 100):
        worker.submit(job)
    assert not worker.wait_until_idle(0.05)
    record.may_go.set()
    assert worker.wait_until_idle(120)
    assert record.done == [0, 99]


def test_last_of_many_is_always_worked_on_also_from_many_threads(worker, record):
    for job in range(5000):
        worker.submit(job)
    assert worker.wait_until_idle(120)
    assert record.done[-1] == 4999
    assert record.done == sorted(set(record.done))
    threads = [threading.Thread(target=lambda: [worker.submit(job) for job in range(500)]) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    worker.submit("last")
    assert worker.wait_until_idle(120)
    assert record.done[-1] == "last"


def test_error_is_reported_and_the_next_job_is_done(worker, record):
    worker.submit("bad")
    assert worker.wait_until_idle(120)
    assert [str(error) for error in record.errors] == ["bad job"]
    worker.submit("good")
    assert worker.wait_until_idle(120)
    assert record.done == ["good"]


def test_close_drops_what_waits(record):
    worker = LatestWorker(record, record.errors.append)
    record.may_go.clear()
    worker.submit("running")
    assert record.has_begun.wait(60)
    worker.submit("waiting")
    closing = threading.Thread(target=worker.close)
    closing.start()
    while not worker._is_closed:
        pass
    record.may_go.set()
    closing.join(5)
    assert record.done == ["running"]


@pytest.fixture
def clock(monkeypatch):
    """The workers' clock, which a busy machine does not move."""
    clock = Clock()
    monkeypatch.setattr(background, "time", SimpleNamespace(monotonic=clock))
    return clock


def test_after_a_job_it_rests_and_then_takes_the_newest(record, clock):
    resting = LatestWorker(record, record.errors.append, lambda: (0.05, 0.0))
    resting.submit("first")
    assert resting.wait_until_idle(120)
    resting.submit("superseded")
    resting.submit("newest")
    assert not resting.wait_until_idle(0.1)
    clock.now_s += 0.1
    assert resting.wait_until_idle(120)
    assert record.done == ["first", "newest"]
    resting.close()


def test_closing_does_not_wait_for_the_rest(record):
    resting = LatestWorker(record, record.errors.append, lambda: (1e6, 0.0))
    resting.submit("first")
    assert resting.wait_until_idle(120)
    resting.submit("never")
    resting.close()
    assert not resting._thread.is_alive()
    assert record.done == ["first"]


def test_job_waits_until_no_newer_one_comes(record, clock):
    waiting = LatestWorker(record, record.errors.append, lambda: (0.0, 0.05))
    for job in range(5):
        clock.now_s += 0.04
        waiting.submit(job)
        assert not waiting.wait_until_idle(0.06)
    assert record.done == []
    clock.now_s += 0.1
    assert waiting.wait_until_idle(120)
    assert record.done == [4]
    waiting.close()


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
    player.play()
    until(lambda: screen.ends == 1)


@pytest.fixture
def begun(play, screen):
    """Begin to play, and wait for the first frame."""

    def start(frames):
        player = play(frames)
        until(lambda: screen.shown == [0])
        return player

    return start


def test_first_frame_is_shown_and_no_other_until_it_plays_to_the_end_in_order_and_again(begun, screen):
    player = begun(Numbers(20))
    time.sleep(0.02)
    assert screen.shown == [0]
    for times in (1, 2):
        assert not player.is_playing
        player.play()
        until(lambda times=times: screen.ends == times)
        assert screen.shown == times * [*range(20)]
    assert not player.is_playing


def test_frames_are_read_ahead_while_it_plays_and_not_while_it_is_at_rest(begun, screen):
    frames, read = Numbers(20), []
    make = frames._frame
    frames._frame = lambda number: (read.append(number), make(number))[1]
    player = begun(frames)
    player.go_to(7)
    until(lambda: screen.shown == [0, 7])
    assert read == [0, 7]
    screen.may_go.clear()
    player.play()
    until(lambda: len(read) >= 5)  # while the first of them is held up
    screen.may_go.set()
    until(lambda: screen.ends == 1)
    assert screen.shown == [0, *range(7, 20)]


def test_it_goes_where_it_is_told_or_to_the_nearest_end_and_plays_on_from_there(begun, screen):
    player = begun(Numbers(20))
    for wanted, expected in ((1000, 19), (-7, 0), (17, 17)):
        player.go_to(wanted)
        until(lambda expected=expected: screen.shown[-1] == expected)
    assert not player.is_playing
    play_to_end(player, screen)
    assert screen.shown == [0, 19, 0, 17, 18, 19]


@pytest.mark.slow
def test_a_frame_that_a_pause_held_back_comes_when_it_goes_on(begun, screen):
    frames = Numbers(20)
    frames.rate_hz = 0.5  # two seconds a frame: the pause falls between the first and the second
    player = begun(frames)
    player.play()
    time.sleep(0.05)
    player.play(False)
    time.sleep(0.05)
    assert screen.shown == [0]
    frames.rate_hz = 1000.0
    player.play()
    until(lambda: screen.ends == 1)
    assert screen.shown == list(range(20))


def test_speed_is_that_of_the_frames_times_what_was_chosen(begun, screen):
    frames = Numbers(6)
    frames.rate_hz = 10.0
    player = begun(frames)
    player.set_speed(4.0)
    began = time.monotonic()
    player.play()
    until(lambda: screen.ends == 1)
    assert time.monotonic() - began >= 4 / 40  # five frames later, less what may be made up for


def test_error_ends_the_playing_and_is_told(begun, screen):
    player = begun(Numbers(bad=3))
    player.play()
    until(lambda: len(screen.errors) == 1)
    assert "frame 3 is gone" in str(screen.errors[0])
    assert screen.shown == [0, 1, 2]
    assert not player.is_playing


def test_live_source_plays_at_once_and_shows_nothing_while_it_is_paused(play, screen):
    player = play(Numbers(is_live=True))
    until(lambda: len(screen.shown) > 5)
    player.play(False)
    shown = len(screen.shown) + 1  # one may be under way
    time.sleep(0.05)
    assert len(screen.shown) <= shown
    player.play()
    until(lambda: len(screen.shown) > shown)
    assert screen.shown == sorted(set(screen.shown))
