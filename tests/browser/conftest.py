import contextlib
import os
import re
import time
from typing import NoReturn

import pytest
from dockpose.app.state.view import open_source
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options

from tests.browser.chromium import find

ARGUMENTS = [
    "--no-sandbox",
    "--disable-dev-shm-usage",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-compositing",  # as where there is no graphics card: only the scene is drawn by SwiftShader
]
EXPECTED_CONSOLE = (
    "Software WebGL",  # a machine without a graphics card says so
    "net::ERR_FILE_NOT_FOUND",  # a picture (blob:) that viser let go of for a newer one before it was loaded
)
LAPTOP = 1366, 768
TABS = ("Tank", "Source", "Detect", "Export", "Settings", "Log", "Calibrate")
# Opens the folders that an element is in, the outermost first.
_UNFOLD = """
async (one) => {
  const folders = [];
  const around = (inner) => inner?.closest(".mantine-Paper-root");
  for (let folder = around(one); folder; folder = around(folder.parentElement)) folders.unshift(folder);
  for (const folder of folders) {
    const content = [...folder.children].find((child) => child.contains(one));
    const isClosed = () => content !== undefined && getComputedStyle(content).display === "none";
    if (isClosed()) folder.firstElementChild.click();
    for (let waited = 0; isClosed() && waited < 100; waited += 1) await new Promise((next) => setTimeout(next, 20));
  }
}
"""
_DROP = """([name, bytes, type]) => {
  const files = new DataTransfer();
  files.items.add(new File([new Uint8Array(bytes)], name, {type}));
  window.dispatchEvent(new DragEvent("drop", {dataTransfer: files, cancelable: true}));
}"""
HANGS_S = 120.0  # nothing takes that long, however busy the machine is: what is waited for does not come
# Resolves once the browser has drawn; the second once it has sent what was typed last, too, which it does after 50 ms.
_DRAWN = "() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)))"
_SENT = f"() => new Promise((done) => setTimeout(done, 60)).then({_DRAWN})"


def no_browser(reason) -> NoReturn:
    """On a developer's machine a missing browser skips these tests; in continuous integration it fails them."""
    if os.environ.get("CI"):
        pytest.fail(f"no Chromium: {reason}")
    pytest.skip(f"no Chromium: {reason}")


@pytest.fixture(scope="session")
def browser():
    try:
        from playwright.sync_api import Error, sync_playwright
    except ImportError:
        no_browser("playwright is not installed")
    path = find()
    if path is None:
        no_browser("none in CHROMIUM, on the PATH or with playwright")
    with sync_playwright() as playwright:
        try:
            chromium = playwright.chromium.launch(executable_path=path, args=ARGUMENTS)
        except Error as error:
            no_browser(f"{path} does not start ({str(error).splitlines()[0]})")
        yield chromium
        chromium.close()


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """The folder of the experiments."""
    return tmp_path_factory.mktemp("sessions")


@pytest.fixture(scope="module")
def app(root):
    with App(port=0, options=Options(sessions=root)) as running:
        yield running


@pytest.fixture(scope="module")
def opened(browser, app):
    """One page for all tests of a module: opening one takes seconds without a graphics card."""
    with visit(browser, app) as page:
        page.open()
        yield page


@contextlib.contextmanager
def visit(browser, app, *, first=False, **options):
    """A page of its own, on a laptop unless the options of its context say otherwise; of a ``first`` visit, or not."""
    options = {"viewport": {"width": LAPTOP[0], "height": LAPTOP[1]}} | options
    with contextlib.closing(browser.new_context(**options)) as context:
        page = Page(context.new_page(), app, first=first)
        try:
            yield page
        except Exception:
            print(page.errors, page.page.locator("[role=tab], [role=alert], dockpose-picture").all_inner_texts())
            raise


@pytest.fixture
def page(opened):
    """The page on its first sample scene; the test fails if the console shows an error meanwhile."""
    first = open_source(None, None, None)
    opened.page.evaluate("document.activeElement?.blur()")  # a box sends what was typed once it is left
    opened.rest()
    opened.app.change(lambda _: first, reload=True)
    opened.tab("Picture")
    opened.tab("Source")
    opened.page.locator("dockpose-picture .stage").press("Escape")  # lays a tool down
    for button in ("annotated", "fit"):
        opened.page.locator(f"dockpose-picture [data-do={button}]").click()
    opened.until(lambda: opened.app.wait_until_idle(0.1) and "Dock found in plain" in opened.status)
    opened.until(lambda: opened.box("Sample scene").input_value() == "plain")
    yield opened
    errors = [text for text in opened.errors if not any(known in text for known in EXPECTED_CONSOLE)]
    opened.errors.clear()
    assert errors == []


