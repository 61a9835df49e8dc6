"""What the page says, where it says it, and that nothing moves meanwhile."""

import cv2
import numpy as np
import pytest
from dockpose.app.state.changes import with_method
from dockpose.app.state.view import with_sample

from tests.browser.conftest import LAPTOP, visit

pytestmark = pytest.mark.browser
PLACES = """() => ["#strip", "dockpose-jobs",
    "dockpose-picture .stage", "#candidates", "[role=tab]", "dockpose-picture button"]
  .flatMap((name) => [...document.querySelectorAll(name)]).map((one) => one.getBoundingClientRect())
  .map(({ left, top, width, height }) =>
    [left, top, width, height].map((part) => Math.round(10 * part) / 10).join(" "))"""


def png(picture):
    return cv2.imencode(".png", picture)[1].tobytes()


def notices(page):
    return [text for text in page.page.get_by_role("alert").all_inner_texts() if "WebGL" not in text]


def sample(page, name):
    page.app.change(lambda view: with_sample(view, name), reload=True)
    page.until(lambda: f" in {name} (" in page.status and page.app.wait_until_idle(0.1))
    page.rest()


@pytest.mark.parametrize("wide", [1100, LAPTOP[0], 1920])
def test_however_long_the_words_are_nothing_moves(page, resized, wide):
    resized((wide, 768))
    found = set()
    for name in ("plain", "mirror", "harbour_glare", "side_glow"):
        sample(page, name)
        found.add(page.page.locator("#strip").bounding_box()["height"])
        cut = "(one) => one.scrollHeight > one.clientHeight + 1 || one.scrollWidth > one.clientWidth + 1"
        assert not any(one.evaluate(cut) for one in page.page.locator("#strip, #strip-origin > div").all())
    assert len(found) == 1


def test_no_press_of_a_tool_moves_another(page):
    page.page.mouse.move(5, 5)
    before = page.page.evaluate(PLACES)
    for name in ("contrast", "ruler", "ruler", "thresholded", "annotated", "contrast"):
        page.page.locator(f"dockpose-picture [data-do={name}]").click()
        page.rest()
        shown = page.page.evaluate(PLACES)
        assert len(shown) == len(before)
        assert shown == before or name == "thresholded"  # which has no layers


def test_large_figures_give_the_reason_and_are_left_by_escape(page):
    page.app.change(lambda view: with_method(view, "fixed", 255), reload=True)
    page.until(lambda: "No pose" in page.status)
    page.page.locator("#strip-size").click()
    words = page.page.locator("#strip [role=status]")
    assert words.is_visible()
    assert "Try " in words.inner_text()
    page.page.keyboard.press("Escape")
    page.page.locator("html:not(.large)").wait_for(state="attached")


def test_a_picture_in_which_nothing_is_bright_is_said_in_words(page):
    page.upload("black.png", png(np.zeros((120, 160), np.uint8)))
    page.until(lambda: " in black.png (" in page.status)
    told = page.page.get_by_label("grey level under the pointer")
    page.until(lambda: told.inner_text() == "Nothing is bright enough: no level keeps a light.")


def test_a_file_that_is_refused_is_what_is_seen(page):
    page.send("Load a camera file", ("cam.yaml", b"nonsense: 1\n"))
    refused = page.page.get_by_role("alert").filter(has_text="cam.yaml: is not a camera file")
    refused.wait_for()
    page.until(lambda: [one for one in page.page.get_by_role("alert").all() if one.is_visible()] != [])
    seen = [one.inner_text() for one in page.page.get_by_role("alert").all() if one.is_visible()]
    assert all("uploaded successfully" not in text for text in seen)


def test_lights_that_cannot_be_set_are_refused_once_at_the_picture(page):
    page.app.change(lambda view: with_sample(view, "plain"), reload=True)
    page.page.locator("dockpose-picture [data-do=hand]").click()
    stage = page.page.locator("dockpose-picture .stage").bounding_box()
    before = notices(page)
    for step in range(3):  # ten are found, and the dock has ten
        page.page.mouse.click(stage["x"] + 60 + 40 * step, stage["y"] + stage["height"] - 90)
        page.page.locator(".refused", has_text="11 lights are set, and the dock has 10").wait_for()
    assert page.page.locator(".refused").count() == 1
    assert page.page.locator("dockpose-picture .frame").evaluate("one => getComputedStyle(one).opacity") == "1"
    assert set(notices(page)) <= set(before)  # those of before may have gone meanwhile
    page.page.locator("dockpose-picture [data-do=hand]").click()
    page.page.locator(".refused").wait_for(state="detached")


def test_compare_says_that_it_works_and_shows_no_empty_box(browser, app):
    with visit(browser, app) as page:
        page.open()
        page.page.evaluate("() => { viserPage.type = () => {}; }")  # nothing is asked for, so that it stays at work
        page.tab("Compare")
        page.page.get_by_text("Working: every method is tried on this picture").wait_for()
        assert not page.page.locator("dockpose-compare canvas").first.is_visible()


def test_every_button_has_a_name_also_that_of_a_notice(page):
    page.app.notify("A title", "A sentence.", "yellow", None)
    page.page.get_by_role("button", name="Close this notice").wait_for()


def test_the_answer_of_the_tape_is_seen_where_it_was_asked_for(page):
    page.tab("Log")
    check = page.page.get_by_role("button", name="Check against the tape")
    for number in range(1, 7):
        page.box("z (cm)").fill(str(109.8 + 0.1 * (number % 3)))
        page.page.keyboard.press("Control+Enter")
        page.page.locator(f"#experiment-rows tr[data-row='{number}']").wait_for()
    check.click()
    page.page.locator("#check").wait_for()
    answer, notice = page.page.locator("#check").bounding_box(), LAPTOP[1] - 90
    assert check.bounding_box()["y"] + check.bounding_box()["height"] < answer["y"]
    assert answer["y"] + answer["height"] < notice  # where notices stand
    page.choose("Session", "(none)")


def test_what_is_under_the_pointer_is_not_told_of_an_old_frame(page):
    page.page.locator("dockpose-picture .stage").hover(position={"x": 200, "y": 200})
    told = page.page.get_by_label("pixel under the pointer")
    page.until(lambda: "grey" in told.inner_text())
    page.choose("Sequence", "simulated approach")
    page.page.locator("dockpose-picture .stage").hover(position={"x": 220, "y": 220})
    page.page.locator("dockpose-timeline").get_by_role("button", name="Play", exact=True).press("Enter")
    page.until(lambda: told.inner_text() == "")
    page.page.keyboard.press("k")
    page.choose("Sequence", "(none)")
