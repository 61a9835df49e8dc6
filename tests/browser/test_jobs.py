"""The main jobs, each in as few clicks as promised, from the page as it opens."""

import csv
import zipfile

import pytest
from dockpose import Camera
from dockpose.app.processing.comparison import compared
from dockpose.app.state.camera import camera_file
from dockpose.app.state.view import open_source
from dockpose.sidecar import sample_path

from tests.browser.conftest import visit

pytestmark = pytest.mark.browser
OWN = Camera(649.0, 649.0, 319.5, 239.5, 640, 480)


class Hand:
    """Clicks on the page as it opens, and counts."""

    def __init__(self, page):
        self.page, self.clicks = page, 0

    def click(self, role, name):
        self.clicks += 1
        self.page.page.get_by_role(role, name=name, exact=True).click()

    def choose_file(self, name, file):
        """One click, and the dialogue."""
        with self.page.page.expect_file_chooser() as chooser:
            self.click("button", name)
        chooser.value.set_files(file)


@pytest.fixture
def hand(browser, app):
    """The page as it opens, whatever picture and tank the test before has left: words on those stand above the bar."""
    app.change(lambda _: open_source(None, None, None), reload=True)
    with visit(browser, app, accept_downloads=True) as page:
        page.page.goto(app.address)
        page.page.locator("#candidates tbody tr").first.wait_for()
        yield Hand(page)


def test_own_picture_with_own_camera_in_three_clicks_and_two_dialogues(hand):
    picture = {"name": "own.png", "mimeType": "image/png", "buffer": sample_path("tilted").read_bytes()}
    hand.choose_file("Upload pictures", picture)
    hand.page.until(lambda: hand.page.has_found("own.png"))
    hand.click("tab", "Tank")
    camera = {"name": "mine.yaml", "mimeType": "application/yaml", "buffer": camera_file(OWN, "dockpose")}
    hand.choose_file("Load a camera file", camera)
    hand.page.until(lambda: hand.page.app.view.camera == OWN)
    hand.page.until(lambda: hand.page.z_cm == pytest.approx(100 * 649 / 700, rel=0.01))
    assert hand.clicks <= 4


def test_comparison_is_legible_after_one_click(hand):
    hand.click("tab", "Compare")
    drawn = hand.page.page.locator("dockpose-compare canvas[data-drawn]")
    hand.page.until(lambda: drawn.count() == len(compared()))
    sizes = "all => all.map(one => parseFloat(getComputedStyle(one).fontSize))"
    assert min(hand.page.page.locator("dockpose-compare *").evaluate_all(sizes)) >= 12
    assert drawn.first.bounding_box()["height"] >= 100
    assert hand.clicks == 1


def test_row_is_logged_by_one_click_and_the_next_by_a_key(hand, root):
    take = hand.page.page.get_by_role("button", name="Take (T)")
    assert take.bounding_box()["y"] < 100
    hand.click("button", "Take (T)")
    hand.page.page.get_by_text("Frame 1 is on disk").first.wait_for()
    (folder,) = root.iterdir()  # a session was started with it
    with open(folder / "results.csv", encoding="utf-8", newline="") as file:
        assert len(list(csv.DictReader(file))) == 1
    hand.page.page.keyboard.press("t")
    hand.page.page.get_by_text("Frame 2 is on disk").first.wait_for()
    assert list(root.iterdir()) == [folder]
    assert hand.clicks == 1


def test_everything_is_saved_as_a_zip_by_one_click(hand):
    with hand.page.page.expect_download() as download:
        hand.click("button", "Everything as ZIP")
    names = zipfile.ZipFile(download.value.path()).namelist()
    assert {"annotated.png", "result.json", "report.html", "montage.png", "settings.yaml"} <= set(names)
    assert hand.clicks == 1


def test_a_course_plays_after_two_clicks(hand):
    hand.click("button", "Play")
    hand.click("button", f"Play {hand.page.app.sequence.names()[0]}")
    hand.page.until(lambda: hand.page.app.sequence.is_playing)
    hand.page.until(lambda: hand.page.app.sequence.player.index > 5)
    assert hand.page.page.locator("dockpose-timeline").is_visible()
    assert hand.clicks == 2
    hand.click("button", "Pause")
    hand.page.until(lambda: not hand.page.app.sequence.is_playing)
    hand.page.app.sequence.close()
