"""A camera in the tab Play in a real browser: what it took, its exposure, and a recording."""

import cv2
import numpy as np
import pytest
from dockpose import Dock
from dockpose.app.web.app import App
from dockpose.app.web.server.options import RECORDINGS_FOLDER, Options
from dockpose.simulate import render
from dockpose.sources import CaptureSettings, open_frames

from tests.browser.conftest import visit
from tests.support.cameras import V4l2Camera
from tests.support.scenes import CAMERA, random_scene

pytestmark = pytest.mark.browser


@pytest.fixture
def camera(browser, tmp_path, monkeypatch):
    """The tab Play of a page on a camera whose lights are saturated."""
    picture = render(random_scene(4, position_m=(0.0, 0.0, 0.8)))[0]
    bright = np.clip(6.0 * picture, 0, 255).astype(np.uint8)
    make = V4l2Camera.make([bright] * 5000, rates_hz=(20.0,), sizes=((640, 480),))
    monkeypatch.setattr(cv2, "VideoCapture", make)
    options = Options(sessions=tmp_path / "sessions", capture=CaptureSettings(exposure=120, format="MJPG"))
    with (
        App("0", CAMERA, Dock(0.30, 10), port=0, options=options) as running,
        visit(browser, running, accept_downloads=True) as page,
    ):
        page.open()
        page.tab("Source")
        yield page


def words(page):
    return page.page.locator("#live-source").inner_text()


def test_a_camera_is_asked_judged_and_recorded(camera, tmp_path):
    camera.until(lambda: "640 x 480 MJPG at 20 frames/s; exposure 120 asked, 117 set" in words(camera))
    camera.until(lambda: "lights are saturated: " in words(camera))
    camera.box("Exposure").fill("60")
    camera.box("Gain").fill("2")
    camera.rest()
    camera.press("Ask the camera")
    camera.until(lambda: "exposure 60 asked, 60 set; gain 2 asked, 2 set" in words(camera))
    camera.press("Record")
    camera.until(lambda: "Recording: 2" in words(camera) and " MB" in words(camera), 20)
    camera.page.screenshot(path=str(tmp_path / "recording.png"))
    camera.press("Stop recording")
    camera.until(lambda: " frames recorded, " in words(camera))
    (path,) = (tmp_path / RECORDINGS_FOLDER).iterdir()
    assert camera.download("Download the recording") == (path.name, path.read_bytes())
    with open_frames(str(path)) as frames:
        assert len(list(frames)) >= 20
