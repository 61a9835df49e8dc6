"""Pictures of the page for README and docs: ``python -m tests.browser.screenshots`` (or ``make screenshots``)."""

import os
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
from dockpose.app.state.view import open_source
from dockpose.app.web.app import App
from dockpose.camera.image import decode
from dockpose.sidecar import sample_path
from playwright.sync_api import sync_playwright

from tests.browser.chromium import find
from tests.browser.conftest import ARGUMENTS, Page
from tests.pipeline.camera.test_calibrate import CHESSBOARD, TRUE, pictures

FIGURES = Path(__file__).resolve().parents[2] / "docs" / "figures"
WEBP_QUALITY = 80
SETTLE_MS = 3000  # the 3D scene is drawn without a graphics card


def main() -> int:
    """Write each mode of the page, in light and dark, into docs/figures/. Returns 1 where there is no Chromium."""
    path = find()
    if path is None:
        print("No Chromium: install one, or set CHROMIUM to its path.", file=sys.stderr)
        return 1
    with (
        TemporaryDirectory() as folder,
        App(port=0) as app,
        sync_playwright() as playwright,
    ):
        os.chdir(folder)  # where the session is begun
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        page = Page(browser.new_page(viewport={"width": 1366, "height": 768}), app)
        page.open()
        for mode in (picture, compare, calibrate, log, play):
            mode(page)
            for scheme in ("light", "dark"):
                page.page.emulate_media(color_scheme=scheme)
                _shoot(page, f"page-{mode.__name__}-{scheme}")
            page.page.emulate_media(color_scheme="light")
        browser.close()
    return 0


def picture(page: Page) -> None:
    """The first sample with a tilt."""
    page.app.change(lambda _: open_source(str(sample_path("tilted")), None, None), reload=True)
    page.tab("Tank")


def compare(page: Page) -> None:
    """A picture on which the methods differ."""
    page.app.change(lambda _: open_source(str(sample_path("side_glow")), None, None), reload=True)
    page.until(lambda: "side_glow" in page.page.locator("#source").inner_text())
    page.tab("Compare")
    page.page.locator("dockpose-compare canvas[data-drawn]").first.wait_for(timeout=60_000)


def calibrate(page: Page) -> None:
    """Boards that were sent and worked out."""
    page.tab("Calibrate")
    boards = [(name, cv2.imencode(".png", one)[1].tobytes()) for name, one in pictures(CHESSBOARD, TRUE, 14)]
    page.send("Add pictures or a video", *boards)
    page.until(lambda: page.page.locator("[data-board]").count() == len(boards))
    page.press("Work out the camera")
    page.page.locator(".calibration-line", has_text="pictures used").wait_for()
    page.page.locator("[data-board]").first.evaluate("one => one.scrollIntoView()")


def log(page: Page) -> None:
    """A session with one row."""
    picture(page)
    page.tab("Log")
    page.page.get_by_role("button", name="Take (T)").click()
    page.page.locator("#experiment-rows tr[data-row='1']").wait_for()


def play(page: Page) -> None:
    """An approach of which half has gone by."""
    page.tab("Picture")
    page.tab("Source")
    page.choose("Sequence", "simulated approach")
    page.page.get_by_role("button", name="Play", exact=True).click()
    page.until(lambda: page.app.view.list_name == "sequence" and int(page.app.view.source.split()[3]) >= 300)
    page.page.get_by_role("button", name="Pause", exact=True).click()


def _shoot(page: Page, name: str) -> None:
    page.page.wait_for_timeout(SETTLE_MS)
    notice = page.page.locator(".mantine-Notification-closeButton")
    for index in reversed(range(notice.count())):
        if notice.nth(index).is_visible():
            notice.nth(index).click()
    page.page.wait_for_timeout(SETTLE_MS // 3)
    taken = decode(page.page.screenshot(), name)
    cv2.imwrite(str(FIGURES / f"{name}.webp"), taken, [cv2.IMWRITE_WEBP_QUALITY, WEBP_QUALITY])


if __name__ == "__main__":
    sys.exit(main())
