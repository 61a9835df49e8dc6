import pytest
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options
from dockpose.sidecar import sample_names, sample_path

from tests.browser.conftest import visit
from tests.browser.test_layout import WHOLE

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def app(tmp_path_factory):
    with App(port=0, options=Options(remember_in=tmp_path_factory.mktemp("memory"))) as running:
        yield running


def blur(page):
    page.page.evaluate("document.activeElement.blur()")


STEPS = ("1 of 5: The picture", "2 of 5: Your camera", "3 of 5: The two poses", "4 of 5: How", "5 of 5: Take")


def test_first_visit_is_shown_around_in_five_steps_which_come_back_only_when_asked_for(browser, app):
    with visit(browser, app, first=True) as page:
        page.open()
        strip = page.page.locator("dockpose-steps")
        for words in STEPS:
            strip.get_by_text(words).wait_for()
            assert page.page.locator("[data-step-here]").count() == 1
            picture = page.page.locator("dockpose-picture .stage").bounding_box()
            assert picture["y"] + picture["height"] <= strip.bounding_box()["y"]
            strip.get_by_role("button", name="Done" if words == STEPS[-1] else "Next").click()
        strip.wait_for(state="hidden")
        page.tab("Settings")
        page.page.get_by_role("button", name="Show the first steps").click()
        strip.get_by_text(STEPS[0]).wait_for()
        strip.get_by_role("button", name="Skip").click()
        page.page.reload()
        page.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
        page.page.locator("dockpose-steps").wait_for(state="hidden")
        assert page.page.locator("[data-step-here]").count() == 0


def test_undo_and_redo_by_keys_and_buttons(page):
    page.box("fx (px)").fill("812")
    page.until(lambda: page.app.view.camera.fx == 812)
    blur(page)
    page.page.keyboard.press("Control+z")
    page.until(lambda: page.box("fx (px)").input_value() == "700")
    page.page.get_by_text("fx (px): 812 → 700").wait_for()
    page.page.keyboard.press("Control+Shift+Z")
    page.until(lambda: page.box("fx (px)").input_value() == "812")
    page.tab("Settings")
    page.page.get_by_role("button", name="Undo").click()
    page.until(lambda: page.app.view.camera.fx == 700)
    page.page.get_by_role("button", name="Redo").click()
    page.until(lambda: page.app.view.camera.fx == 812)


@pytest.mark.parametrize("leave", ["blur", "choice by mouse", "choice by keys", "Escape"])
def test_keys_turn_pages_also_when_a_list_had_the_focus(page, leave):
    names = sample_names()
    page.choose("Sample scene", names[1])
    blur(page)
    if leave == "choice by mouse":
        page.choose("Sample scene", names[2])
    elif leave == "choice by keys":
        page.box("Sample scene").press("ArrowDown")
        page.page.get_by_role("listbox").filter(visible=True).wait_for()
        for key in ("ArrowDown", "Enter"):
            page.page.keyboard.press(key)
    elif leave == "Escape":
        page.box("Sample scene").click()
        page.page.get_by_role("listbox").filter(visible=True).wait_for()
        for _ in ("the list", "its box"):
            page.page.keyboard.press("Escape")
            page.rest()
    page.rest()
    page.until(lambda: page.app.wait_until_idle(0.1) and page.app.view.item in page.status)
    at = names.index(page.app.view.item)
    assert (at > 1) == ("choice" in leave)
    page.page.keyboard.press("n")
    page.until(lambda: page.app.view.item == names[at + 1] and page.app.view.item in page.status)
    page.page.keyboard.press("p")
    page.until(lambda: page.app.view.item == names[at])


def test_dark_mode(page):
    scheme = "document.documentElement.getAttribute('data-mantine-color-scheme')"
    page.tab("Settings")
    page.tick("Dark mode (D)")
    page.until(lambda: page.page.evaluate(scheme) == "dark")
    assert page.app.memory.now.dark
    blur(page)
    page.page.keyboard.press("d")
    page.until(lambda: page.page.evaluate(scheme) == "light")


