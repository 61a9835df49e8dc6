"""The strip made large for whoever looks from afar, and a source that goes and comes back."""

import pytest
from dockpose import Dock
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options
from dockpose.simulate import render

from tests.browser.conftest import visit
from tests.support.scenes import CAMERA, random_scene
from tests.support.streams import MjpegServer

pytestmark = pytest.mark.browser
SIZES = [(390, 844), (844, 390), (768, 1024), (1366, 768), (1920, 1080)]
PICTURE = render(random_scene(4, position_m=(0.1, -0.05, 1.2)))[0]
# What sticks out of the strip, which cuts it off.
FAULTS = """() => {
  const room = document.querySelector("#strip").getBoundingClientRect();
  return ["#strip-trust", "#place", "#strip-size"].filter((name) => {
    const one = document.querySelector(name), box = one.getBoundingClientRect();
    return box.right > room.right + 1 || box.bottom > room.bottom + 1 || one.scrollWidth > one.clientWidth + 1;
  });
}"""
LETTERS_PX = "() => parseFloat(getComputedStyle(document.querySelector('#place')).fontSize)"


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
        for wide, high in SIZES:
            page.set_viewport_size({"width": wide, "height": high})
            page.wait_for_function("wide => innerWidth === wide", arg=wide)
            page.evaluate("() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))")
            assert page.evaluate(FAULTS) == [], (wide, high)
            assert page.evaluate(LETTERS_PX) > small_px
        assert words(page, "#place") == told
        for wide, high in (SIZES[0], (1366, 768)):
            page.set_viewport_size({"width": wide, "height": high})
            page.wait_for_function("wide => innerWidth === wide", arg=wide)
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
