"""Pictures of the page for the README: ``python -m tests.browser.screenshots`` (or ``make screenshots``)."""

import sys
from pathlib import Path

from dockpose import Dock, Entrance
from dockpose.app.state.camera import with_own_dock
from dockpose.app.state.view import open_source
from dockpose.app.web.app import App
from playwright.sync_api import sync_playwright

from tests.browser.chromium import find
from tests.browser.conftest import ARGUMENTS, Page

STATIC = Path(__file__).resolve().parents[2] / "static"
SETTLE_MS = 3000  # the 3D scene is drawn without a graphics card


def main() -> int:
    """Write the pictures that the README shows into static/. Returns 1 where there is no Chromium."""
    path = find()
    if path is None:
        print("No Chromium: install one, or set CHROMIUM to its path.", file=sys.stderr)
        return 1
    with App(port=0) as app, sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        page = Page(browser.new_page(viewport={"width": 1366, "height": 768}), app)
        page.open()
        app.change(lambda _: open_source("sample_images/tilted.png", None, None), reload=True)
        page.tab("Detect")
        _shoot(page, "screenshot.png")
        app.change(lambda _: open_source("sample_images/side_glow.png", None, None), reload=True)
        page.until(lambda: "side_glow" in page.page.locator("#source").inner_text())
        page.page.keyboard.press("Escape")
        page.page.get_by_role("tab", name="Compare", exact=True).click()
        page.page.locator("dockpose-compare canvas[data-drawn]").first.wait_for(timeout=60_000)
        _shoot(page, "screenshot-compare.png")
        page.page.get_by_role("tab", name="Picture", exact=True).click()
        page.tab("Play")
        page.choose("Sequence", "simulated approach")
        page.page.get_by_role("button", name="Play", exact=True).click()
        page.until(
            lambda: app.view.list_name == "sequence" and int(app.view.source.split()[3]) >= 300
        )  # frames pass by
        page.page.get_by_role("button", name="Pause", exact=True).click()
        _shoot(page, "screenshot-sequence.png")
        before_entrance = Dock(0.30, 10, entrance=Entrance(radius_m=0.05))
        app.change(
            lambda _: with_own_dock(open_source("sample_images/plain.png", None, None), before_entrance), reload=True
        )
        page.page.goto(app.address.replace("/?", "/pilot?"))
        page.page.get_by_text("to the entrance").or_(page.page.get_by_text("to the stand-off")).wait_for()
        _shoot(page, "screenshot-pilot.png")
        browser.close()
    return 0


def _shoot(page: Page, name: str) -> None:
    page.page.wait_for_timeout(SETTLE_MS)
    notice = page.page.locator(".mantine-Notification-closeButton")
    for index in reversed(range(notice.count())):
        if notice.nth(index).is_visible():
            notice.nth(index).click()
    page.page.wait_for_timeout(SETTLE_MS // 3)
    page.page.screenshot(path=STATIC / name)


if __name__ == "__main__":
    sys.exit(main())
