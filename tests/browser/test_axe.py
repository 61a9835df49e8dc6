"""What axe-core holds against the page at levels A and AA of WCAG 2: in tabs, Compare and a film, light and dark.

Contrast above what is no plain colour it leaves open; ``test_layout.py`` measures that.
"""

import pytest
from axe_playwright_python.sync_playwright import Axe

from tests.browser.conftest import TABS

pytestmark = pytest.mark.browser
LEVELS = ["wcag2a", "wcag2aa", "wcag21a", "wcag21aa", "wcag22aa"]
OPTIONS = {"runOnly": {"type": "tag", "values": LEVELS}, "resultTypes": ["violations"]}
CLOSED = "[data-dock-region=right] [role=button][aria-expanded=false]"
IS_NAMED = "() => [...viserPage.unnamed()].every((one) => !one.checkVisibility())"


@pytest.fixture(params=["light", "dark"])
def tinted(page, request):
    """The page in the colours of a light or a dark system."""

    def tint(scheme):
        page.page.emulate_media(color_scheme=scheme)
        page.page.locator(f"html[data-mantine-color-scheme={scheme}]").wait_for(state="attached")

    tint(request.param)
    yield page
    tint("light")


def failures(page):
    """Each rule that something fails, with what fails it and why."""
    page.rest()
    page.until(lambda: page.page.evaluate(IS_NAMED))  # our script names them soon after they come
    found = Axe().run(page.page, options=OPTIONS).response["violations"]
    return [(rule["id"], one["html"][:200], one["failureSummary"]) for rule in found for one in rule["nodes"]]


@pytest.mark.parametrize("name", TABS)
def test_a_tab_with_all_its_groups_open_has_none(tinted, name):
    tinted.tab(name)
    tinted.rest()
    closed = tinted.page.locator(CLOSED)
    closed.evaluate_all("all => all.forEach((one) => one.click())")
    tinted.until(lambda: closed.count() == 0)
    assert failures(tinted) == []


def test_the_column_of_a_phone_has_none(tinted, resized):
    resized((390, 844))
    tinted.tab("Tank")
    assert failures(tinted) == []


def test_compare_has_none(tinted):
    tinted.tab("Compare")
    tinted.page.locator("dockpose-compare:not([data-old]) .card").nth(8).wait_for()
    assert failures(tinted) == []


def test_a_film_has_none(tinted):
    tinted.choose("Sequence", "simulated approach")
    tinted.page.locator("dockpose-timeline").wait_for()
    tinted.until(lambda: tinted.app.view.list_name == "sequence" and tinted.app.wait_until_idle(0.1))
    assert failures(tinted) == []
    tinted.choose("Sequence", "(none)")
    tinted.page.locator("dockpose-timeline").wait_for(state="hidden")


def test_a_faint_word_and_a_slider_without_a_name_are_failures(page):
    page.tab("Tank")
    assert failures(page) == []
    slider = page.slider("fx (px)")
    slider.evaluate("one => one.removeAttribute('aria-label')")
    label = page.row("Tone curve").locator("label")
    label.evaluate("one => (one.style.color = '#a0a0a0')")
    assert {rule for rule, *_ in failures(page)} == {"aria-input-field-name", "color-contrast"}
    slider.evaluate("one => (one.ariaLabel = 'fx (px)')")
    label.evaluate("one => (one.style.color = '')")