def test_each_tab_leads_to_its_part_of_the_help(page):
    page.tab("Tank")
    with page.page.expect_popup() as popup:
        page.page.locator("a[href='help#tank']").dispatch_event("click")
    popup.value.get_by_role("heading", name="Tank", exact=True).wait_for()
    popup.value.close()


def test_settings_are_saved_and_loaded(page):
    page.box("Diameter (cm)").fill("45")
    page.until(lambda: page.app.view.dock.diameter == 0.45)
    page.tab("Export")
    page.choose("What", "Camera, dock, settings and lights set (YAML)")
    _, saved = page.download("Save")
    page.box("Diameter (cm)").fill("60")
    page.until(lambda: page.app.view.dock.diameter == 0.6)
    page.tab("Settings")
    page.send("Load settings", ("mine.yaml", saved))
    page.until(lambda: page.box("Diameter (cm)").input_value() == "45")


@pytest.fixture
def second(browser, page):
    with visit(browser, page.app, viewport={"width": 1920, "height": 1080}) as other:
        other.open()
        yield other


def test_two_browsers_show_the_same_and_one_may_leave(page, second):
    page.box("fx (px)").fill("750")
    second.until(lambda: second.box("fx (px)").input_value() == "750")
    second.choose("Sample scene", "tilted")
    for one in (page, second):
        one.until(lambda: "Dock found in tilted" in one.status)  # noqa: B023
    name = "own.png"
    second.send("Upload pictures", (name, sample_path("plain").read_bytes()))
    page.until(lambda: name in page.status)
    second.page.close()
    page.until(lambda: len(page.app.server.get_clients()) == 1)
    # What it had under way is forgotten by a callback of its own, a moment after it is gone.
    page.until(lambda: len(page.app._uploads._clients) == 1)
    page.box("fx (px)").fill("760")
    page.until(lambda: page.app.view.camera.fx == 760)


SLIDERS = ("fx (px)", "Number of lights", "k1", "Level (0-255)")


@pytest.mark.parametrize("label", SLIDERS)
def test_while_a_slider_is_drawn_its_value_stands_whole_at_its_handle(page, label):
    handle, value = page.slider(label), page.slider(label).locator(".mantine-Slider-label")

    def is_told():
        """Centred above the handle, as its box has it, in letters that are read."""
        value.wait_for()
        page.until(lambda: value.inner_text() == page.box(label).input_value())
        place, below = value.bounding_box(), handle.bounding_box()
        assert place["x"] + place["width"] / 2 == pytest.approx(below["x"] + below["width"] / 2, abs=1.5)
        assert place["y"] + place["height"] == pytest.approx(below["y"], abs=4)
        assert value.evaluate("one => parseFloat(getComputedStyle(one).fontSize)") >= 12
        return value.evaluate(WHOLE)

    handle.scroll_into_view_if_needed()
    handle.hover()
    page.page.mouse.down()
    before = page.box(label).input_value()
    thumb = handle.bounding_box()
    page.page.mouse.move(thumb["x"] + 25, thumb["y"] + 5, steps=3)
    page.until(lambda: page.box(label).input_value() != before)
    assert is_told()
    page.page.mouse.up()
    page.page.mouse.move(10, 400)
    blur(page)
    value.wait_for(state="detached")
    handle.press("ArrowLeft")
    assert is_told()


def test_reload_in_mid_drag(page):
    page.tab("Tank")
    thumb = page.slider("Diameter (cm)").bounding_box()
    x, y = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    for step in range(1, 15):
        page.page.mouse.move(x + 3 * step, y)
    page.page.reload()
    page.page.locator("dockpose-live #candidates tbody tr").first.wait_for()
    page.until(lambda: page.z_cm is not None)
    page.page.mouse.up()
    page.until(lambda: page.app.wait_until_idle(0.1) and "Dock found" in page.status)
    box = page.box("Diameter (cm)")
    page.until(lambda: float(box.input_value()) == pytest.approx(100 * page.app.view.dock.diameter, abs=0.06))
    box.fill("50")
    page.until(lambda: page.app.view.dock.diameter == 0.5)
