"""What the program's answer shows of the result, until the page is built."""

from urllib.request import urlopen

import pytest
from dockpose.app.inputs.sequences import given
from dockpose.app.state.view import with_sample
from dockpose.app.web.app import App
from dockpose.sidecar import sample_path

from tests.browser.conftest import LAPTOP, visit

pytestmark = pytest.mark.browser
# Of each frame drawn: whether there is a shell, the live page's table, and a table at all.
WATCH = """
window.frames = [];
const look = () => {
  const [shell, live] = [document.getElementById("shell"), document.querySelector("dockpose-live[name=candidates] td")];
  frames.push([shell !== null, live !== null, document.querySelectorAll("#candidates td").length > 0]);
  requestAnimationFrame(look);
};
requestAnimationFrame(look);
"""
UNCONNECTED = """
const post = Worker.prototype.postMessage;
Worker.prototype.postMessage = function (message, ...rest) {
  if (message?.type !== "set_server") post.call(this, message, ...rest);
};
"""
SHELL = "#shell #candidates"


@pytest.fixture(scope="module")
def app():
    with App(port=0) as running:
        running.wait_until_idle(60)
        yield running


@pytest.fixture
def early(browser, app):
    """A page that viser gets no connection for, so that it is never built."""
    app.change(lambda view: with_sample(view, "plain"), reload=True)
    assert app.wait_until_idle(60)
    with visit(browser, app) as page:
        page.page.add_init_script(UNCONNECTED)
        page.page.goto(app.address)
        page.page.locator(SHELL).wait_for()
        yield page


def served(app):
    with urlopen(app.address, timeout=60) as answer:
        return answer.read().decode()


def test_the_answer_has_verdict_figures_picture_and_table(early):
    analysis = early.app._current
    assert early.page.locator("#shell #trust").inner_text() == analysis.trust.verdict
    z = f"{100 * analysis.estimate.selected.position_m[2]:.1f}"
    assert early.page.locator(f"{SHELL} tbody tr").first.locator("td").nth(3).inner_text() == z
    picture = early.page.locator("#shell img")
    size = picture.evaluate("one => [one.naturalWidth, one.naturalHeight]")
    assert size == [analysis.view.image.shape[1], analysis.view.image.shape[0]]
    wide, high = LAPTOP
    place = picture.bounding_box()
    assert place["width"] * place["height"] > 0.4 * wide * high  # where the live page has its own


def test_no_figure_stays_that_another_browser_has_changed(early):
    early.app.change(lambda view: with_sample(view, "tilted"), reload=True)
    early.page.locator("#shell").wait_for(state="detached")


def test_it_goes_where_the_program_no_longer_answers(early):
    early.page.route("**/alive", lambda route: route.abort())
    early.page.locator("#shell").wait_for(state="detached")


def test_it_gives_way_to_the_live_page_in_one_frame(browser, app):
    with visit(browser, app) as page:
        page.page.add_init_script(WATCH)
        page.open()
        frames = page.page.evaluate("frames")
    assert [True, False, True] in frames  # the shell was there
    assert frames[-1] == [False, True, True]
    assert not any(shell and live for shell, live, _ in frames)
    first = frames.index([True, False, True])
    assert all(has_table for _, _, has_table in frames[first:])


def test_there_is_none_of_a_sequence(tmp_path, app):
    assert 'id="shell"' in served(app)
    app.sequence.open(given(str(sample_path("tilted").parent), None, None))
    assert 'id="shell"' not in served(app)
