import pytest

from tests.browser.conftest import TABS
from tests.support.answering import answering

pytestmark = pytest.mark.browser
DIRECTIVES = [
    *("connect-src", "img-src", "frame-src", "object-src", "form-action"),
    *("style-src-elem", "script-src-elem", "script-src-attr"),
]


@pytest.fixture
def elsewhere():
    """Another server on this machine, which notes what it is asked."""
    asked = []

    def answer(path):
        asked.append(path)
        return 200, {"Access-Control-Allow-Origin": "*"}, b""

    with answering(answer) as address:
        yield address, asked


def test_nothing_that_the_page_needs_is_refused(page):
    """The fixture fails the test if the console shows an error, as it does for whatever is refused."""
    for name in (*TABS, "Compare", "Picture"):
        page.tab(name)
    page.page.locator("#candidates").wait_for()
    with page.page.expect_popup() as popup:
        page.page.locator("a[href='help#view']").click()
    errors = []
    popup.value.on("console", lambda message: errors.append(message.text))
    popup.value.reload()
    popup.value.get_by_role("heading", name="The picture and its histogram").wait_for()
    popup.value.close()
    assert errors == []


def test_nothing_goes_to_another_host(page, elsewhere):
    address, asked = elsewhere
    refused = page.page.evaluate(
        """async ([address, wanted]) => {
            const refused = [];
            addEventListener("securitypolicyviolation", (event) => refused.push(event.effectiveDirective));
            await fetch(address + "/fetch").catch(() => {});
            try { new WebSocket(address.replace("http", "ws") + "/socket"); } catch {}
            navigator.sendBeacon(address + "/beacon", "x");
            const put = (html) => document.body.insertAdjacentHTML("beforeend", html);
            put(`<img class=x src="${address}/img"><iframe class=x src="${address}/frame"></iframe>`);
            put(`<object class=x data="${address}/object"></object><form class=x action="${address}/form"></form>`);
            put(`<link class=x rel=stylesheet href="${address}/style">`);
            put(`<img class=x src=y onerror="document.title = 'ran'">`);
            document.querySelector("form.x").submit();
            const script = document.createElement("script");
            script.src = address + "/script";
            document.body.append(script);
            const isDone = () => wanted.every((name) => refused.includes(name));
            const soon = () => new Promise((next) => setTimeout(next, 100));
            for (let tries = 0; !isDone() && tries < 600; tries += 1) await soon();
            document.querySelectorAll(".x").forEach((one) => one.remove());
            return refused;
        }""",
        [address, DIRECTIVES],
    )
    assert asked == []
    assert set(DIRECTIVES) <= set(refused)
    assert page.page.title() != "ran"
    page.errors.clear()  # each refusal is told there
