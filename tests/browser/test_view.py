"""The picture and its histogram in a real browser: what is drawn where, and what each control changes."""

import base64
import io
import math
from itertools import pairwise
from typing import Any

import cv2
import numpy as np
import pytest
from dockpose.app.drawing import colours
from dockpose.app.drawing.annotated import kept_pixels
from dockpose.app.inputs.pictures import load_sample
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_method
from dockpose.app.state.parameters import put
from dockpose.app.state.view import open_source
from dockpose.camera.image import to_grey
from PIL import Image

pytestmark = pytest.mark.browser

STAGE = "dockpose-picture .stage"
_PIXELS = """() => document.querySelector("dockpose-picture canvas").toDataURL("image/png")"""


def found_in(view) -> Any:
    """The estimate; each of these pictures has all of its stages."""
    return analyse(view).estimate


def button(page, name):
    return page.page.locator(f"dockpose-picture [data-do={name}]")


def press(page, name):
    button(page, name).click()
    page.rest()


def readout(page, part="picture"):
    page.rest()
    return page.page.locator(f"dockpose-{part} .readout").inner_text()


def pixels(page):
    """The canvas as rows of red, green and blue."""
    file = base64.b64decode(page.page.evaluate(_PIXELS).split(",")[1])
    return np.array(Image.open(io.BytesIO(file)).convert("RGB"))


def on_screen(page, x, y):
    """Where a pixel of the picture is in the window, by the canvas that shows it while no frames follow each other."""
    place = page.page.wait_for_function(
        """() => {
          const canvas = document.querySelector("dockpose-picture canvas");
          const { left, top, width, height } = canvas.getBoundingClientRect();
          return width > 0 && [left, top, width / canvas.width, height / canvas.height];
        }"""
    ).json_value()
    left, top, across, down = place
    return left + (x + 0.5) * across, top + (y + 0.5) * down


def lights(page):
    """Middle in the window of each light's circle, by its number, and the light's place in the picture."""
    found = page.page.evaluate(
        """() => [...document.querySelectorAll("dockpose-picture [data-light]")].map((one) => {
          const { left, right, top, bottom } = one.querySelector("circle").getBoundingClientRect();
          return [one.dataset.light, (left + right) / 2, (top + bottom) / 2, +one.dataset.x, +one.dataset.y];
        })"""
    )
    return {int(number): ((x, y), (px, py)) for number, x, y, px, py in found}


def middle(locator):
    box = locator.bounding_box()
    return box["x"] + box["width"] / 2, box["y"] + box["height"] / 2


def drag(page, start, end, steps=5):
    page.page.mouse.move(*start)
    page.page.mouse.down()
    page.page.mouse.move(*end, steps=steps)
    page.page.mouse.up()
    page.rest()


def check_lights(page):
    found = lights(page)
    markers = found_in(page.app.view).markers
    assert sorted(found) == list(range(1, 11))
    for screen, place in found.values():
        assert screen == pytest.approx(on_screen(page, *place), abs=0.3)
        assert np.linalg.norm(markers.points_px - place, axis=1).min() < 0.01


def scale(page):
    (x0, _), (x1, _) = on_screen(page, 0, 0), on_screen(page, 1, 0)
    return x1 - x0


def zoom_about(page, place, least):
    """Turn the wheel at a place of the window until a pixel of the picture is so large."""
    page.page.mouse.move(*place)
    for _ in range(20):
        if scale(page) >= least:
            return
        page.page.mouse.wheel(0, -300)
        page.rest()
    pytest.fail(f"the wheel does not zoom at {place}")


def test_overlay_stays_on_the_picture_while_it_is_zoomed_and_panned(page):
    check_lights(page)
    whole = scale(page)
    before = on_screen(page, 400, 200)
    place = tuple(map(round, before))
    zoom_about(page, place, 2 * whole)
    # The pointer, on a whole pixel of the screen, stays on what it points at.
    wanted = np.array(place) + (np.array(before) - place) * scale(page) / whole
    assert on_screen(page, 400, 200) == pytest.approx(tuple(wanted), abs=0.3)
    before = on_screen(page, 400, 200)
    check_lights(page)
    drag(page, place, (place[0] - 60, place[1] + 40))
    assert on_screen(page, 400, 200) == pytest.approx((before[0] - 60, before[1] + 40), abs=0.3)
    check_lights(page)
    press(page, "fit")
    assert scale(page) == pytest.approx(whole)


