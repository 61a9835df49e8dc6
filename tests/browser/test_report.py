from pathlib import Path

import pytest
from dockpose import estimate
from dockpose.app.experiment import Session
from dockpose.app.export.bundle import session_files
from dockpose.app.inputs.pictures import load_sample

from tests.support.rows import measured

pytestmark = pytest.mark.browser
NASTY = "<img src='http://127.0.0.1:9/x' onerror='document.title=1'><script>alert(1)</script>"


@pytest.fixture
def reader(browser):
    """A bare page, and what it asked for and said meanwhile."""
    context = browser.new_context(viewport={"width": 1000, "height": 800})
    page, told = context.new_page(), []
    page.on("request", lambda request: told.append(request.url))
    page.on("console", lambda message: told.append(message.text))
    page.on("pageerror", lambda error: told.append(str(error)))
    yield page, told
    context.close()


def test_the_report_of_a_session_opens_offline_and_prints(reader, tmp_path: Path):
    page, told = reader
    sample = load_sample("plain")
    found = estimate(sample.image, sample.camera, sample.dock)
    with Session.create(tmp_path / "tank", NASTY) as session:
        session.take(sample.image, found, NASTY, **measured(sample.truth), notes=NASTY)
        files = session_files(session.record)
    report = tmp_path / "report.html"
    report.write_bytes(files["report.html"]())
    page.goto(report.as_uri())
    assert [text for text in told if not text.startswith(("data:", report.as_uri()))] == []
    assert page.locator("h1").inner_text() == "tank"
    assert page.locator("script, img[src^=http]").count() == 0
    assert page.get_by_text(NASTY).count() >= 2
    width = page.evaluate("document.querySelector('img').naturalWidth")
    assert width == 640
    plot = page.locator("figure svg").bounding_box()
    assert plot["width"] > 300
    assert plot["height"] > 200
    pdf = page.pdf(prefer_css_page_size=True)
    assert pdf.startswith(b"%PDF")
    assert pdf.count(b"/Type /Page\n") + pdf.count(b"/Type /Page ") + pdf.count(b"/Type /Page/") <= 4
