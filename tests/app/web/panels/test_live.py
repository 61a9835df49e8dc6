import time
from datetime import datetime
from typing import Any

import cv2
import numpy as np
import pytest
from dockpose import Dock
from dockpose.app.export.mavlink import Autopilot
from dockpose.app.export.recording import Recording
from dockpose.app.web.app import App
from dockpose.app.web.panels.live import recording_path, recording_words
from dockpose.app.web.server.options import RECORDINGS_FOLDER, Options
from dockpose.simulate import render
from dockpose.sources import Arrival, CaptureSettings, Frame, open_frames

from tests.support.cameras import V4l2Camera
from tests.support.clock import until
from tests.support.mavlink import receiving
from tests.support.scenes import CAMERA, random_scene

SMALL = CAMERA.for_size(320, 240)


@pytest.fixture
def opener(monkeypatch):
    """What opens a camera that shows a dock a metre ahead."""
    picture = render(random_scene(4, camera=SMALL, position_m=(0.0, 0.0, 1.0)))[0]
    make = V4l2Camera.make([picture] * 5000, rates_hz=(50.0,), sizes=((320, 240), (640, 480)))
    monkeypatch.setattr(cv2, "VideoCapture", make)
    return make


@pytest.fixture
def app(tmp_path, opener):
    """The page on a camera, which is asked for an exposure."""
    options = Options(sessions=tmp_path / "sessions", capture=CaptureSettings(exposure=120, format="MJPG"))
    with App("0", SMALL, Dock(0.30, 10), port=0, options=options) as running:
        running.camera = opener.last  # pyright: ignore[reportAttributeAccessIssue]
        yield running


def controls(app) -> Any:
    return app.sequence._camera


def test_what_the_camera_took_is_shown_and_can_be_changed(app):
    live = controls(app)
    assert app.player.frames.settings.width == 320  # of the tank that is known
    until(lambda: "320 x 240 MJPG at 50 frames/s; exposure 120 asked, 117 set" in live._words.content)
    assert [live._boxes[name].value for name in ("exposure", "gain", "rate_hz", "format")] == ["120", "", "", "MJPG"]
    live._boxes["exposure"].value, live._boxes["gain"].value = "50", "3"
    live.ask()
    until(lambda: "exposure 50 asked, 50 set; gain 3 asked, 3 set" in live._words.content)
    assert app.camera.size == (320, 240)


def test_a_recording_is_begun_counted_and_finished(app, tmp_path):
    live = controls(app)
    until(lambda: app.player.index > 2)
    assert live._record.visible
    assert live._record.label == "Record"
    live.record()
    assert live._record.label == "Stop recording"
    until(lambda: live._recording.frames > 20 and "Recording: " in live._words.content)
    live.stop()
    (path,) = (tmp_path / RECORDINGS_FOLDER).iterdir()
    assert f"{path}: " in live._words.content
    assert live._download.visible
    assert live._record.visible
    with open_frames(str(path)) as frames:
        found = list(frames)
    assert len(found) > 20
    assert np.diff([frame.index for frame in found]).max() == 1
    assert abs(time.time() - (found[-1].time_unix_s or 0)) < 30


def test_closing_the_camera_finishes_the_recording_and_hides_the_controls(app, tmp_path):
    live = controls(app)
    live.record()
    until(lambda: live._recording.frames > 5)
    app.sequence.close()
    (path,) = (tmp_path / RECORDINGS_FOLDER).iterdir()
    with open_frames(str(path)) as frames:
        assert len(list(frames)) > 5
    assert not any(control.visible for control in (live._record, live._ask, live._words))
    before = [*(tmp_path / RECORDINGS_FOLDER).iterdir()]
    live.record()  # as by a click that came late
    live.ask()
    assert [*(tmp_path / RECORDINGS_FOLDER).iterdir()] == before


def test_a_folder_that_cannot_be_made_is_said_and_the_camera_goes_on(app, tmp_path, monkeypatch):
    (tmp_path / RECORDINGS_FOLDER).write_text("a file in its place")
    told = []
    live = controls(app)
    monkeypatch.setattr(app, "notify", lambda title, sentence, colour, client: told.append(sentence))
    app.attempt(live.record, None)
    assert len(told) == 1
    assert "cannot be made" in told[0]
    index = app.player.index
    until(lambda: app.player.index > index + 2)


def test_names_of_recordings_are_never_taken_twice(tmp_path):
    now = datetime(2026, 7, 1, 12, 30, 5)
    first = recording_path(tmp_path, "camera 0", now)
    assert first.name == "2026-07-01_12-30-05_camera_0.mkv"
    first.touch()
    assert recording_path(tmp_path, "camera 0", now) not in (first, None)
    stream = recording_path(tmp_path, "rtsp://user:secret@10.0.0.5/a/../b", now)
    assert stream == tmp_path / "2026-07-01_12-30-05_rtsp_10_0_0_5_a_b.mkv"


def test_words_of_a_recording(tmp_path):
    kept = Recording(tmp_path / "a.mkv", [].append)
    for number in range(7):
        kept.take(Arrival(Frame(np.zeros((48, 64), np.uint8), number, number / 10, "camera 0")))
    until(lambda: kept.frames == 7)
    assert recording_words(kept, 12.3) == f"Recording: 7 frames in 12 s, {kept.size_bytes / 1e6:.1f} MB"
    kept.missing = 3
    assert recording_words(kept, 12.3).endswith("; 3 missing, which there was no time to write")
    kept.close()


def test_where_nothing_was_given_there_is_no_camera_to_ask(tmp_path):
    with App(port=0, options=Options(sessions=tmp_path / "sessions")) as running:
        assert controls(running) is None


@pytest.mark.extra
@pytest.mark.usefixtures("opener")
def test_what_goes_to_the_autopilot_is_switched_and_shown(tmp_path):
    with receiving() as received:
        autopilot = Autopilot(received.address, is_on=False)
        options = Options(sessions=tmp_path / "sessions", autopilot=autopilot)
        with App("0", SMALL, Dock(0.30, 10), port=0, options=options) as app:
            live = controls(app)
            until(lambda: autopilot.refused > 2)
            until(lambda: "nothing, switched off (0 frames sent" in live._words.content)
            assert live._sending.visible
            assert not live._sending.value
            live._sending.value = True
            live._switch()
            message = received.next("VISION_POSITION_ESTIMATE")
            assert np.linalg.norm([message[axis] for axis in "xyz"]) == pytest.approx(1.0, abs=0.05)
            until(lambda: "VISION_POSITION_ESTIMATE: 0." in live._words.content)
            app.sequence.close()
            assert not live._sending.visible


@pytest.mark.extra
@pytest.mark.usefixtures("opener")
def test_nothing_is_sent_while_the_dock_is_assumed(tmp_path):
    with receiving() as received:
        autopilot = Autopilot(received.address)
        options = Options(sessions=tmp_path / "sessions", autopilot=autopilot)
        with App("0", SMALL, port=0, options=options):
            until(lambda: autopilot.refused > 5)
            assert autopilot.words == "nothing: the dock is assumed"
            assert autopilot.sent == 0
