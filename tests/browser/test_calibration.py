"""A camera calibrated on the page, from pictures that are sent to it."""

import cv2
import numpy as np
import pytest
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options
from dockpose.camera.calibrate import Gathering

from tests.pipeline.camera.test_calibrate import CHESSBOARD, TRUE, pictures

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def app(tmp_path_factory):
    with App(port=0, options=Options(remember_in=tmp_path_factory.mktemp("settings"))) as running:
        yield running


@pytest.fixture
def tank(page):
    """The tab Calibrate with nothing gathered."""
    page.tab("Calibrate")
    page.press("Start over")
    page.until(lambda: page.page.locator("[data-board]").count() == 0)
    return page


def encoded(count):
    return [(name, cv2.imencode(".png", one)[1].tobytes()) for name, one in pictures(CHESSBOARD, TRUE, count)]


def card(page, name):
    return page.page.locator(f"[data-board='{name}']")


def test_many_boards_at_once_become_the_camera_in_use_and_a_click_drops_one(tank):
    boards = encoded(14)
    nothing = "wall.png", cv2.imencode(".png", np.full((480, 640), 90, np.uint8))[1].tobytes()
    clicks = ["Add pictures or a video", "Work out the camera", "Use this camera"]
    tank.send(clicks[0], *boards, nothing)
    card(tank, "wall.png").get_by_text("dropped: no board was found in it").wait_for()
    cards = tank.page.locator("[data-board]")
    assert cards.evaluate_all("all => all.map((one) => one.dataset.board)") == [
        *(name for name, _ in boards),
        "wall.png",
    ]
    gathering = Gathering(CHESSBOARD, distinct=True)
    for name, picture in pictures(CHESSBOARD, TRUE, 14):
        gathering.add(name, picture)
    used = [each.name for each in gathering.sightings]
    assert len(used) >= 10
    assert f"{len(used)} views" in tank.page.locator("#calibration-covered").inner_text()
    assert all(cards.evaluate_all("all => all.map((one) => one.querySelector('img').naturalWidth === 240)"))
    assert card(tank, "wall.png").is_disabled()
    tank.press(clicks[1])
    tank.page.locator(".calibration-line", has_text=f"{len(used)} of 15 pictures used").wait_for()
    errors = cards.locator("span").filter(has_text=" px over 54 corners")
    tank.until(lambda: errors.count() == len(used))
    bars = cards.locator("i").evaluate_all("all => all.map((one) => parseFloat(one.style.width))")
    assert max(bars) == 100
    assert sum(bar > 0 for bar in bars) == len(used)
    dropped = used[2]
    card(tank, dropped).click()
    card(tank, dropped).get_by_text("dropped: you dropped it").wait_for()
    tank.page.locator(
        ".calibration-line", has_text=f"{len(used) - 1} of 15 pictures used"
    ).wait_for()  # worked out again by itself
    card(tank, dropped).click()
    tank.page.locator(".calibration-line", has_text=f"{len(used)} of 15 pictures used").wait_for()
    tank.press(clicks[2])
    tank.until(lambda: tank.app.view.camera.fx == pytest.approx(TRUE.fx, rel=0.02))
    assert tank.app.view.camera_of == "tank"
