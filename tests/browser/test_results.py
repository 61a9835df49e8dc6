import re

import pytest
from dockpose.app.processing.comparison import compared
from dockpose.app.state.changes import with_mask

pytestmark = pytest.mark.browser
POSES = "Which of the two poses"


def line(page):
    return page.page.locator("#status-line").inner_text()


def test_status_line_is_in_view_and_says_what_to_try(page):
    assert re.fullmatch(r"10 lights \| HATS level \d+ \| pose A 100 %, 1\.\d{3} m ± .* \| [\d.]+ ms", line(page))
    page.box("Level (0-255)").fill("255")
    page.until(lambda: "no pose" in line(page))
    assert "Try " in page.status
    place = page.page.locator("#status-line").bounding_box()
    assert 0 <= place["y"] <= place["y"] + place["height"] <= 68  # the strip along the top
    for name in ("place", "status-line", "source", "tank"):
        is_cut = "one => one.scrollWidth > one.parentElement.clientWidth + 1"
        assert not page.page.locator(f"#{name}").evaluate(is_cut), name


def test_a_mask_is_said_where_it_hides_the_dock_and_goes_by_its_chip(page):
    page.tab("Detect")
    page.app.change(lambda view: with_mask(view, 0, 10, 640, 470), reload=True)
    page.until(lambda: "no pose" in line(page))
    page.page.get_by_text("1 mask hides a part of the picture").wait_for()
    page.page.get_by_role("button", name="Mask 1: 640 × 470 px at (0, 10)").click()
    page.until(lambda: page.app.view.settings.masks == () and "pose A" in line(page))


def test_choice_is_overruled_by_hand_and_given_back(page):
    page.unfold(POSES)
    page.page.get_by_text("counts as decided").last.wait_for()
    page.press("B")
    page.until(lambda: "pose B (by hand)" in line(page))
    assert page.row_names() == ["○ A", "● B, chosen", "Truth"]
    page.press("The program's")
    page.until(lambda: "pose A 100 %" in line(page))


_CUT_OFF = """
(card) => [...card.querySelectorAll("*")]
  .filter((one) => one.clientWidth > 0 && one.scrollWidth > one.clientWidth + 1).map((one) => one.textContent)
"""


CANVAS = "canvas[data-engine]"


def card(page, method):
    return page.page.locator(f"dockpose-compare .card[data-method={method}]")


def test_methods_are_compared_over_the_whole_page_and_one_is_taken(page):
    page.tab("Compare")
    cards = page.page.locator("dockpose-compare .card")
    page.until(
        lambda: cards.count() == len(compared()) and page.page.locator("canvas[data-drawn]").count() == cards.count()
    )
    assert page.page.evaluate("document.documentElement.dataset.mode") == "compare"
    assert card(page, "hats").get_attribute("aria-pressed") == "true"
    for words in ("In use", "Right: off by", "Level", "10, 10", "110.0 cm", "6.0°, -12.0°", "100 %", "px", "ms"):
        assert words in card(page, "hats").inner_text(), words
    assert card(page, "hats").locator("canvas[data-drawn]").get_attribute("data-drawn") == "10"
    assert card(page, "hats").locator(".lost").inner_text() == "10 lights: all apart; 0 strays"
    assert cards.first.locator(".verdict").inner_text().startswith("✓ Right")  # the best comes first
    assert card(page, "hats").locator("canvas.histogram").bounding_box()["height"] >= 30
    assert "✕" in card(page, "li").inner_text()  # at level 13 the water's noise is no ring, and it says so
    assert "No dock" in card(page, "li").inner_text()
    for method in compared():  # all of them in view, and nothing cut off
        place = card(page, method).bounding_box()
        assert place["width"] >= 200
        assert 0 <= place["x"] <= place["x"] + place["width"] <= 1366
        assert place["y"] + place["height"] <= 768
        assert card(page, method).evaluate(_CUT_OFF) == []
    assert page.page.locator(CANVAS).bounding_box()["x"] < 0  # it gives the cards all the room, until a card is pressed
    card(page, "otsu").click()
    page.until(lambda: page.app.view.settings.method == "otsu")
    page.until(lambda: page.page.locator(CANVAS).bounding_box()["x"] > 700)  # with the method's docks
    assert card(page, "otsu").bounding_box()["x"] < 700
    page.until(lambda: card(page, "otsu").get_attribute("aria-pressed") == "true")
    assert [one for one in compared() if card(page, one).get_attribute("aria-pressed") == "true"] == ["otsu"]
    assert page.page.locator("#outdated").count() == 0  # the method in use changes nothing of the comparison
    card(page, "yen").focus()
    page.page.keyboard.press("Enter")
    page.until(lambda: page.app.view.settings.method == "yen")
    page.page.keyboard.press("Escape")
    page.until(lambda: page.page.evaluate("document.documentElement.dataset.mode") == "picture")
    page.until(lambda: page.box("Threshold by").input_value() == "Yen")
    page.tab("Compare")
    page.page.get_by_role("button", name="Back to the picture").click()
    page.until(lambda: page.page.locator("dockpose-picture .stage").is_visible())