def test_zoom_is_kept_while_a_slider_moves_and_the_lines_stay_thin(page):
    zoom_about(page, middle(page.page.locator(STAGE)), 3)
    before = scale(page)
    page.box("Level (0-255)").fill("150")
    page.until(lambda: page.app.view.settings.level == 150 and page.app.wait_until_idle(1))
    page.rest()
    assert scale(page) == pytest.approx(before)
    width = page.page.locator("dockpose-picture .ellipse").first.evaluate("(one) => getComputedStyle(one).strokeWidth")
    assert float(width.removesuffix("px")) < 3


def test_toggles_show_the_picture_what_is_kept_and_what_was_found(page):
    grey = to_grey(page.app.view.image)
    assert page.page.locator("dockpose-picture [data-pose]").count() == 2
    np.testing.assert_array_equal(pixels(page)[:, :, 0], grey)  # nothing is burnt in
    press(page, "thresholded")
    assert button(page, "thresholded").get_attribute("aria-pressed") == "true"
    assert button(page, "annotated").get_attribute("aria-pressed") == "false"
    check_lights(page)
    page.page.get_by_text("○ 10 on the ring").wait_for()
    kept = kept_pixels(page.app.view.image, found_in(page.app.view))
    np.testing.assert_array_equal(pixels(page).any(axis=2), kept)


@pytest.mark.parametrize("method", ["hats", "hats_local"])
def test_kept_pixels_have_the_colour_of_what_became_of_their_group(page, method):
    """Where text is burnt in, its letters are thrown out, and specks are too small to be a group."""
    view = with_method(open_source("sample_images/burnt_in_text.png", None, None), method)
    page.app.change(lambda _: put(view, "min_area_px", 3), reload=True)
    page.until(lambda: "burnt_in_text" in page.status and page.app.wait_until_idle(1))
    press(page, "thresholded")
    found = found_in(page.app.view)
    page.until(lambda: page.page.locator("dockpose-picture [data-thrown-out]").count() == (~found.ring.on_ring).sum())
    shown, kept = pixels(page), kept_pixels(page.app.view.image, found)
    np.testing.assert_array_equal(shown.any(axis=2), kept)
    for index, is_light in enumerate(found.ring.on_ring):
        left, top, right, bottom = found.markers.boxes_px[index]
        box = slice(top, bottom + 1), slice(left, right + 1)
        wanted = colours.rgb(colours.LIGHT_COLOUR if is_light else colours.DROPPED_COLOUR)
        assert (shown[box][kept[box]] == wanted).all(axis=1).mean() > 0.5  # a neighbour's may reach into the box


def test_readout_is_the_grey_of_the_pixel_under_the_pointer(page):
    grey = to_grey(page.app.view.image)
    brightest = np.unravel_index(int(grey.argmax()), grey.shape)
    page.page.mouse.move(
        *map(math.floor, on_screen(page, 639, 440))
    )  # the last one, beside the bar that shares the room
    assert readout(page).startswith("x 639, y ")
    for y, x in (brightest, (100, 200), (5, 0), (440, 630)):
        press(page, "fit")
        zoom_about(page, tuple(map(math.floor, on_screen(page, int(x), int(y)))), 4)
        page.page.mouse.move(*on_screen(page, int(x), int(y)))
        assert readout(page) == f"x {x}, y {y}: grey {grey[y, x]}"
    press(page, "fit")
    press(page, "out")
    stage = page.page.locator(STAGE).bounding_box()
    page.page.mouse.move(stage["x"] + 3, stage["y"] + 100)  # beside the picture
    assert readout(page) == ""


def test_readout_of_a_picture_in_colour_is_the_grey_that_is_searched(page):
    page.choose("Sample scene", "colour_ring")
    page.until(lambda: "Dock found in colour_ring" in page.status and page.app.wait_until_idle(1))
    image = load_sample("colour_ring").image
    assert image.ndim == 3
    grey = to_grey(image)
    coloured = np.unravel_index(int((image.max(axis=2) - image.min(axis=2)).argmax()), grey.shape)
    zoom_about(page, tuple(map(math.floor, on_screen(page, int(coloured[1]), int(coloured[0])))), 4)
    page.page.mouse.move(*on_screen(page, int(coloured[1]), int(coloured[0])))
    page.until(lambda: f"grey {grey[coloured]}" in page.page.locator("dockpose-picture .readout").inner_text())


def test_contrast_is_stretched_and_given_back(page):
    page.choose("Sample scene", "faint")
    page.until(lambda: page.has_found("faint") and page.app.wait_until_idle(0.1))
    page.until(lambda: pixels(page).max() == page.app.view.image.max())
    plain = pixels(page)
    press(page, "contrast")
    stretched = pixels(page)
    assert stretched.std() > 2 * plain.std()
    zoom_about(page, tuple(map(math.floor, on_screen(page, 200, 100))), 4)
    page.page.mouse.move(*on_screen(page, 200, 100))
    assert readout(page).endswith(f"grey {to_grey(page.app.view.image)[100, 200]}")
    press(page, "contrast")
    np.testing.assert_array_equal(pixels(page), plain)


