"""That all of the page shows the same frame, by what is sent to the browsers; and what is sent of a course."""

import base64
import contextlib
import json
import re
import time
from dataclasses import replace
from html import unescape

import cv2
import numpy as np
import pytest
from dockpose.app.drawing.numbers import pose_cells
from dockpose.app.processing.analysis import Trajectory
from dockpose.app.web.app import App
from dockpose.app.web.panels.play import course_points

from tests.app.processing.test_analysis import LOST, frame, seen

FRAMES = 12


class Sent:
    """Records what a server sends: ``updates`` holds a list of messages for each atomic block."""

    def __init__(self, server, monkeypatch):
        self._sockets = sockets = server._websock_server
        self._queue, self._atomic = sockets.queue_message, sockets.atomic
        self._depth, self.updates, self.loose = 0, [], []
        monkeypatch.setattr(sockets, "queue_message", self._note)
        monkeypatch.setattr(sockets, "atomic", self._block)

    def _note(self, message):
        (self.updates[-1] if self._depth else self.loose).append(message)
        self._queue(message)

    @contextlib.contextmanager
    def _block(self):
        if self._depth == 0:
            self.updates.append([])
        self._depth += 1
        try:
            with self._atomic():
                yield
        finally:
            self._depth -= 1


@pytest.fixture
def app():
    with App(port=0) as running:
        assert running.wait_until_idle(120)
        yield running


def played(app, monkeypatch):
    """What was found in each frame, and what was sent while a course was played."""
    app.sequence.choose("simulated sweep", None)
    player, found = app.sequence.player, {}
    while player.index < 0 or not app.wait_until_idle(120):
        time.sleep(0.01)
    read = app.sequence.follower.read

    def noted(view, frame):
        analysis = found[frame.index] = read(view, frame)
        return analysis

    monkeypatch.setattr(app.sequence.follower, "read", noted)
    sent = Sent(app.server, monkeypatch)
    app.sequence.play(True)
    while player.index < FRAMES:
        time.sleep(0.01)  # or this loop takes the time of the player's
        assert app.wait_until_idle(120)
    app.sequence.play(False)
    assert app.wait_until_idle(120)
    return found, sent


def frame_numbers(update):
    """Number of the frame that each part of an update shows, by the part."""
    numbers = {}
    for message in update:
        changes = getattr(message, "updates", {})
        content = str(changes.get("content", ""))
        if (page := page_in(content)) is not None:
            numbers["overlay"] = page["overlay"]["frame"]
            numbers["status"] = int(re.findall(r"frame (\d+) of", page["html"]["status"])[0])
            numbers["words"] = int(re.findall(r"Frame (\d+) of", page["timeline"]["words"])[0])
            numbers["time line"] = 1 + page["timeline"]["at"]
            numbers["course"] = 1 + page["timeline"]["points"][-1][0]  # of its newest point
    return numbers


def page_in(content):
    """What is sent of a frame to be shown at one moment, if these are such data."""
    data = re.fullmatch(r'<dockpose-data name="page" hidden>(.*)</dockpose-data>', content)
    page = None if data is None else json.loads(unescape(data[1]))
    return page if page is not None and page["overlay"]["frame"] is not None else None


def page_of(message):
    return page_in(str(getattr(message, "updates", {}).get("content", "")))


def pictures_of(update):
    contents = [str(getattr(message, "updates", {}).get("content", "")) for message in update]
    datas = [re.search(r'name="picture".*"data":"([^"]*)"', content) for content in contents]
    pixels = [np.frombuffer(base64.b64decode(data[1]), np.uint8) for data in datas if data]
    return [np.asarray(cv2.imdecode(one, cv2.IMREAD_GRAYSCALE)) for one in pixels]


def positions(update):
    """Where pose A is put in 3D."""
    return [one.position for one in update if getattr(one, "name", "") == "/pose_a" and hasattr(one, "position")]


def differ(one, other):
    return float(np.abs(one.astype(float) - other).mean())


@pytest.mark.slow
def test_each_update_holds_one_frame_in_all_panels_and_in_3d(app, monkeypatch):
    found, sent = played(app, monkeypatch)
    numbered = [(frame_numbers(update).get("status"), update) for update in sent.updates]
    shown = list({number: update for number, update in reversed(numbered) if number}.values())  # at rest it comes again
    assert len(shown) > FRAMES / 3
    assert not any(frame_numbers([message]) for message in sent.loose)
    for update in shown:
        numbers = frame_numbers(update)
        number = numbers["status"]
        assert numbers == dict.fromkeys(("status", "overlay", "words", "time line", "course"), number)
        analysis = found[number - 1]
        (picture,) = pictures_of(update)
        assert min(found, key=lambda index: differ(picture, found[index].view.image)) == number - 1
        (page,) = filter(None, (page_in(getattr(one, "updates", {}).get("content", "")) for one in update))
        assert all(
            f">{cell}</td>" in page["html"]["candidates"] for cell in pose_cells(analysis.estimate.candidates[0])
        )
        (position,) = positions(update)
        np.testing.assert_allclose(position, analysis.estimate.candidates[0].position_m, rtol=1e-6)
    others = [update for update in sent.updates if "status" not in frame_numbers(update)]
    assert not any(getattr(message, "name", "") == "/pose_a" for update in others for message in update)


@pytest.mark.slow
def test_browser_that_draws_slowly_sees_no_3d_scene_while_playing_and_the_right_one_at_rest(app, monkeypatch):
    app._pacing.draws_slowly = lambda: True
    found, sent = played(app, monkeypatch)
    pages = [page for update in sent.updates for page in map(page_of, update) if page is not None]
    hidden = [page["hidesScene"] for page in pages]
    assert hidden[0]
    assert not hidden[-1]
    assert hidden == sorted(hidden, reverse=True)  # once it is seen again, it stays
    for update in sent.updates:
        page = next(filter(None, map(page_of, update)), None)
        assert page is None or not page["hidesScene"] or not positions(update)
    position = [position for update in sent.updates for position in positions(update)][-1]
    newest = found[app._newest.tracked_frame.frame.index].estimate
    np.testing.assert_allclose(position, newest.candidates[0].position_m, rtol=1e-6)
    assert f"frame {app._newest.tracked_frame.frame.index + 1} of" in app.view.source
    assert app.scene._poses[0].frame.visible


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