@pytest.mark.parametrize("name", ["uneven lighting", "plain tank", "strong ambient light"])
def test_scenes_of_the_paper_are_chosen_and_compare_has_its_figure_15(page, name):
    page.unfold("Simulate")
    page.until(lambda: page.page.locator("[style*='will-change: height']").count() == 0)
    page.choose("Scene of the paper", name)
    page.until(lambda: page.has_found(name) and page.app.view.source == name)
    page.tab("Compare")
    table = page.page.locator("table.figure-15")
    page.until(lambda: name in page.page.locator("dockpose-compare [role=note]").inner_text())
    levels = {row.split("\t")[0]: row.split("\t")[1] for row in table.inner_text().splitlines() if "right" in row}
    assert list(levels) == ["HATS", "Otsu", "Sezan", "Kittler", "Kapur"]
    for method, level in levels.items():
        assert level in card(page, method.lower()).locator("dl").inner_text()
    assert card(page, "hats").locator(".lost").inner_text().startswith("10 lights: ")
    card(page, "sezan").click()
    page.until(lambda: f"Sezan level {levels['Sezan']}" in line(page))
    assert page.page.locator("#outdated").count() == 0  # the scene is not rendered anew for it
    page.tab("Picture")
    page.box("Dock z (cm)").fill("150")
    page.until(lambda: page.box("Scene of the paper").input_value() == "(none)")
    page.tab("Compare")
    page.until(lambda: "simulated scene" in page.page.locator("dockpose-compare [role=note]").inner_text())
    assert table.count() == 0
    page.tab("Picture")


def test_results_of_another_picture_are_dimmed_until_compared_again(page):
    page.tab("Compare")
    page.until(lambda: page.page.locator("dockpose-compare .card").count() == len(compared()))
    page.until(lambda: page.page.locator("#outdated").count() == 0)
    page.page.evaluate("document.activeElement.blur()")
    page.page.keyboard.press("n")
    page.page.locator("#outdated").wait_for()
    assert "results for plain" in page.page.locator("#outdated").inner_text()
    assert float(page.page.locator("dockpose-compare .cards").evaluate("one => getComputedStyle(one).opacity")) < 0.6
    page.page.get_by_role("button", name="Compare again").click()
    page.until(lambda: page.page.locator("#outdated").count() == 0)
    assert page.app.view.source in page.page.locator("dockpose-compare [role=note]").inner_text()
    page.tab("Picture")
    page.choose("Sample scene", "side_glow")  # where HATS by itself finds no dock
    page.until(lambda: page.has_found("side_glow"))
    page.tab("Compare")  # opening it is enough
    page.until(lambda: "Steps in" in card(page, "hats_local").inner_text())
    page.until(lambda: "Found no dock by itself: HATS local stepped in" in card(page, "hats").inner_text())
    assert "No dock:" not in card(page, "hats").inner_text()
    for method, verdict in (("hats_local", "Right"), ("kapur", "Right"), ("otsu", "No dock")):
        assert verdict in card(page, method).locator(".verdict").inner_text()
    page.tab("Picture")
    page.choose("Sample scene", "plain")
    page.tab("Compare")
    page.until(lambda: "plain." in page.page.locator("dockpose-compare [role=note]").inner_text())
    page.tab("Picture")