def test_mask_is_drawn_with_the_mouse_and_changes_the_result(page):
    press(page, "mask")
    x, y = page.app.view.image.shape[1] // 2, 0
    drag(page, on_screen(page, x, y), on_screen(page, 639, 479))
    page.until(lambda: len(page.app.view.settings.masks) == 1)
    (mask,) = page.app.view.settings.masks
    assert mask == pytest.approx((320, 0, 320, 480), abs=2)
    page.until(lambda: page.page.locator("dockpose-picture [data-mask]").count() == 1)
    page.until(lambda: "10 lights" not in page.status)
    assert button(page, "mask").get_attribute("aria-pressed") == "false"  # the next drag pans
    page.page.get_by_role("button", name="Mask 1:").click()  # the chip above the picture
    page.until(lambda: page.app.view.settings.masks == () and "Dock found" in page.status)


def test_click_with_the_mask_in_hand_masks_nothing_until_the_second(page):
    press(page, "mask")
    page.page.mouse.click(*on_screen(page, 10, 10))
    page.rest()
    assert page.app.view.settings.masks == ()
    page.page.keyboard.press("Escape")
    page.rest()
    assert button(page, "mask").get_attribute("aria-pressed") == "false"
    press(page, "mask")
    page.page.mouse.click(*on_screen(page, 10, 10))
    page.page.mouse.click(*on_screen(page, 60, 40))
    page.until(lambda: len(page.app.view.settings.masks) == 1)
    assert page.app.view.settings.masks[0] == pytest.approx((10, 10, 51, 31), abs=2)


def test_ruler_measures_pixels_and_centimetres_at_the_dock(page):
    press(page, "ruler")
    drag(page, on_screen(page, 100, 100), on_screen(page, 400, 100))
    words = page.page.locator("dockpose-picture text.ruler").text_content()
    pixels_, length = words.split(", ")
    assert float(pixels_.removesuffix(" px")) == pytest.approx(300, abs=2)
    pose, camera = found_in(page.app.view).selected, page.app.view.camera
    centimetres = 100 * 300 * pose.position_m[2] / camera.fx
    assert float(length.removesuffix(" cm at the dock")) == pytest.approx(centimetres, rel=0.02)
    press(page, "ruler")
    assert page.page.locator("dockpose-picture text.ruler").count() == 0


def test_picture_is_worked_by_keys_alone(page):
    page.page.locator(STAGE).focus()
    whole = scale(page)
    for key in ("+", "+"):
        page.page.keyboard.press(key)
    page.rest()
    assert scale(page) == pytest.approx(2.25 * whole, rel=0.01)
    before = on_screen(page, 320, 240)
    page.page.keyboard.press("ArrowRight")
    page.rest()
    assert on_screen(page, 320, 240)[0] == pytest.approx(before[0] - 40, abs=0.3)
    for key, name in (("s", "thresholded"), ("a", "annotated")):
        page.page.keyboard.press(key)
        page.rest()
        assert button(page, name).get_attribute("aria-pressed") == "true"
    page.page.keyboard.press("f")
    page.page.keyboard.press("m")  # a mask, with the arrow keys: from the cross to 30 right of it and 20 down
    page.page.keyboard.press("Enter")
    for _ in range(3):
        page.page.keyboard.press("Shift+ArrowRight")
    for _ in range(2):
        page.page.keyboard.press("Shift+ArrowDown")
    x, y = page.app.view.image.shape[1] // 2 + 30, page.app.view.image.shape[0] // 2 + 20
    assert f"x {x}, y {y}" in readout(page).replace("x 349", "x 350")
    page.page.keyboard.press("Enter")
    page.until(lambda: len(page.app.view.settings.masks) == 1)
    assert page.app.view.settings.masks[0][2:] == (31, 21)


