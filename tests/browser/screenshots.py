"""Pictures of the page for README and docs: ``python -m tests.browser.screenshots`` (or ``make screenshots``)."""

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import cv2
from dockpose import Dock, Entrance
from dockpose.app.state.camera import with_own_dock
from dockpose.app.state.view import open_source
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options
from dockpose.camera.image import decode
from playwright.sync_api import sync_playwright

from tests.browser.chromium import find
from tests.browser.conftest import ARGUMENTS, Page
from tests.pipeline.camera.test_calibrate import CHESSBOARD, TRUE, pictures

ROOT = Path(__file__).resolve().parents[2]
STATIC, FIGURES = ROOT / "static", ROOT / "docs" / "figures"
WEBP_QUALITY = 80
SETTLE_MS = 3000  # the 3D scene is drawn without a graphics card


def main() -> int:
    """Write the README's pictures into static/, and each mode's into docs/figures/; 1 where there is no Chromium."""
    path = find()
    if path is None:
        print("No Chromium: install one, or set CHROMIUM to its path.", file=sys.stderr)
        return 1
    with (
        TemporaryDirectory() as folder,
        App(port=0, options=Options(sessions=Path(folder))) as app,
        sync_playwright() as playwright,
    ):
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
        _write_modes(page, app)
        browser.close()
    return 0


def _write_modes(page: Page, app: App) -> None:
    """Each mode of the page, in light and dark, for docs/page.md."""
    page.open()
    app.change(lambda _: open_source("sample_images/tilted.png", None, None), reload=True)
    page.tab("Detect")
    _shoot_both(page, "picture")
    page.tab("Compare")
    page.page.locator("dockpose-compare canvas[data-drawn]").first.wait_for(timeout=60_000)
    _shoot_both(page, "compare")
    page.tab("Picture")
    page.tab("Play")
    page.choose("Sequence", "simulated approach")
    page.page.get_by_role("button", name="Play", exact=True).click()
    page.until(lambda: app.view.list_name == "sequence" and int(app.view.source.split()[3]) >= 100)
    page.page.get_by_role("button", name="Pause", exact=True).click()
    _shoot_both(page, "play")
    page.tab("Tank")
    page.unfold("Calibrate the camera")
    boards = [(name, cv2.imencode(".png", one)[1].tobytes()) for name, one in pictures(CHESSBOARD, TRUE, 14)]
    page.send("Add pictures or a video of the board", *boards)
    page.until(lambda: page.page.locator("[data-board]").count() == len(boards))
    page.press("Work out the camera")
    page.page.locator(".calibration-line", has_text="pictures used").wait_for()
    _shoot_both(page, "calibrate")
    app.change(lambda _: open_source("sample_images/tilted.png", None, None), reload=True)
    page.tab("Log")
    page.page.get_by_role("button", name="Start a new session").click()
    page.until(lambda: "Started." in page.page.locator("#experiment").inner_text())
    page.page.get_by_role("button", name="Take this frame (T)").click()
    page.page.locator("#experiment-rows tr[data-row='1']").wait_for()
    _shoot_both(page, "log")
    before_entrance = Dock(0.30, 10, entrance=Entrance(radius_m=0.05))
    app.change(
        lambda _: with_own_dock(open_source("sample_images/tilted.png", None, None), before_entrance), reload=True
    )
    page.page.goto(app.address.replace("/?", "/pilot?"))
    page.page.get_by_text("to the entrance").or_(page.page.get_by_text("to the stand-off")).wait_for()
    _shoot_both(page, "pilot")


def _shoot_both(page: Page, mode: str) -> None:
    for scheme in ("light", "dark"):
        page.page.emulate_media(color_scheme=scheme)
        taken = decode(_taken(page), mode)
        cv2.imwrite(str(FIGURES / f"page-{mode}-{scheme}.webp"), taken, [cv2.IMWRITE_WEBP_QUALITY, WEBP_QUALITY])
    page.page.emulate_media(color_scheme="light")


def _shoot(page: Page, name: str) -> None:
    (STATIC / name).write_bytes(_taken(page))


def _taken(page: Page) -> bytes:
    page.page.wait_for_timeout(SETTLE_MS)
    notice = page.page.locator(".mantine-Notification-closeButton")
    for index in reversed(range(notice.count())):
        if notice.nth(index).is_visible():
            notice.nth(index).click()
    page.page.wait_for_timeout(SETTLE_MS // 3)
    return page.page.screenshot()


if __name__ == "__main__":
    sys.exit(main())
