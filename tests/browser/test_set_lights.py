"""Lights that are set by hand in the picture, by mouse, keys and finger."""

import numpy as np
import pytest
from dockpose.app.state.changes import with_set_lights
from dockpose.app.state.view import open_source
from dockpose.sidecar import sample_path
from dockpose.simulate import load_scene, truth_of

from tests.browser.conftest import visit
from tests.browser.test_view import STAGE, button, drag, on_screen, press

pytestmark = pytest.mark.browser

TRUTH_PX = truth_of(load_scene(sample_path("plain").with_suffix(".yaml"))).lights_px


@pytest.fixture
def hand(page):
    """The page with the tool in hand and no lights."""
    press(page, "hand")
    press(page, "clear")
    page.until(lambda: told(page) == 0)
    yield page
    page.page.locator(STAGE).press("Escape")
    page.app.change(lambda view: with_set_lights(view, None, None))


def told(page):
    """How many lights the program has heard of, once it has looked at them."""
    lights = page.app.view.set_lights
    return None if lights is None or not page.app.wait_until_idle(0.1) else len(lights.lights_px)


def squares(page):
    return page.page.locator("dockpose-picture .found rect.light").count()


def click(page, point):
    place = on_screen(page, *point)
    page.page.mouse.move(*place)
    page.page.mouse.click(*place)


def test_ten_clicks_beside_the_lights_give_the_pose(hand):
    for number, point in enumerate(TRUTH_PX, 1):
        click(hand, point + [1.4, -1.1])
        hand.until(lambda number=number: told(hand) == number and squares(hand) == number)
        if number < 3:
            hand.until(lambda: "a pose needs 3" in hand.status)
    hand.until(lambda: hand.z_cm == 110.0)
    assert hand.page.locator("dockpose-picture .loupe").is_visible()
    assert hand.trust == "amber"
    assert "The lights were set by hand" in hand.status
    np.testing.assert_allclose(hand.app._current.estimate.markers.points_px, TRUTH_PX, atol=0.1)


def test_clicks_faster_than_the_program_lose_no_light(hand):
    places = [on_screen(hand, *point) for point in TRUTH_PX]
    for place in places:
        hand.page.mouse.click(*place)
    hand.until(lambda: told(hand) == 10 and squares(hand) == 10)


def test_a_picture_that_is_built_after_a_spot_was_told_is_whole(hand):
    hand.page.mouse.move(*on_screen(hand, *TRUTH_PX[3]))
    hand.until(lambda: hand.page.locator("dockpose-picture .draft .spot").count() == 1)
    built = hand.page.evaluate(
        """() => {
          const [old, fresh] = [document.querySelector("dockpose-picture"), document.createElement("dockpose-picture")];
          fresh.setAttribute("channel", old.getAttribute("channel"));
          old.replaceWith(fresh);
          const built = fresh.querySelectorAll("[data-do]").length;
          fresh.replaceWith(old);
          return built;
        }"""
    )
    assert built == hand.page.locator("dockpose-picture [data-do]").count()


def test_a_light_whose_message_is_lost_is_told_again(hand):
    hand.page.evaluate(
        """() => {
          const post = Worker.prototype.postMessage;
          Worker.prototype.postMessage = function (message, ...rest) {
            const isLost = JSON.stringify(message?.message?.updates ?? "").includes("lights");
            if (isLost) Worker.prototype.postMessage = post;
            else post.call(this, message, ...rest);
          };
        }"""
    )
    click(hand, TRUTH_PX[0])
    hand.until(lambda: told(hand) == 1 == squares(hand))


def test_a_light_is_taken_away_moved_and_set_exactly(hand):
    for number, point in enumerate(TRUTH_PX[:5], 1):
        click(hand, point)
        hand.until(lambda number=number: squares(hand) == number)
    click(hand, TRUTH_PX[0])
    hand.until(lambda: squares(hand) == 4 == told(hand))
    drag(hand, on_screen(hand, *TRUTH_PX[1]), on_screen(hand, *TRUTH_PX[7]))
    hand.until(lambda: np.hypot(*(hand.app._current.estimate.markers.points_px[0] - TRUTH_PX[7])) < 0.1)
    hand.page.keyboard.down("Shift")
    click(hand, (100, 60))
    hand.page.keyboard.up("Shift")
    hand.until(lambda: told(hand) == 5)
    np.testing.assert_allclose(hand.app.view.set_lights.lights_px[-1], (100, 60), atol=1)
    assert hand.app.view.set_lights.snap == (True, True, True, True, False)


def test_keys_set_a_light_move_it_by_tenths_and_undo_it(hand):
    stage = hand.page.locator(STAGE)
    stage.press("ArrowRight")
    stage.press("Shift+Enter")
    hand.until(lambda: told(hand) == 1)
    start = np.array(hand.app.view.set_lights.lights_px[0])
    for _ in range(3):
        stage.press("ArrowLeft")
    stage.press("Shift+ArrowDown")
    hand.until(lambda: np.allclose(hand.app.view.set_lights.lights_px[0], start + [-0.3, 1.0]))
    hand.page.keyboard.press("Control+z")
    hand.until(lambda: np.allclose(hand.app.view.set_lights.lights_px[0], start))
    hand.page.keyboard.press("Control+z")
    hand.until(lambda: told(hand) == 0)
    hand.page.keyboard.press("Control+Shift+z")
    hand.until(lambda: told(hand) == 1 == squares(hand))
    stage.press("Shift+Enter")  # takes hold of it again
    stage.press("Delete")
    hand.until(lambda: told(hand) == 0)


def test_the_search_has_its_lights_again_and_the_first_edit_begins_with_them(page):
    press(page, "hand")
    click(page, TRUTH_PX[3])
    page.until(lambda: told(page) == 9 and squares(page) == 9)
    press(page, "search")
    page.until(lambda: page.app.view.set_lights is None and squares(page) == 0)
    page.until(lambda: page.trust == "green")
    page.page.locator(STAGE).press("Escape")
    assert not button(page, "clear").is_visible()


def test_another_browser_and_a_reload_show_the_lights(hand, browser):
    for number, point in enumerate(TRUTH_PX[:6], 1):
        click(hand, point)
        hand.until(lambda number=number: told(hand) == number)
    hand.until(lambda: squares(hand) == 6)
    with visit(browser, hand.app) as other:
        other.open()
        other.until(lambda: squares(other) == 6)
        press(other, "hand")
        click(other, TRUTH_PX[7])
        other.until(lambda: squares(other) == 7)
        hand.until(lambda: squares(hand) == 7)
        other.page.reload()
        other.until(lambda: squares(other) == 7)
        assert other.errors == []


def test_a_finger_sets_lights(browser, app):
    app.change(lambda _: open_source(None, None, None), reload=True)
    with visit(browser, app, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True) as page:
        page.open()
        page.until(lambda: app.wait_until_idle(0.1) and page.z_cm == 110.0)
        for name in ("hand", "clear"):
            button(page, name).tap()
        page.until(lambda: told(page) == 0)
        for number, point in enumerate(TRUTH_PX[:4], 1):
            page.page.touchscreen.tap(*on_screen(page, *point))
            page.until(lambda number=number: told(page) == number and squares(page) == number)
        page.page.touchscreen.tap(*on_screen(page, *TRUTH_PX[0]))
        page.until(lambda: told(page) == 3)
    app.change(lambda view: with_set_lights(view, None, None))