def test_no_picture_is_sent_again_when_a_slider_moves(page):
    page.page.evaluate(
        """() => {
          window.pictures = 0;
          new MutationObserver((changes) => {
            for (const { addedNodes } of changes) for (const node of addedNodes) {
              if (node.getAttribute?.("name") === "picture") window.pictures += 1;
            }
          }).observe(document.body, { childList: true, subtree: true });
        }"""
    )
    drawn = page.page.locator("dockpose-picture")
    before = int(drawn.get_attribute("data-drawn"))
    for level in (100, 110, 120, 130):
        page.box("Level (0-255)").fill(str(level))
        page.until(lambda level=level: page.app.view.settings.level == level and page.app.wait_until_idle(1))
    page.until(lambda: int(drawn.get_attribute("data-drawn")) > before)
    page.rest()
    assert page.page.evaluate("() => window.pictures") == 0
    page.choose("Sample scene", "tilted")
    page.until(lambda: "Dock found in tilted" in page.status)
    page.until(lambda: page.page.evaluate("() => window.pictures") == 1)


def test_tall_picture_is_shown_whole(page):
    _, data = cv2.imencode(".png", np.full((900, 300), 40, np.uint8))
    page.upload("tall.png", data.tobytes())
    page.until(lambda: "tall.png" in page.status)
    page.until(lambda: pixels(page).shape == (900, 300, 3))
    page.until(lambda: page.page.locator(f"{STAGE}[data-flat]").count() == 0)  # by then the canvas has its place
    press(page, "fit")
    stage = page.page.locator(STAGE).bounding_box()
    (x0, y0), (x1, y1) = on_screen(page, 0, 0), on_screen(page, 299, 899)
    assert stage["x"] <= x0 <= x1 <= stage["x"] + stage["width"]
    assert stage["y"] <= y0 <= y1 <= stage["y"] + stage["height"]


def histogram(page):
    """Window's x of both ends of the bars, which are those of levels 0 and 256, and the path itself."""
    bars = page.page.locator("dockpose-histogram .bars")
    box = bars.bounding_box()
    return box["x"], box["x"] + box["width"], bars.get_attribute("d")


def x_of(page, level):
    left, right, _ = histogram(page)
    return left + (right - left) * (level + 0.5) / 256


def test_votes_stand_over_their_peaks(page):
    labels = page.page.locator("dockpose-histogram text[data-peak]")
    labels.first.wait_for()
    places = sorted((one.bounding_box() for one in labels.all()), key=lambda place: place["x"])
    for one in labels.all():
        assert middle(one)[0] == pytest.approx(x_of(page, int(one.get_attribute("data-peak"))), abs=2)
    for one, next_to in pairwise(places):
        assert one["x"] + one["width"] <= next_to["x"]
    assert "10" in [one.text_content().split("peak")[0] for one in labels.all()]


def test_dragged_threshold_sets_the_level_and_neither_zooms_nor_loses_the_curve(page):
    left, right, bars = histogram(page)
    curve = page.page.locator("dockpose-histogram path.groups").get_attribute("d")
    assert curve.count("M") >= 1
    found = int(page.page.locator("dockpose-histogram .grip").get_attribute("aria-valuenow"))
    y = middle(page.page.locator("dockpose-histogram .grip"))[1]
    drag(page, (x_of(page, found), y), (x_of(page, 90), y), steps=12)
    page.until(lambda: page.app.view.settings.method == "fixed" and page.app.view.settings.level == 90)
    page.until(lambda: page.app.wait_until_idle(1))
    page.until(lambda: page.box("Threshold by").input_value() == "Fixed level")
    page.until(lambda: page.box("Level (0-255)").input_value() == "90")
    page.until(lambda: page.page.locator("dockpose-histogram .grip").get_attribute("aria-valuenow") == "90")
    page.rest()
    assert histogram(page) == (left, right, bars)
    assert page.page.locator("dockpose-histogram path.groups").get_attribute("d") == curve
    assert page.page.locator("dockpose-histogram text[data-peak]").count() > 0


def test_threshold_is_moved_by_keys(page):
    grip = page.page.locator("dockpose-histogram .grip")
    found = int(grip.get_attribute("aria-valuenow"))
    grip.focus()
    for key, level in (("ArrowLeft", found - 1), ("PageDown", found - 11)):
        page.page.keyboard.press(key)
        page.until(lambda level=level: page.app.view.settings.level == level)
    assert page.app.view.settings.method == "fixed"
    page.until(lambda: grip.get_attribute("aria-valuenow") == str(found - 11))


def test_histogram_tells_pixels_and_groups_under_the_pointer(page):
    threshold = found_in(page.app.view).threshold
    level = threshold.level - 20
    _, y = middle(page.page.locator("dockpose-histogram .plot"))
    page.page.mouse.move(x_of(page, level), y)
    words = readout(page, "histogram")
    count, groups = (page.app.view.image == level).sum(), threshold.groups_at_level[level]
    assert words == f"Level {level}: {count} pixel{'' if count == 1 else 's'}; as threshold {groups} groups"
