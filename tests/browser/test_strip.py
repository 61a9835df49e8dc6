"""The strip made large for whoever looks from afar, and a source that goes and comes back."""

from dataclasses import replace

import pytest
from dockpose import Dock
from dockpose.app.state.changes import with_mask, with_method
from dockpose.app.state.tank import Tank
from dockpose.app.state.view import with_sample, with_upload
from dockpose.app.web.app import App
from dockpose.app.web.panels.picture import StripPanel
from dockpose.app.web.server.options import Options
from dockpose.sidecar import sample_path
from dockpose.simulate import render

from tests.browser.conftest import visit
from tests.support.scenes import CAMERA, random_scene
from tests.support.streams import MjpegServer

pytestmark = pytest.mark.browser
PICTURE = render(random_scene(4, position_m=(0.1, -0.05, 1.2)))[0]
LETTERS_PX = "() => parseFloat(getComputedStyle(document.querySelector('#place')).fontSize)"

# Which of the verdict, the figures and the words is cut off, covered, or beneath what follows upon the strip.
CUT = """() => ["#strip-trust", "#place", "#strip [role=status]"].filter((name) => {
  const one = document.querySelector(name);
  const below = document.querySelector("dockpose-jobs").getBoundingClientRect().top;
  const texts = [one, ...one.querySelectorAll(":not(.heard, .heard *)")].flatMap((part) => [...part.childNodes])
    .filter((node) => node.nodeType === Node.TEXT_NODE && node.textContent.trim() !== "");
  const lines = texts.flatMap((text) => {
    const range = document.createRange();
    range.selectNodeContents(text);
    return [...range.getClientRects()].filter((line) => line.width > 1);
  });
  const isFree = (x, y) => one.contains(document.elementFromPoint(x, y));
  return lines.length === 0 || lines.some(({ left, right, top, bottom }) => left < 0 || right > innerWidth || top < -1
    || bottom > below + 1 || !isFree((left + right) / 2, (top + bottom) / 2)) || one.scrollWidth > one.clientWidth + 1;
})"""
PICTURED = {
    "green": lambda view: with_sample(view, "tilted"),
    "lost": lambda view: with_method(with_sample(view, "plain"), "fixed", 255),
    "three chips": lambda view: with_mask(with_method(with_sample(view, "plain"), "fixed", 255), 0, 0, 50, 50),
    "assumed": lambda view: with_upload(
        replace(with_method(view, "hats"), tank=Tank()), sample_path("tilted").read_bytes(), "own.png"
    ),
}


@pytest.mark.parametrize("is_large", [False, True], ids=["small", "large"])
def test_verdict_figures_and_reasons_are_whole_at_every_width_and_nothing_is_over_them(browser, is_large):
    sizes = [(390, 844), (844, 390), (820, 1180), (1024, 768), (1366, 768), (1920, 1080)]
    with App(port=0) as app, visit(browser, app) as seen:
        seen.open()
        if is_large:
            seen.page.get_by_role("button", name="Large figures").click()
        for name, pictured in PICTURED.items():
            before = seen.page.locator("#source").inner_text()
            app.change(pictured, reload=True)
            assert app.wait_until_idle(60)
            wanted = app.view.source
            seen.until(lambda before=before, wanted=wanted: wanted == seen.page.locator("#source").inner_text())
            for is_stale in (False, True):
                app._layout.of(StripPanel).say_stale(125 * is_stale)
                seen.until(lambda is_stale=is_stale: seen.page.locator("#strip[data-stale]").count() == is_stale)
                for wide, high in sizes:
                    seen.page.set_viewport_size({"width": wide, "height": high})
                    seen.page.wait_for_function("wide => innerWidth === wide", arg=wide)
                    seen.rest()
                    assert seen.page.evaluate(CUT) == [], (name, is_stale, wide)


def test_words_have_room_beneath_the_figures_and_the_next_step_is_a_button(browser):
    with App(port=0) as app, visit(browser, app) as seen:
        seen.open()
        cut = "all => all.filter((one) => one.scrollWidth > one.clientWidth).map((one) => one.textContent)"
        for name in ("assumed", "three chips", "green", "lost"):
            app.change(PICTURED[name], reload=True)
            assert app.wait_until_idle(60)
            seen.until(lambda: app.view.source in seen.page.locator("#source").inner_text())
            seen.until(lambda: seen.page.locator("#strip").bounding_box()["height"] == 68)
            assert seen.page.locator("dockpose-jobs .chip").evaluate_all(cut) == []
        following = seen.page.locator("dockpose-jobs .next")
        assert following.inner_text() == "Look at all methods"
        following.click()
        seen.page.locator("dockpose-compare").wait_for()
        seen.until(lambda: seen.page.get_by_role("tab", name="Compare").get_attribute("aria-selected") == "true")


def words(page, selector):
    return page.locator(selector).inner_text().strip()


def test_a_browser_makes_the_strip_large_at_every_size_and_small_again(browser):
    with App(port=0) as app, visit(browser, app) as seen:
        page = seen.page
        page.goto(app.address)
        page.locator("#strip", has_text="Dock found").wait_for()
        told = words(page, "#place")
        assert told.startswith("1.10 m")
        small_px = page.evaluate(LETTERS_PX)
        page.get_by_role("button", name="Large figures").click()
        for wide, high in ((390, 844), (844, 390), (1366, 768)):
            page.set_viewport_size({"width": wide, "height": high})
            page.wait_for_function("wide => innerWidth === wide", arg=wide)
            assert page.evaluate(LETTERS_PX) > small_px
            assert words(page, "#place") == told
            page.get_by_role("button", name="Large figures").click()  # small
            page.get_by_role("button", name="Large figures").click()  # and large, for it is still within reach
        page.get_by_role("button", name="Large figures").click()
        assert page.evaluate(LETTERS_PX) == small_px


def test_a_source_that_gives_no_more_is_told_and_forgotten_when_it_is_back(browser, tmp_path):
    with MjpegServer([PICTURE], 10) as server:
        port, address = server.port, server.address
        app = App(address, CAMERA, Dock(0.30, 10), port=0, options=Options(remember_in=tmp_path))
        with app, visit(browser, app) as operator:
            operator.open()
            operator.page.locator("#strip:not([data-stale])", has_text="Dock found").wait_for()
            server.close()
            operator.page.locator("#strip[data-stale] #strip-trust", has_text="No new picture for ").wait_for()
            assert "Dock found" not in words(operator.page, "#strip-trust")
            with MjpegServer([PICTURE], 10, port):
                operator.page.locator("#strip:not([data-stale])", has_text="Dock found").wait_for()
