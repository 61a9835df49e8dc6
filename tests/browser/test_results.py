import base64
import io
import re

import numpy as np
import pytest
from dockpose.app.processing.comparison import compared
from dockpose.app.state.changes import with_mask
from PIL import Image

pytestmark = pytest.mark.browser
POSES = "Which of the two poses"


def line(page):
    return page.page.locator("#status-line").inner_text()


def test_status_line_is_in_view_and_says_what_to_try(page):
    assert re.fullmatch(r"10 lights \| HATS level \d+ \| pose A \| [\d.]+ ms", line(page))
    page.box("Level (0-255)").fill("255")
    page.until(lambda: page.status.startswith("No pose"))
    assert "Try " in page.status
    place = page.page.locator("#status-line").bounding_box()
    assert 0 <= place["y"] <= place["y"] + place["height"] <= 68  # the strip along the top
    for name in ("place", "status-line", "source", "tank"):
        is_cut = "one => one.scrollWidth > one.parentElement.clientWidth + 1"
        assert not page.page.locator(f"#{name}").evaluate(is_cut), name


def test_a_mask_is_said_where_it_hides_the_dock_and_goes_by_its_chip(page):
    page.tab("Detect")
    page.app.change(lambda view: with_mask(view, 0, 10, 640, 470), reload=True)
    page.until(lambda: page.status.startswith("No pose"))
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
    page.until(lambda: "pose A |" in line(page))


_CUT_OFF = """
(card) => [...card.querySelectorAll("*")]
  .filter((one) => one.clientWidth > 0 && one.scrollWidth > one.clientWidth + 1).map((one) => one.textContent)
"""


def card(page, method):
    return page.page.locator(f"dockpose-compare .card[data-method={method}]")


def compare(page):
    """Open the tab, and wait until all methods are in the row."""
    page.tab("Compare")
    page.until(lambda: page.page.locator("dockpose-compare .card").count() == len(compared()))
    page.page.locator("dockpose-compare .large[data-drawn]").wait_for()
    page.until(lambda: page.page.locator("#outdated").count() == 0)


def looked_at(page):
    """The method whose picture is shown large, and the words about it."""
    shown = page.page.locator("dockpose-compare .large").get_attribute("data-method")
    return shown, page.page.locator("dockpose-compare .told").inner_text()


def white(page, method):
    """Which pixels of a method's small picture are white."""
    url = card(page, method).locator("canvas").evaluate("one => one.toDataURL('image/png')")
    pixels = np.asarray(Image.open(io.BytesIO(base64.b64decode(url.split(",")[1]))).convert("L"))
    assert set(np.unique(pixels)) <= {0, 255}
    return int((pixels == 255).sum())


def test_one_method_is_large_the_others_in_a_row_and_nothing_else_moves(page):
    parts = ("canvas[data-engine]", "#candidates", ".main-number")
    before = [page.page.locator(part).first.bounding_box() for part in parts]
    compare(page)
    assert page.page.evaluate("document.documentElement.dataset.mode") == "compare"
    assert [page.page.locator(part).first.bounding_box() for part in parts] == before
    large = page.page.locator("dockpose-compare .large").bounding_box()
    assert large["width"] * large["height"] > 0.15 * 1366 * 768
    assert page.page.locator("dockpose-compare .histogram").bounding_box()["height"] >= 90
    for method in compared():  # all of them in view, and nothing cut off
        place = card(page, method).bounding_box()
        assert large["x"] <= place["x"] <= place["x"] + place["width"] <= 768
        assert place["y"] + place["height"] <= 768
        assert card(page, method).evaluate(_CUT_OFF) == []
    method, words = looked_at(page)
    assert method == "hats"  # the one in use
    for told in ("In use", "Right: off by", "Level", "10, 10", "110.0 cm", "6.0°, -12.0°", "100 %", "px", "ms"):
        assert told in words, told
    assert page.page.locator("dockpose-compare .large").get_attribute("data-drawn") == "10"
    assert "10 lights: all apart; 0 strays" in words


