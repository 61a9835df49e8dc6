"""Work in the background, with controls that only remember what they are set to."""

import threading
from types import SimpleNamespace
from typing import Any

import pytest
from dockpose.app.web.work import BackgroundWork


class Gui:
    """Makes a progress bar and a button that show nothing."""

    def add_progress_bar(self, value, **more):
        return SimpleNamespace(value=value, visible=False)

    def add_button(self, label, **more):
        return SimpleNamespace(visible=False, on_click=lambda act: None)


@pytest.fixture
def errors():
    return []


@pytest.fixture
def task(errors):
    gui: Any = Gui()
    made = BackgroundWork(gui, lambda error, client: errors.append(error), lambda *words: None)
    yield made
    made.close()


def ended(task):
    running = task._running
    if running is not None:
        running[0].join(60)
    return not task._bar.visible and not task._stop.visible


def test_task_turns_others_away_and_can_be_cancelled(task, errors):
    begun, may_go, done = threading.Event(), threading.Event(), []

    def work(progress):
        for item in progress.over([1, 2]):
            begun.set()
            may_go.wait(60)
            done.append(item)

    assert task.start(work)
    assert not task.start(work)
    assert begun.wait(60)
    assert task._bar.visible
    task.cancel()
    may_go.set()
    assert ended(task)
    assert (done, errors) == ([1], [])


def test_task_reports_an_error_and_goes_on(task, errors):
    def fail(progress):
        raise ValueError("broke")

    assert task.start(fail)
    assert ended(task)
    assert [str(error) for error in errors] == ["broke"]
    assert task.start(lambda progress: None)
    assert ended(task)
