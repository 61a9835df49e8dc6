import threading

import pytest
from dockpose.app.processing.background import CancelledError, LatestWorker, Progress


def test_part_of_a_work_stops_with_it():
    told = []
    whole = Progress(told.append)
    part = whole.silent()
    assert list(part.over([1, 2])) == [1, 2]
    assert told == []
    whole.stop()
    with pytest.raises(CancelledError):
        list(part.over([1]))


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
    record.may_go.set()
    assert worker.wait_until_idle(120)
    assert record.done == [0, 99]


def test_last_of_many_is_always_worked_on(worker, record):
    for job in range(5000):
        worker.submit(job)
    assert worker.wait_until_idle(120)
    assert record.done[-1] == 4999
    assert record.done == sorted(set(record.done))


def test_last_one_wins_from_many_threads(worker, record):
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


def test_wait_until_idle_says_when_it_took_too_long(worker, record):
    record.may_go.clear()
    worker.submit(0)
    assert not worker.wait_until_idle(0.05)


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


def test_after_a_job_it_rests_and_then_takes_the_newest(record):
    resting = LatestWorker(record, record.errors.append, lambda: 0.5)
    resting.submit("first")
    assert resting.wait_until_idle(120)
    resting.submit("superseded")
    resting.submit("newest")
    assert not resting.wait_until_idle(0.01)
    assert resting.wait_until_idle(120)
    assert record.done == ["first", "newest"]
    resting.close()


def test_closing_does_not_wait_for_the_rest(record):
    resting = LatestWorker(record, record.errors.append, lambda: 1e6)
    resting.submit("first")
    assert resting.wait_until_idle(120)
    resting.submit("never")
    resting.close()
    assert not resting._thread.is_alive()
    assert record.done == ["first"]


def test_job_waits_until_no_newer_one_comes(record):
    waiting = LatestWorker(record, record.errors.append, quiet_s=lambda: 0.3)
    for job in range(5):
        waiting.submit(job)
        assert not waiting.wait_until_idle(0.1)
    assert record.done == []
    assert waiting.wait_until_idle(120)
    assert record.done == [4]
    waiting.close()