def test_methods_are_looked_at_by_pointer_and_keys_and_taken_by_use_and_enter(page):
    compare(page)
    card(page, "li").hover()
    method, words = looked_at(page)
    assert method == "li"
    assert "No dock" in words  # at level 13 the water's noise is no ring, and it says so
    assert page.app.view.settings.method == "hats"
    page.page.get_by_role("button", name="Use", exact=True).click()
    page.until(lambda: page.app.view.settings.method == "li")
    page.until(lambda: card(page, "li").get_attribute("aria-pressed") == "true")
    assert [one for one in compared() if card(page, one).get_attribute("aria-pressed") == "true"] == ["li"]
    assert page.page.locator("#outdated").count() == 0  # the method in use changes nothing of the comparison
    order = page.page.locator("dockpose-compare .card").evaluate_all("all => all.map((one) => one.dataset.method)")
    card(page, order[0]).focus()
    page.page.mouse.move(5, 5)
    page.page.keyboard.press("ArrowRight")
    assert looked_at(page)[0] == order[1]
    page.page.keyboard.press("Enter")
    page.until(lambda: page.app.view.settings.method == order[1])
    page.page.keyboard.press("Escape")
    page.until(lambda: page.page.evaluate("document.documentElement.dataset.mode") == "picture")
    page.until(lambda: page.box("Threshold by").input_value() != "Li")
    page.tab("Compare")
    page.page.get_by_role("button", name="Back to the picture").click()
    page.until(lambda: page.page.locator("dockpose-picture .stage").is_visible())


def test_equal_results_have_one_rank_in_the_order_of_the_paper(page):
    compare(page)
    cards = page.page.locator("dockpose-compare .card").all()
    ranks = [int(one.locator(".rank").inner_text().removeprefix("rank ")) for one in cards]
    assert ranks == sorted(ranks)
    best = [one.get_attribute("data-method") for one, rank in zip(cards, ranks, strict=True) if rank == 1]
    paper = ["hats", "hats_local", "otsu", "sezan", "kittler", "kapur"]
    assert best[: len(paper)] == [name for name in paper if name in best]
    assert {"hats", "otsu"} <= set(best)
    assert card(page, "li").locator(".rank").inner_text() != "rank 1"


def test_the_row_is_black_and_white_with_what_each_method_keeps(page):
    compare(page)
    kept = {method: white(page, method) for method in ("hats", "otsu", "li")}
    assert 0 < kept["hats"] < kept["otsu"] < kept["li"]  # the lower the level, the more: 187, 62 and 13


@pytest.mark.parametrize("name", ["uneven lighting", "plain tank", "strong ambient light"])
def test_scenes_of_the_paper_are_chosen_and_compared(page, name):
    page.unfold("Simulate")
    page.until(lambda: page.page.locator("[style*='will-change: height']").count() == 0)
    page.choose("Scene of the paper", name)
    page.until(lambda: page.has_found(name) and page.app.view.source == name)
    page.tab("Compare")
    page.until(lambda: name in page.page.locator("dockpose-compare [role=note]").inner_text())
    page.until(lambda: page.page.locator("#outdated").count() == 0)
    card(page, "sezan").click()
    page.until(lambda: "Sezan level" in line(page))
    assert page.page.locator("#outdated").count() == 0  # the scene is not rendered anew for it
    page.tab("Picture")
    page.box("Dock z (cm)").fill("150")
    page.until(lambda: page.box("Scene of the paper").input_value() == "(none)")


def test_results_of_another_picture_are_dimmed_until_compared_again(page):
    compare(page)
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
    page.until(lambda: "side_glow" in page.page.locator("dockpose-compare [role=note]").inner_text())
    compare(page)
    card(page, "hats").focus()  # what was looked at before is looked at again
    page.until(lambda: "Found no dock by itself: HATS local stepped in" in looked_at(page)[1])
    assert "No dock:" not in looked_at(page)[1]
    for method, verdict in (("hats_local", "Right"), ("kapur", "Right"), ("otsu", "No dock")):
        card(page, method).focus()
        assert verdict in looked_at(page)[1]
        assert ("Steps in" in looked_at(page)[1]) == (method == "hats_local")
    page.tab("Picture")
    page.choose("Sample scene", "plain")
    page.tab("Compare")
    page.until(lambda: "plain." in page.page.locator("dockpose-compare [role=note]").inner_text())
    page.tab("Picture")
