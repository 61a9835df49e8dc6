"""The tab Play in a real browser: each control, and what it changes on the page and in the program."""

import cv2
import numpy as np
import pytest
from dockpose.app.state.parameters import put
from dockpose.app.web.panels.play import NONE_CHOSEN

from tests.browser.conftest import visit

COURSE = "simulated sweep"


@pytest.fixture
def sequence(page):
    """A simulated course, on its first frame; nothing is open afterwards."""
    page.tab("Source")
    page.choose("Sequence", COURSE)
    page.until(lambda: f"{COURSE}, frame 1 of 250" in page.status)
    yield page
    page.tab("Source")
    page.choose("Sequence", NONE_CHOSEN)
    page.until(lambda: page.app.player is None)


def words(page):
    return page.page.locator("#sequence").inner_text()


def line(page):
    return page.page.locator("dockpose-timeline")


def test_course_plays_pauses_and_is_drawn_on_the_time_line(sequence):
    assert line(sequence).is_visible()
    sequence.press("Play")
    sequence.until(lambda: sequence.app.player.index > 12)
    sequence.press("Pause")
    sequence.until(lambda: sequence.app.wait_until_idle(1) and not sequence.app.is_playing)
    index = sequence.app.player.index
    sequence.until(lambda: f"frame {index + 1} of 250" in sequence.status)
    sequence.until(lambda: f"Followed for {index + 1} frames" in words(sequence))
    sequence.until(lambda: line(sequence).get_attribute("data-points") == str(index + 1))
    assert f"Frame {index + 1} of 250 · {index / 25:.2f} s" in line(sequence).inner_text()
    assert len(sequence.app.scene._path.points) > 5
    place = line(sequence).bounding_box()
    assert place["y"] + place["height"] == 768
    root = sequence.page.locator("#root").bounding_box()
    assert root["y"] + root["height"] <= place["y"]
    sequence.rest()
    assert sequence.app.player.index == index


def test_light_drawing_stands_for_the_3d_view_while_playing_without_a_graphics_card(sequence):
    drawing = sequence.page.locator("dockpose-scene")
    drawing.wait_for(state="hidden")
    sequence.press("Play")
    sequence.until(lambda: drawing.is_visible() and drawing.locator(".disc").count() == 2)
    pane, *parts = drawing.evaluate(
        """(one) => [one, ...one.querySelectorAll(".disc, .plane")].map((part) => {
          const { left, top, right, bottom } = part.getBoundingClientRect();
          return [left, top, right, bottom];
        })"""
    )
    assert len(parts) == 3
    for left, top, right, bottom in parts:
        assert pane[0] <= left < right <= pane[2]
        assert pane[1] <= top < bottom <= pane[3]
    assert drawing.locator(".disc.face.chosen").count() == 1  # the face looks at the camera, and so at the eye
    first = drawing.locator(".disc.chosen").get_attribute("d")
    sequence.until(lambda: drawing.locator(".disc.chosen").get_attribute("d") != first)
    sequence.press("Pause")
    drawing.wait_for(state="hidden")


def test_time_line_is_pointed_at_clicked_dragged_and_steered_by_keys(sequence):
    canvas = line(sequence).locator("canvas")
    place = canvas.bounding_box()

    def x(frame):  # where a frame of 250 is, between the margins of 52 and 10 pixels
        return place["x"] + 52 + (frame - 1) / 249 * (place["width"] - 62)

    y = place["y"] + 30
    sequence.page.mouse.move(x(1), y)
    readout = line(sequence).locator(".readout")
    sequence.until(lambda: "Frame 1 · 0.00 s · z " in readout.inner_text() and "likely" in readout.inner_text())
    sequence.page.mouse.move(x(100), y)
    sequence.until(lambda: readout.inner_text() == "Frame 100 · not played yet")
    sequence.page.mouse.click(x(100), y)
    sequence.until(lambda: "frame 100 of 250" in sequence.status)
    sequence.page.mouse.down()
    sequence.page.mouse.move(x(150), y, steps=5)
    sequence.page.mouse.move(x(200), y, steps=5)
    sequence.page.mouse.up()
    sequence.until(lambda: "frame 200 of 250" in sequence.status)
    canvas.focus()
    for key, frame in (("ArrowRight", 201), ("Shift+ArrowLeft", 191), ("Home", 1), ("End", 250)):
        sequence.page.keyboard.press(key)
        sequence.until(lambda: f"frame {frame} of 250" in sequence.status)  # noqa: B023
    assert canvas.get_attribute("aria-valuenow") == "250"
    assert canvas.get_attribute("aria-valuetext").startswith("Frame 250 · 9.96 s")


def test_new_browser_has_the_whole_course_and_gaps_are_gaps(sequence, browser):
    sequence.press("Play")
    sequence.until(lambda: sequence.app.player.index > 30)
    sequence.app.change(lambda view: put(view, "min_area_px", 1000))  # nothing is as large: no dock
    last = sequence.app.player.index
    sequence.until(lambda: sequence.app.player.index > last + 40)
    sequence.app.change(lambda view: put(view, "min_area_px", 2))
    last = sequence.app.player.index
    sequence.until(lambda: sequence.app.player.index > last + 10)
    sequence.press("Pause")
    sequence.until(lambda: sequence.app.wait_until_idle(1) and not sequence.app.is_playing)
    seen = str(sequence.app.player.index + 1)
    sequence.until(lambda: line(sequence).get_attribute("data-points") == seen)
    assert line(sequence).get_attribute("data-gaps") == "1"
    with visit(browser, sequence.app) as other:
        other.page.goto(sequence.app.address)
        line(other).wait_for()
        other.until(lambda: line(other).get_attribute("data-points") == seen, 30)
        assert line(other).get_attribute("data-gaps") == "1"


