"""Notices and chips at the widths that the page is used at."""

from dataclasses import replace

import msgspec
import pytest

from tests.browser.test_layout import LEAST, MEASURE, SIZES

pytestmark = pytest.mark.browser
LONG = "A sentence on the camera and the dock of this picture. " * 3  # a longer one is scrolled
AT_REST = "one => one.getAnimations({ subtree: true }).length === 0"
# What the newest notice lies over that must stay in view, or beyond the window; and chips whose words are cut off.
NOTICE_FAULTS = """() => {
  const isOver = (a, b) => Math.min(a.right, b.right) - Math.max(a.left, b.left) > 1
    && Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 1;
  const isOut = (box) => box.left < 0 || box.top < 0 || box.right > innerWidth || box.bottom > innerHeight;
  const beside = ", dockpose-picture .stage, canvas[data-engine], #candidates, [data-dock-region=right]";
  const large = innerWidth < 1100 ? "" : beside;
  const kept = [...document.querySelectorAll(`#strip-trust, dockpose-jobs${large}`)];
  const words = document.createRange();
  words.selectNodeContents(document.querySelector("#place"));
  kept.push(words);
  const newest = [...document.querySelectorAll("#root [role=alert]:not(#webgl-software-rendering)")].at(-1);
  const place = newest.getBoundingClientRect();
  const covered = kept.filter((one) => isOver(place, one.getBoundingClientRect()));
  const faults = covered.map((one) => `it lies over ${one.id || one.tagName || "the place"}`);
  const plot = document.querySelector("dockpose-histogram .plot").getBoundingClientRect();
  const beneath = document.elementFromPoint(plot.left + plot.width / 2, plot.top + plot.height / 2);
  if (innerWidth >= 1100 && !beneath?.closest("dockpose-histogram")) faults.push("the histogram does not answer");
  if (isOut(place)) faults.push("it is beyond the window");
  if (newest.scrollHeight > newest.clientHeight + 1) faults.push("it is not whole");
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
    page.until(lambda: page.page.locator("dockpose-jobs .chip").count() == 3 and page.app.wait_until_idle(0.1))
    page.rest()
    found = page.page.evaluate(MEASURE, LEAST)
    notices = page.page.get_by_role("alert").filter(has_text="A sentence")
    titles = ("About the camera", "About the dock")
    for title in titles:
        page.app.notify(title, LONG, "yellow", None)
    page.until(lambda: notices.count() == len(titles) and all(one.evaluate(AT_REST) for one in notices.all()))
    found += page.page.evaluate(NOTICE_FAULTS)
    found += [fault for fault in page.page.evaluate(MEASURE, LEAST) if "lies over" not in fault]  # as notices may
    for left in reversed(range(len(titles))):  # the newest lies over the others
        notices.last.get_by_role("button").click()
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
