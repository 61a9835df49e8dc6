"""A page that is open while the program is stopped for seconds to minutes is back within 5 s of the program."""

import time

import pytest
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options

from tests.browser.conftest import browser as browser
from tests.browser.conftest import visit
from tests.browser.test_connection import port as port

WITHIN_S = 5.0


@pytest.mark.parametrize("outage_s", [5, 30, 63, 300])
def test_an_open_page_is_back_by_itself(browser, port, tmp_path, outage_s):
    with visit(browser, None) as page:
        with App(port=port, options=Options(remember_in=tmp_path)) as page.app:
            began_s = time.monotonic()
            page.page.goto(page.app.address)
            page.page.locator("#strip", has_text="Dock found").wait_for()
            opened_s = time.monotonic() - began_s
            page.page.evaluate("window.isOfBefore = true")
        banner = page.page.get_by_role("alert").filter(has_text="has stopped")
        banner.wait_for()
        page.page.wait_for_timeout(1000 * outage_s)
        assert banner.is_visible()
        with App(port=port, options=Options(remember_in=tmp_path)) as page.app:
            began_s = time.monotonic()
            page.page.wait_for_function("() => !window.isOfBefore && document.querySelector('#strip')", timeout=60_000)
            page.page.locator("#strip", has_text="Dock found").wait_for()
            took_s = time.monotonic() - began_s
            print(f"back {took_s:.1f} s after the program, away for {outage_s} s; a page opens in {opened_s:.1f} s")
            assert not banner.is_visible()
            assert took_s <= WITHIN_S