_SAMPLES = """
(milliseconds) => new Promise((done) => {
  const began = performance.now();
  const samples = new Set();
  const number = (selector) => document.querySelector(selector).innerText.match(/[fF]rame (\\d+)/)?.[1];
  const look = (now) => {
    samples.add([number("[role=status]"), document.querySelector("dockpose-picture").dataset.frame].join(" "));
    if (now - began < milliseconds) requestAnimationFrame(look);
    else done([...samples]);
  };
  requestAnimationFrame(look);
})
"""


def test_while_playing_all_that_is_drawn_is_of_the_same_frame(sequence):
    sequence.press("Play")
    samples = sequence.page.evaluate(_SAMPLES, 5000)
    sequence.press("Pause")
    assert len(samples) > 5
    assert [one for one in samples if len(set(one.split())) > 1] == []


def test_steps_and_key(sequence):
    sequence.press("Forward")
    sequence.until(lambda: "frame 2 of 250" in sequence.status)
    sequence.press("Back")
    sequence.until(lambda: "frame 1 of 250" in sequence.status)
    sequence.page.evaluate("document.activeElement.blur()")
    sequence.page.keyboard.press("k")
    sequence.until(lambda: sequence.app.is_playing)
    sequence.page.keyboard.press("k")
    sequence.until(lambda: not sequence.app.is_playing)


def test_speed_and_the_end(sequence):
    line(sequence).get_by_label("Speed").select_option("4")
    sequence.until(lambda: sequence.app.player._speed == 4.0)
    sequence.until(lambda: line(sequence).get_by_label("Speed").input_value() == "4")
    line(sequence).get_by_label("Speed").select_option("2")
    sequence.until(lambda: sequence.app.player._speed == 2.0)
    line(sequence).locator("canvas").focus()
    for key, frame in (("End", 250), ("Shift+ArrowLeft", 240)):
        sequence.page.keyboard.press(key)
        sequence.until(lambda: f"frame {frame} of 250" in sequence.status)  # noqa: B023
    sequence.press("Play")
    sequence.until(lambda: "frame 250 of 250" in sequence.status)
    sequence.page.get_by_role("button", name="Play", exact=True).wait_for()


def test_time_line_follows_the_dark_at_rest(sequence):
    brightest = """() => {
      const canvas = document.querySelector("dockpose-timeline canvas");
      const { data } = canvas.getContext("2d").getImageData(0, 0, 48, canvas.height); // the words beside it
      return data.filter((_, at) => at % 4 === 0).reduce((most, one) => Math.max(most, one), 0);
    }"""
    sequence.until(lambda: sequence.page.evaluate(brightest) < 100)
    sequence.page.emulate_media(color_scheme="dark")
    sequence.until(lambda: sequence.page.evaluate(brightest) > 150)
    sequence.page.emulate_media(color_scheme="light")
    sequence.until(lambda: sequence.page.evaluate(brightest) < 100)


def test_play_opens_the_first_sequence_where_none_is_open(page):
    page.page.get_by_role("button", name="Play", exact=True).click()
    page.until(lambda: page.app.is_playing and "simulated approach, frame" in page.status)
    page.choose("Sequence", NONE_CHOSEN)
    page.page.locator("dockpose-timeline").wait_for(state="hidden")


def test_another_picture_closes_the_sequence(sequence):
    sequence.tab("Source")
    sequence.choose("Sample scene", "turbid")
    sequence.until(lambda: "Dock found in turbid" in sequence.status)
    sequence.tab("Source")
    sequence.until(lambda: sequence.box("Sequence").input_value() == NONE_CHOSEN)
    assert "No sequence is open. Choose one here, or send a video" in words(sequence)


def video(tmp_path):
    writer = cv2.VideoWriter(str(tmp_path / "tank.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 25, (320, 240))
    for level in (0, 50, 100, 150):
        writer.write(np.full((240, 320, 3), level, np.uint8))
    writer.release()
    return (tmp_path / "tank.avi").read_bytes()


def test_video_is_uploaded_and_one_without_a_dock_is_a_result(page, tmp_path):
    page.send("Upload a video", ("tank.avi", video(tmp_path)))
    page.until(lambda: "tank.avi, frame 1 of 4" in page.status)
    assert "No pose" in page.status
    page.tab("Source")
    page.until(lambda: "The dock is lost" in words(page))
    page.choose("Sequence", NONE_CHOSEN)


def test_dropped_video_opens_the_tab_and_plays(page, tmp_path):
    page.tab("Detect")
    page.drop("dropped.avi", video(tmp_path), "video/x-msvideo")
    page.until(lambda: "dropped.avi, frame 1 of 4" in page.status)
    page.choose("Sequence", NONE_CHOSEN)


def test_play_pressed_twice_takes_no_frame(page):
    button = page.page.get_by_role("button", name="Play", exact=True)
    box = button.bounding_box()
    place = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.page.mouse.click(*place)
    page.until(lambda: page.app.opened is not None and not button.is_visible())
    on_top = page.page.evaluate(
        "([x, y]) => document.elementFromPoint(x, y)?.closest('button')?.textContent ?? ''", place
    )
    assert on_top in ("", "Play")
