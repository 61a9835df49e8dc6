"""What holds beyond one visit: a program that stops and comes back, reloads, and several browsers."""

import pytest
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options
from dockpose.app.web.server.start import check_port_is_free

from tests.browser.conftest import visit

PORT = 8977


@pytest.fixture
def port():
    try:
        check_port_is_free("127.0.0.1", PORT)
    except OSError as error:
        pytest.skip(str(error))
    return PORT


def test_a_page_says_that_the_program_stopped_and_comes_back_by_itself(browser, port, tmp_path):
    options = Options(remember_in=tmp_path)
    with visit(browser, None) as page:
        with App(port=port, options=options) as page.app:
            page.page.goto(page.app.address)
            page.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
            assert page.page.title().startswith("dockpose")
            page.choose("Sample scene", "tilted")
            page.until(lambda: page.has_found("tilted"))
        banner = page.page.get_by_role("alert").filter(has_text="has stopped")
        banner.wait_for()
        assert f"dockpose serve --port {port}" in banner.inner_text()
        with App(port=port, options=options) as page.app:
            banner.wait_for(state="hidden")
            page.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
            page.until(lambda: page.has_found("tilted"))


def test_a_page_whose_scripts_are_refused_says_why_and_what_to_do(browser, page):
    with visit(browser, page.app) as other:
        other.page.route("**/link.js", lambda route: route.fulfill(status=403))
        other.page.goto(page.app.address)
        told = other.page.get_by_role("alert").filter(has_text="gets no connection")
        told.wait_for()
        assert f"--allow-host http://127.0.0.1:{page.app.port}." in told.inner_text()


def test_a_page_below_a_path_asks_for_all_of_it_there(browser, page):
    """As by a proxy that takes the path away; the WebSocket, which is not routed here, finds its way by itself."""
    with visit(browser, page.app) as other:
        asked = []

        def forward(route):
            asked.append(route.request.url)
            route.continue_(url=route.request.url.replace("/dock/", "/"))

        other.page.route("**/*", forward)
        other.page.goto(page.app.address.replace("/?", "/dock/?"))
        other.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
        assert [url for url in asked if "/dock/" not in url and url.startswith("http")] == []


def test_a_reload_keeps_the_tab(page):
    page.tab("Detect")
    page.rest()
    page.page.reload()
    page.page.get_by_role("tab", name="Detect", exact=True).wait_for()
    page.until(lambda: page.page.get_by_role("tab", name="Detect", exact=True).get_attribute("aria-selected") == "true")


def test_the_page_follows_the_systems_dark_mode_until_somebody_chooses(browser):
    def scheme():
        return page.page.evaluate("() => document.documentElement.dataset.mantineColorScheme")

    with App(port=0) as running, visit(browser, running, color_scheme="dark") as page:
        page.open()
        page.until(lambda: scheme() == "dark")
        page.page.emulate_media(color_scheme="light")
        page.until(lambda: scheme() == "light")
        page.page.keyboard.press("d")
        page.until(lambda: scheme() == "dark")
        page.page.emulate_media(color_scheme="dark")
        page.page.emulate_media(color_scheme="light")
        page.page.wait_for_timeout(1000)
        assert scheme() == "dark"
