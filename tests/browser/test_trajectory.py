"""Results and a trajectory added in the tab Log: what is found, the worst frames, and the report."""

import io
import zipfile

import pytest

from tests.browser.conftest import visit
from tests.support.moving import draw
from tests.support.trajectories import result_lines, tum_lines

pytestmark = pytest.mark.browser
SEND = "Compare with a trajectory"


def send_results(page, results):
    page.open()
    page.tab("Log")
    page.send(SEND, ("film.jsonl", result_lines(results).encode()))
    page.page.get_by_text("film.jsonl is here; now the trajectory.").wait_for()


def told(page):
    return " ".join(page.page.locator("#truth").all_inner_texts())


def test_a_trajectory_is_compared_and_the_report_saved(browser, app):
    moved = draw(2, duration_s=30.0, gaps=0)
    with visit(browser, app) as page:
        send_results(page, moved.results)
        page.send(SEND, ("truth.tum", tum_lines(moved.truth).encode()))
        page.page.locator("#truth-rms").wait_for()
        assert "Clocks: add 3.7" in told(page)
        assert page.page.locator("img[alt=space]").is_visible()
        page.page.get_by_role("button", name="Look at").first.click()
        page.page.get_by_text("film.mkv: is not there; open it to look at frame").first.wait_for()
        name, data = page.download("Save the comparison")
        assert name == "compared.zip"
        assert "report.html" in zipfile.ZipFile(io.BytesIO(data)).namelist()
        assert page.errors == []


def test_a_file_that_is_none_is_told_in_one_sentence(browser, app):
    moved = draw(2, duration_s=30.0, gaps=0)
    with visit(browser, app) as page:
        send_results(page, moved.results)
        page.send(SEND, ("truth.tum", b"Dear all,\nsee attached\n"))
        page.page.get_by_text("as no trajectory that is known").first.wait_for()
