"""Opening a session of 2,000 rows on the page: from the click to the table shown, in a real Chromium."""

import statistics
from pathlib import Path

from dockpose.app.web.app import App
from dockpose.app.web.panels.experiment import NO_SESSION
from dockpose.app.web.server.options import Options

from tests.browser.conftest import Page
from tests.support.taking import long_session

ROWS, OPENINGS = 2000, 5
MOST_S = 2.0

# Told in the page's own clock: from the pointer going down on the option to the frame after the table was there.
_WATCH = """
() => {
  window.opened = null;
  window.addEventListener("pointerdown", () => { window.began = performance.now(); window.opened = null; }, true);
  new MutationObserver(() => {
    if (window.opened === null && document.querySelector("#experiment-rows tr[data-row='2000']")) {
      requestAnimationFrame(() => { window.opened ??= performance.now() - window.began; });
    }
  }).observe(document.body, { childList: true, subtree: true, characterData: true });
}
"""


def test_two_thousand_rows_open_within_two_seconds(browser, tmp_path: Path) -> None:
    long_session(tmp_path / "long", ROWS)
    app = App(port=0, options=Options(sessions=tmp_path))
    try:
        page = Page(browser.new_page(viewport={"width": 1366, "height": 768}), app)
        page.open()
        page.tab("Log")
        page.page.evaluate(_WATCH)
        times = []
        for _ in range(OPENINGS):
            page.choose("Session", "long")
            page.until(lambda: page.page.evaluate("window.opened") is not None)
            times.append(page.page.evaluate("window.opened") / 1000)
            page.choose("Session", NO_SESSION)
            page.until(lambda: not page.page.locator("#experiment-rows").count())
            page.page.wait_for_timeout(500)
    finally:
        app.stop()
    print(
        f"\n{ROWS} rows, from the click to the table: at most {MOST_S} s asked, {max(times):.2f} s measured "
        f"(median {statistics.median(times):.2f} s of {OPENINGS})"
    )
    assert max(times) <= MOST_S
