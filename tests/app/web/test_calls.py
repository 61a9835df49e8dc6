"""How much work one slider move is: calls of Python functions of ours, in all threads."""

import asyncio
import sys
import threading
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

import dockpose
import dockpose.app
import pytest
from dockpose.app.web.app import App
from dockpose.app.web.panels.tank import CameraPanel

OURS = tuple(str(Path(package.__file__ or "").resolve().parent) for package in (dockpose, dockpose.app))
BEFORE = 1097  # calls when the lights were searched for with each move, and sentences painted that had not changed
TIMEOUT_S = 300
BY_THE_CLOCK = ("dockpose age",)  # threads that look every so often, whatever is moved
BROWSER = SimpleNamespace(client_id=1)


class Calls(Counter):
    """Counts calls by function while it is entered; threads that began with it are counted, too."""

    is_counting = False

    def profile(self, frame, event, argument):
        code = frame.f_code
        is_ours = event == "call" and code.co_filename.startswith(OURS)
        if self.is_counting and is_ours and threading.current_thread().name not in BY_THE_CLOCK:
            self[code.co_filename, code.co_name] += 1

    def __enter__(self):
        self.clear()
        self.is_counting = True

    def __exit__(self, *error):
        self.is_counting = False


@pytest.fixture(scope="module")
def calls():
    counted, before = Calls(), sys.getprofile()
    threading.setprofile(counted.profile)
    sys.setprofile(counted.profile)
    yield counted
    threading.setprofile(None)
    sys.setprofile(before)


@pytest.fixture(scope="module")
def app(calls):
    with App(port=0) as running:
        assert running.wait_until_idle(TIMEOUT_S)
        yield running


def wait(app):
    """Wait without a call of ours."""
    end_s = time.monotonic() + TIMEOUT_S
    while any(worker._waiting or worker._is_busy for worker in (app._worker, app._scene_worker)):
        assert time.monotonic() < end_s
        time.sleep(0.01)


def move(app, value):
    """Move the slider of the diameter as a person does."""
    slider = app._layout.of(CameraPanel).sliders["diameter_cm"].handle
    slider.value = value
    slider._impl.sync_cb(1, {"value": value})  # type: ignore[misc]
    for function in slider._impl.update_cb:
        coroutine = function(SimpleNamespace(client=BROWSER, target=slider))  # type: ignore[arg-type]
        if coroutine is not None:
            asyncio.run(coroutine)
    wait(app)


def test_a_move_makes_three_fifths_of_the_calls_that_it_made(app, calls):
    move(app, 40)
    with calls:
        move(app, 45)
    assert app._current.view.dock.diameter == pytest.approx(0.45)
    assert sum(calls.values()) <= BEFORE * 3 / 5, calls.most_common(40)
