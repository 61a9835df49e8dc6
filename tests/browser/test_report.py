from pathlib import Path

import pytest
from dockpose import estimate
from dockpose.app.drawing.figures import picture_figure, to_svg
from dockpose.app.experiment import Session
from dockpose.app.export.bundle import session_files
from dockpose.app.inputs.pictures import load_sample

from tests.support.rows import measured

pytestmark = pytest.mark.browser
NASTY = "<img src='http://127.0.0.1:9/x' onerror='document.title=1'><script>alert(1)</script>"

# How many pixels of an SVG file are painted within 12 levels of a colour.
PAINTED = """async ([svg, colour]) => {
  const picture = new Image();
  picture.src = 'data:image/svg+xml;base64,' + btoa(unescape(encodeURIComponent(svg)));
  await picture.decode();
  const canvas = new OffscreenCanvas(picture.width, picture.height), pen = canvas.getContext('2d');
  pen.drawImage(picture, 0, 0);
  const data = pen.getImageData(0, 0, canvas.width, canvas.height).data;
  let found = 0;
  for (let i = 0; i < data.length; i += 4)
    found += [0, 1, 2].every(k => Math.abs(data[i + k] - colour[k]) <= 12) ? 1 : 0;
  return found;
}"""


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


def test_the_annotated_svg_is_rendered_with_its_picture_and_its_words(reader, tmp_path: Path):
    page, told = reader
    sample = load_sample("tilted")
    found = estimate(sample.image, sample.camera, sample.dock)
    path = tmp_path / "annotated.svg"
    path.write_bytes(to_svg(picture_figure(sample.image, found)))
    page.goto(path.as_uri())
    assert [text for text in told if not text.startswith(("data:", path.as_uri()))] == []
    assert "dock centre" in page.locator("svg").first.text_content()
    box = page.locator("image").bounding_box()
    assert box["width"] / box["height"] == pytest.approx(640 / 480, rel=0.02)
    # What is painted: pose A's blue, the ellipse's pink, the white of the legend and the water's darkness.
    for colour, least in (((0, 114, 178), 100), ((204, 121, 167), 100), ((255, 255, 255), 5000), ((17, 17, 17), 5000)):
        assert page.evaluate(PAINTED, [path.read_text(encoding="utf-8"), list(colour)]) > least