@pytest.fixture
def resized(page):
    """Gives the page another size; afterwards it is that of a laptop again, and light."""

    def resize(size):
        page.page.set_viewport_size({"width": size[0], "height": size[1]})
        page.until(lambda: page.page.evaluate("innerWidth") == size[0])
        page.rest()

    yield resize
    page.page.emulate_media(color_scheme="light")
    resize(LAPTOP)


class Page:
    """The page as a person reads and works it."""

    def __init__(self, page, app, *, first=False):
        self.page, self.app = page, app
        if not first:
            page.add_init_script("if (location.protocol === 'http:') localStorage.setItem('dockpose steps', 'seen')")
        page.set_default_timeout(1000 * HANGS_S)
        self.errors = []
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.on("console", lambda message: self.errors.append(message.text) if message.type == "error" else None)

    def open(self):
        self.page.goto(f"{self.app.address}&fixedDpr=0.1")  # the 3D scene costs as little as it can
        self.page.get_by_role("tab", name="Settings", exact=True).wait_for()  # the last that comes
        self.page.locator("dockpose-live #candidates tbody tr").first.wait_for()

    def row(self, label):
        name = self.page.locator("label", has_text=re.compile(rf"^{re.escape(label)}$"))
        self.reveal(name)
        return name.locator("xpath=ancestor::div[contains(@class,'mantine-Flex-root')][1]")

    def reveal(self, locator):
        """Open the tab that something is in, and its folders: what is in closed tabs is not on the page at all."""
        if locator.count() and locator.first.is_visible():
            return
        for name in TABS:
            self.tab(name)
            if locator.count():
                locator.first.evaluate(_UNFOLD)
                if locator.first.is_visible():
                    return

    def unfold(self, title):
        """Open the folder of that title, and the tab that it is in."""
        label = self.page.get_by_text(title, exact=True)
        self.reveal(label)
        label.evaluate(f"(one) => ({_UNFOLD})(one.nextElementSibling.firstElementChild)")

    def tab(self, name):
        tab = self.page.get_by_role("tab", name=name, exact=True)
        if tab.get_attribute("aria-selected") != "true":
            tab.click()
            self.until(lambda: tab.get_attribute("aria-selected") == "true")
        self.page.evaluate(_DRAWN)

    def box(self, label):
        return self.row(label).locator("input:not([type=hidden])")

    def slider(self, label):
        return self.row(label).get_by_role("slider")

    def tick(self, label, is_on=True):
        """Tick a box."""
        box = self.page.get_by_label(label)
        if box.is_checked() != is_on:
            box.click()
        self.until(lambda: box.is_checked() == is_on)

    def choose(self, label, option):
        self.box(label).click()
        self.page.get_by_role("option", name=option, exact=True).click()
        self.rest()

    def drop(self, name, data, kind):
        """Drop a file on the page."""
        self.page.evaluate(_DROP, [name, list(data), kind])

    def press(self, name):
        """Press the button of exactly that name, in whichever tab."""
        button = self.page.get_by_role("button", name=name, exact=True)
        self.reveal(button)
        button.click()
        self.rest()

    def download(self, name):
        """Press a button; returns the name and the bytes of the file that comes."""
        with self.page.expect_download() as download:
            self.press(name)
        return download.value.suggested_filename, download.value.path().read_bytes()

    def rest(self):
        """Wait until the browser has drawn, and has sent what was typed last.

        Boxes that are changed within 50 ms share one message, and the first would be lost.
        """
        self.page.evaluate(_SENT)

    def upload(self, name, data):
        self.send("Upload pictures", (name, data))

    def send(self, button, *files):
        """Choose files, each a name and bytes, in the dialogue of an upload button."""
        self.reveal(self.page.get_by_role("button", name=button))
        with self.page.expect_file_chooser() as chooser:
            self.page.get_by_role("button", name=button).click()
        chooser.value.set_files([{"name": name, "mimeType": "", "buffer": data} for name, data in files])

    @property
    def status(self):
        return self.page.locator("[role=status]").inner_text()

    @property
    def trust(self):
        """Green, amber or red, as the status says."""
        return self.page.locator("#trust").get_attribute("data-trust")

    def has_found(self, name):
        """Whether the status says that it found a dock in the picture of that name, trusted or not."""
        return f" in {name} (" in self.status and "No pose" not in self.status

    @property
    def z_cm(self):
        """Z of the chosen candidate, as the table says; None where there is none."""
        cells = self.page.locator("#candidates tbody tr").first.locator("td").all_inner_texts()
        return float(cells[3]) if len(cells) > 3 else None

    def row_names(self):
        return [text.strip() for text in self.page.locator("#candidates tbody tr td:first-child").all_inner_texts()]

    def until(self, check, timeout_s=HANGS_S):
        """Wait for something on the page or in the app to become so."""
        end = time.monotonic() + timeout_s
        while not check():
            assert time.monotonic() < end, f"not in time; the page says: {self.status!r}, z = {self.z_cm} cm"
            self.page.wait_for_timeout(30)
