"""The pilot view on a phone, by the link for viewers, beside the operator's page; a source that goes and comes back."""

import contextlib
from dataclasses import replace

import pytest
from dockpose import Dock, Entrance
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options
from dockpose.simulate import render

from tests.browser.conftest import visit
from tests.support.scenes import CAMERA, random_scene
from tests.support.streams import MjpegServer

pytestmark = pytest.mark.browser
SIZES = [(390, 844), (844, 390), (768, 1024), (1366, 768), (1920, 1080)]
PICTURE = render(random_scene(4, position_m=(0.1, -0.05, 1.2)))[0]
# Elements that stick out of the window, those that lie over each other, and words over what is drawn.
FAULTS = """() => {
  const all = [...document.querySelectorAll("#trust, #age, #target, a, b, i, svg.cross, svg.corridor")];
  const boxes = all.map((one) => [one, one.getBoundingClientRect()]).filter(([, box]) => box.width > 0);
  const isOut = ([, box]) => Math.min(box.left, box.top) < -1
    || box.right > innerWidth + 1 || box.bottom > innerHeight + 1;
  const shared = (one, other, low, high) => Math.min(one[high], other[high]) - Math.max(one[low], other[low]) > 2;
  const isOver = ([one, box]) => boxes.some(([other, its]) => one !== other
    && shared(box, its, "left", "right") && shared(box, its, "top", "bottom"));
  const isOnLine = ([word, box]) => [...word.parentNode.querySelectorAll("path, circle")].some((shape) => {
    const toShape = shape.getScreenCTM().inverse();
    for (let y = box.top; y <= box.bottom; y += 1) {
      for (let x = box.left; x <= box.right; x += 1) {
        const point = new DOMPoint(x, y).matrixTransform(toShape);
        if (shape.isPointInStroke(point) || (!shape.matches(".axis") && shape.isPointInFill(point))) return true;
      }
    }
    return false;
  });
  const drawn = [...document.querySelectorAll("svg text")].map((one) => [one, one.getBoundingClientRect()]);
  const found = boxes.filter((one) => isOut(one) || isOver(one)).concat(drawn.filter(isOnLine));
  return found.map(([one]) => one.outerHTML.slice(0, 80));
}"""


@contextlib.contextmanager
def pilot_of(browser, app, size):
    with visit(browser, app, viewport={"width": size[0], "height": size[1]}) as seen:
        seen.page.goto(app.addresses(for_viewers=True)[0].replace("/?", "/pilot?"))
        yield seen.page


def fits_at_every_size(page):
    for wide, high in SIZES:
        page.set_viewport_size({"width": wide, "height": high})
        page.wait_for_function("wide => innerWidth === wide", arg=wide)
        page.evaluate("() => new Promise((done) => setTimeout(() => requestAnimationFrame(done), 300))")
        assert page.evaluate(FAULTS) == [], (wide, high)


def words(page, selector="#trust"):
    return page.locator(selector).inner_text().strip()


def test_the_pilot_sees_the_figures_at_every_size_and_changes_nothing(browser):
    with App(port=0, options=Options(view_link=True)) as app, pilot_of(browser, app, SIZES[0]) as page:
        page.get_by_text("Dock found", exact=True).wait_for()
        told = [words(page, f"[data-figure={name}]") for name in ("ahead", "across", "along", "pitch", "yaw")]
        assert told == ["1.10 m", "6 cm", "4 cm", "6°", "-12°"]
        assert page.locator("#figures i").all_inner_texts()[:3] == ["ahead", "right", "up"]
        assert page.locator(".ring:not(.inside)").count() == 1  # 30 cm off the axis, and 27 are allowed there
        assert page.locator(".corridor .way").count() == page.locator(".corridor .vehicle").count() == 2
        assert "Not live · plain" in words(page, "#age")
        assert page.get_by_role("button").count() == page.locator("input").count() == 0
        fits_at_every_size(page)
        app.change(lambda view: replace(view, dock=Dock(0.3, 10, entrance=Entrance(cone_deg=5.0))), reload=True)
        page.get_by_text("to the stand-off").wait_for()
        assert words(page, "[data-angle=yaw]") == "yaw off"
        assert words(page, "[data-figure=ahead]") != "1.10 m"
        fits_at_every_size(page)
        page.get_by_role("link", name="Leave").click()
        page.locator("#view-only").wait_for()


def test_a_source_that_gives_no_more_is_told_to_pilot_and_operator_and_forgotten_when_it_is_back(browser, tmp_path):
    options = Options(view_link=True, remember_in=tmp_path)
    with MjpegServer([PICTURE], 10) as server:
        port, address = server.port, server.address
        app = App(address, CAMERA, Dock(0.30, 10), port=0, options=options)
        with app, visit(browser, app) as operator, pilot_of(browser, app, SIZES[0]) as page:
            operator.open()
            page.get_by_text("Dock found", exact=True).wait_for()
            page.wait_for_function("() => /^Picture 0\\.\\d s old/.test(document.querySelector('#age').textContent)")
            server.close()
            for one in (page.locator("#trust"), operator.page.locator("#strip[data-stale] #strip-trust")):
                one.filter(has_text="No new picture for ").wait_for()
            assert page.locator("body[data-old]").count() == 1
            assert "Dock found" not in words(operator.page, "#strip-trust")
            with MjpegServer([PICTURE], 10, port):
                page.get_by_text("Dock found", exact=True).wait_for()
                operator.page.locator("#strip:not([data-stale])", has_text="Dock found").wait_for()


def test_the_pilot_is_told_of_an_outage_and_nobody_sees_it_without_a_token(browser):
    with App(port=0, options=Options(view_link=True)) as app:
        with visit(browser, app) as stranger:
            assert stranger.page.goto(f"http://127.0.0.1:{app.port}/pilot").status == 403
            assert stranger.page.goto(f"http://127.0.0.1:{app.port}/pilot.json").status == 403
        with pilot_of(browser, app, SIZES[3]) as page:
            page.get_by_text("Dock found", exact=True).wait_for()
            app.stop()
            page.get_by_text("No connection to dockpose").wait_for()
            assert page.locator("body[data-old]").count() == 1
