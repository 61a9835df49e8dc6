"""A camera calibrated on the page, from pictures that are sent to it."""

import cv2
import pytest
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options

from tests.pipeline.camera.test_calibrate import CHESSBOARD, TRUE, pictures

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def app(tmp_path_factory):
    with App(port=0, options=Options(remember_in=tmp_path_factory.mktemp("settings"))) as running:
        running.memory.change(shows_first_card=False)
        yield running


def test_uploaded_boards_become_the_camera_in_use(page):
    page.tab("Tank")
    page.page.get_by_text("Calibrate the camera", exact=True).click()
    for name, picture in pictures(CHESSBOARD, TRUE, 6):
        page.send("Add a picture or video of the board", (name, cv2.imencode(".png", picture)[1].tobytes()))
        page.page.locator("#calibration-seen", has_text=f"{name}: board seen and taken").wait_for()
    assert "6 views" in page.page.locator("#calibration-covered").inner_text()
    page.page.get_by_role("button", name="Work out the camera").click()
    page.page.locator(".calibration-line", has_text="fx 5").wait_for()
    assert page.page.locator("#calibration-pictures tbody tr").count() == 6
    page.page.get_by_role("button", name="Drop it, or take it back").click()
    page.page.locator("#calibration-pictures", has_text="dropped: you dropped it").wait_for()
    page.page.get_by_role("button", name="Work out the camera").click()
    page.page.locator(".calibration-line", has_text="5 of 6 pictures used").wait_for()
    page.page.get_by_role("button", name="Use this camera").click()
    page.until(lambda: page.app.view.camera.fx == pytest.approx(TRUE.fx, rel=0.02))
    assert page.app.view.camera_of == "tank"
