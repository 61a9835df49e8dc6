import pytest
from dockpose.app.inputs.pictures import load_sample
from dockpose.sidecar import sample_path

pytestmark = pytest.mark.browser


def true_z_cm(name):
    truth = load_sample(name).truth
    assert truth is not None
    return 100 * truth.position_m[2]


def test_dragged_diameter_ends_on_the_newest_value(page):
    thumb = page.slider("Diameter (cm)").bounding_box()
    x, y = thumb["x"] + thumb["width"] / 2, thumb["y"] + thumb["height"] / 2
    page.page.mouse.move(x, y)
    page.page.mouse.down()
    for step in range(1, 41):
        page.page.mouse.move(x + 3 * step, y)
    page.page.mouse.up()
    box = page.box("Diameter (cm)")
    page.until(lambda: page.app.view.dock.diameter == pytest.approx(float(box.input_value()) / 100))
    diameter_cm = float(box.input_value())
    assert diameter_cm == 36  # the end of the track
    expected = true_z_cm("plain") * diameter_cm / 30
    page.until(lambda: page.z_cm == pytest.approx(expected, rel=0.003))
    box.fill("60")
    page.until(lambda: page.z_cm == pytest.approx(2 * true_z_cm("plain"), abs=0.5))


def test_keys_step_a_slider_and_a_double_click_sets_it_back_to_what_the_file_has(page):
    page.tab("Tank")
    slider = page.slider("fx (px)")
    slider.focus()
    for _ in range(3):
        page.page.keyboard.press("ArrowRight")
        page.rest()
    page.until(lambda: page.app.view.camera.fx == pytest.approx(702.1))
    chip = page.page.get_by_role("button", name="Not as given: fx (px): 700 → 702.1. fy (px): 700 → 702.1")
    chip.wait_for()
    slider.dblclick()
    page.until(lambda: page.app.view.camera == page.app.view.given_camera)
    page.until(lambda: page.box("fx (px)").input_value() == "700")
    chip.wait_for(state="hidden")


def test_a_pixel_of_a_slider_is_a_third_of_a_percent_and_more_is_typed(page):
    page.tab("Tank")
    for label, given in (("fx (px)", 700), ("Diameter (cm)", 30)):
        track = page.row(label).locator(".mantine-Slider-trackContainer").bounding_box()
        assert 0.4 / track["width"] < 0.0037  # of the given number, two fifths of which are the track
        page.box(label).fill(str(2 * given))
        page.until(lambda given=given: given * 2 in (page.app.view.camera.fx, 100 * page.app.view.dock.diameter))
        page.rest()
        page.page.keyboard.press("Tab")
        page.rest()
        page.until(lambda label=label, given=given: page.box(label).input_value() == str(2 * given))
    assert page.app.view.camera.fy == 1400


def test_another_sample_brings_its_own_values(page):
    page.box("fx (px)").fill("900")
    page.until(lambda: page.app.view.camera.fx == 900)
    page.choose("Sample scene", "tilted")
    page.until(lambda: "Dock found in tilted" in page.status)
    page.until(lambda: page.z_cm == pytest.approx(true_z_cm("tilted"), abs=0.3))
    page.until(lambda: page.box("fx (px)").input_value() == "700")


def test_upload_is_seen_with_my_tank(page):
    page.tab("Tank")
    page.page.get_by_role("button", name="Make these my tank").click()
    page.until(lambda: page.app.view.tank.camera is not None)
    page.upload("tank 7.png", sample_path("tilted").read_bytes())
    page.until(lambda: page.has_found("tank 7.png"))
    page.until(lambda: page.z_cm == pytest.approx(true_z_cm("tilted"), abs=0.3))
    assert page.row_names() == ["● A, chosen", "○ B"]
    page.until(lambda: page.box("Sample scene").input_value() == "(own picture)")
    page.choose("Sample scene", "plain")
    page.until(lambda: "Dock found in plain" in page.status)


def test_name_of_an_upload_is_text_not_markup(page):
    name = "<img id=injected src=x onerror=alert(1)>.png"
    page.upload(name, sample_path("plain").read_bytes())
    page.until(lambda: name in page.status)
    assert page.page.locator("#injected").count() == 0


def test_fixed_level_starts_where_hats_left_it_and_can_be_moved(page):
    found = int(page.box("Level (0-255)").input_value())
    assert f"level {found}, which keeps 10 groups" in page.page.locator("body").inner_text()
    page.choose("Threshold by", "Fixed level")
    page.until(lambda: page.app.view.settings.method == "fixed")
    assert page.app.view.settings.level == found
    page.box("Level (0-255)").fill("255")
    page.until(lambda: "No pose" in page.status)
    page.box("Level (0-255)").fill("100")
    page.until(lambda: "Dock found" in page.status)
    page.page.get_by_text("level 100, which keeps 10 groups").wait_for()
    page.choose("Threshold by", "HATS (adaptive)")
    page.until(lambda: page.box("Level (0-255)").input_value() == str(found))
    page.box("Level (0-255)").fill("101")  # moving it means a fixed level
    page.until(lambda: page.box("Threshold by").input_value() == "Fixed level")
    assert (page.app.view.settings.method, page.app.view.settings.level) == ("fixed", 101)
