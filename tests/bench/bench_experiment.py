"""Opening a session of 2,000 rows on the page: from the click to the table shown, in a real Chromium."""

from __future__ import annotations

import shutil
import statistics
from pathlib import Path

import msgspec
import pytest
from dockpose.app.experiment import Session
from dockpose.app.experiment.row import row_to_csv
from dockpose.app.web.app import App
from dockpose.app.web.panels.experiment.panel import NO_SESSION
from dockpose.app.web.server.options import Options

from tests.browser.conftest import Page
from tests.support.taking import FOUND, PICTURE

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


@pytest.fixture
def root(tmp_path: Path) -> Path:
    with Session.create(tmp_path / "long") as session:
        first = session.take(PICTURE, FOUND, "tank", notes="as measured, by hand")
    rows = [
        msgspec.structs.replace(
            first, number=n, file=f"frames/{n:04d}.png", measured_z_cm=100 + n / 100, measured_theta_y_deg=n / 100
        )
        for n in range(1, ROWS + 1)
    ]
    results = tmp_path / "long" / "results.csv"
    results.write_text(results.read_text().splitlines()[0] + "\n" + "".join(map(row_to_csv, rows)))
    for row in rows[1:]:
        for ending in (".png", ".json"):
            shutil.copy(tmp_path / f"long/frames/0001{ending}", tmp_path / f"long/{row.file[:-4]}{ending}")
    return tmp_path


def test_two_thousand_rows_open_within_two_seconds(browser, root: Path) -> None:
    app = App.build(port=0, options=Options(sessions=root))
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
