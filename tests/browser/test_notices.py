"""Notices and chips at the widths that the page is used at."""

from dataclasses import replace

import msgspec
import pytest

from tests.browser.test_layout import LEAST, MEASURE, SIZES, STAGE, box, open_part

pytestmark = pytest.mark.browser
LONG = "A sentence on the camera and the dock of this picture. " * 4
AT_REST = "one => one.getAnimations({ subtree: true }).length === 0"
# What notices lie over that must stay in view, each other, or beyond the window; and chips whose words are cut off.
NOTICE_FAULTS = """() => {
  const boxOf = (one) => [one.textContent.slice(0, 20) || one.id || one.className, one.getBoundingClientRect()];
  const isOver = ([, a], [, b]) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
    && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1;
  const isOut = ([, box]) => box.left < 0 || box.top < 0 || box.right > innerWidth || box.bottom > innerHeight;
  const boxesOf = (selector) => [...document.querySelectorAll(selector)].map(boxOf);
  const notices = boxesOf("[role=alert]:not(#webgl-software-rendering)");
  const stage = innerWidth < 1100 ? "" : ", dockpose-picture .stage";
  const all = boxesOf(`#strip, #parts, dockpose-jobs${stage}`).concat(notices);
  const faults = notices.filter(isOut).map(([name]) => `${name}: beyond the window`);
  for (const one of notices) {
    for (const other of all) if (other !== one && isOver(one, other)) faults.push(`${one[0]} lies over ${other[0]}`);
  }
  const chips = [...document.querySelectorAll("dockpose-jobs .chip")].filter((one) => one.clientWidth > 0);
  const cut = innerWidth < 1100 ? chips.filter((one) => one.scrollWidth > one.clientWidth) : [];
  return faults.concat(cut.map((one) => `${one.textContent}: cut off`));
}"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("size", SIZES.values(), ids=SIZES)
def test_chips_and_notices_are_whole_and_cover_neither_words_nor_picture(page, resized, size, scheme):
    resized(size)
    page.page.emulate_media(color_scheme=scheme)
    page.page.locator(f"html[data-mantine-color-scheme={scheme}]").wait_for(state="attached")
    chosen = {"masks": ((0.0, 0.0, 100.0, 40.0),), "min_area_px": 20, "method": "fixed", "level": 100}
    page.app.change(lambda view: replace(view, settings=msgspec.structs.replace(view.settings, **chosen)), reload=True)
    if page.page.locator("#parts").is_visible():
        open_part(page, "Picture")
    page.until(lambda: page.page.locator("dockpose-jobs .chip").count() == 3 and page.app.wait_until_idle(0.1))
    page.rest()
    found = page.page.evaluate(MEASURE, LEAST)
    notices = page.page.get_by_role("alert").filter(has_text="A sentence")
    titles = ("About the camera", "About the dock")[: 1 if size[1] < 480 else 2]  # more have no room there
    for title in titles:
        page.app.notify(title, LONG, "yellow", None)
    page.until(lambda: notices.count() == len(titles) and all(one.evaluate(AT_REST) for one in notices.all()))
    found += page.page.evaluate(NOTICE_FAULTS)
    found += [fault for fault in page.page.evaluate(MEASURE, LEAST) if "lies over" not in fault]  # as notices may
    for left in reversed(range(len(titles))):
        notices.first.get_by_role("button").click()
        page.until(lambda left=left: notices.count() == left)
    assert found == []


def test_what_comes_just_after_a_notice_was_closed_by_hand_is_shown(page):
    page.app.notify("Closed at once", "The first sentence.", "yellow", None)
    notice = page.page.get_by_role("alert").filter(has_text="Closed at once")
    notice.get_by_role("button").click()
    notice.wait_for(state="detached")
    page.app.notify("Closed at once", "The second sentence.", "yellow", None)
    notice.filter(has_text="The second sentence.").wait_for()
    page.app.notify("Closed at once", "The third sentence.", "yellow", None)
    notice.filter(has_text="The third sentence.").wait_for()
    assert notice.count() == 1  # one that is still there only gets longer
    notice.get_by_role("button").click()
    notice.wait_for(state="detached")


@pytest.mark.parametrize("hides", [False, True])
def test_notices_never_lie_over_the_picture(page, resized, hides):
    resized((1280, 800))
    away = page.page.get_by_role("button", name="3D", exact=True)
    if hides:
        away.click()
    page.app.notify(f"A title {hides}", "A sentence. " * 12, "yellow", None)  # of one title it would add to the last
    notice = page.page.get_by_role("alert").filter(has_text="A sentence.")
    notice.wait_for()
    page.until(lambda: notice.bounding_box()["x"] >= box(page, STAGE)["right"])  # it slides in
    assert notice.bounding_box()["height"] > 40
    notice.get_by_role("button").click()
    if hides:
        away.click()
