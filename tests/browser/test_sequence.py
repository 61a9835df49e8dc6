"""The tab Sequence in a real browser: each control, and what it changes on the page and in the program."""

import cv2
import numpy as np
import pytest
from dockpose.app.web.panels.sequence import NONE_CHOSEN

COURSE = "simulated sweep"


@pytest.fixture
def sequence(page):
    """A simulated course, on its first frame; nothing is open afterwards."""
    page.tab("Sequence")
    page.choose("Sequence", COURSE)
    page.until(lambda: f"{COURSE}, frame 1 of 250" in page.status)
    yield page
    page.tab("Sequence")
    page.choose("Sequence", NONE_CHOSEN)
    page.until(lambda: page.app._sequence.player is None)


def words(page):
    return page.page.locator("#sequence").inner_text()


def press(page, name):
    page.page.get_by_role("button", name=name, exact=True).click()


def test_course_plays_pauses_and_draws_its_charts(sequence):
    press(sequence, "Play")
    sequence.until(lambda: sequence.app._sequence.player.index > 12)
    press(sequence, "Pause")
    sequence.until(lambda: sequence.app.wait_until_idle(1) and not sequence.app._sequence.is_playing)
    index = sequence.app._sequence.player.index
    sequence.until(lambda: f"frame {index + 1} of 250" in sequence.status)
    sequence.until(lambda: f"Followed for {index + 1} frames" in words(sequence))
    assert sequence.page.locator(".uplot canvas").count() >= 3
    for name in ("z", "θx", "eccentricity", "no dock"):
        assert sequence.page.locator(".u-legend").get_by_text(name, exact=False).first.is_visible()
    assert len(sequence.app._scene._path.points) > 5
    sequence.page.wait_for_timeout(300)
    assert sequence.app._sequence.player.index == index


_SAMPLES = """
(milliseconds) => new Promise((done) => {
  const began = performance.now();
  const samples = new Set();
  const number = (selector) => document.querySelector(selector).innerText.match(/[fF]rame (\\d+)/)?.[1];
  const slider = [...document.querySelectorAll("label")].find((one) => one.textContent.trim() === "Frame");
  let row = slider;
  while (row.querySelector("input:not([type=hidden])") === null) row = row.parentElement;
  const look = (now) => {
    const box = row.querySelector("input:not([type=hidden])").value;
    samples.add([number("[role=status]"), number("#sequence"), box].join(" "));
    if (now - began < milliseconds) requestAnimationFrame(look);
    else done([...samples]);
  };
  requestAnimationFrame(look);
})
"""


def test_while_playing_all_that_is_drawn_is_of_the_same_frame(sequence):
    press(sequence, "Play")
    samples = sequence.page.evaluate(_SAMPLES, 5000)
    press(sequence, "Pause")
    assert len(samples) > 5
    assert [one for one in samples if len(set(one.split())) > 1] == []


def test_steps_slider_and_key(sequence):
    press(sequence, "Forward")
    sequence.until(lambda: "frame 2 of 250" in sequence.status)
    press(sequence, "Back")
    sequence.until(lambda: "frame 1 of 250" in sequence.status)
    sequence.box("Frame").fill("200")
    sequence.until(lambda: "frame 200 of 250" in sequence.status)
    sequence.until(lambda: "Followed for 1 frame;" in words(sequence) or "Followed for 1 frame." in words(sequence))
    sequence.page.locator("[role=status]").click()  # out of the box, in which a k is a letter
    sequence.page.keyboard.press("k")
    sequence.until(lambda: sequence.app._sequence.is_playing)
    sequence.page.keyboard.press("k")
    sequence.until(lambda: not sequence.app._sequence.is_playing)


def test_speed_and_the_end(sequence):
    sequence.choose("Speed (times)", "4")
    sequence.until(lambda: sequence.app._sequence.player._speed == 4.0)
    sequence.box("Frame").fill("245")
    sequence.until(lambda: "frame 245 of 250" in sequence.status)
    press(sequence, "Play")
    sequence.until(lambda: "frame 250 of 250" in sequence.status)
    sequence.page.get_by_role("button", name="Play", exact=True).wait_for()


def test_sliders_of_other_tabs_act_on_the_frame(sequence):
    near = sequence.z_cm
    sequence.box("Diameter (cm)").fill("60")
    sequence.until(lambda: sequence.z_cm == pytest.approx(2 * near, rel=0.01))
    sequence.tab("Sequence")
    press(sequence, "Forward")
    sequence.until(lambda: "frame 2 of 250" in sequence.status)
    assert sequence.z_cm == pytest.approx(2 * near, rel=0.05)


def test_another_picture_closes_the_sequence(sequence):
    sequence.tab("Source")
    sequence.choose("Sample scene", "turbid")
    sequence.until(lambda: "Dock found in turbid" in sequence.status)
    sequence.tab("Sequence")
    sequence.until(lambda: sequence.box("Sequence").input_value() == NONE_CHOSEN)
    assert "No sequence is chosen" in words(sequence)


def video(tmp_path):
    writer = cv2.VideoWriter(str(tmp_path / "tank.avi"), cv2.VideoWriter.fourcc(*"MJPG"), 25, (320, 240))
    for level in (0, 50, 100, 150):
        writer.write(np.full((240, 320, 3), level, np.uint8))
    writer.release()
    return (tmp_path / "tank.avi").read_bytes()


def test_video_is_uploaded_and_one_without_a_dock_is_a_result(page, tmp_path):
    page.tab("Sequence")
    with page.page.expect_file_chooser() as chooser:
        page.page.get_by_role("button", name="Upload a video").click()
    chooser.value.set_files({"name": "tank.avi", "mimeType": "video/avi", "buffer": video(tmp_path)})
    page.until(lambda: "tank.avi, frame 1 of 4" in page.status)
    assert "No pose" in page.status
    page.until(lambda: "The dock is lost" in words(page))
    page.choose("Sequence", NONE_CHOSEN)


def test_dropped_video_opens_the_tab_and_plays(page, tmp_path):
    page.tab("Detect")
    page.page.evaluate(
        """(bytes) => {
            const files = new DataTransfer();
            files.items.add(new File([new Uint8Array(bytes)], "dropped.avi", {type: "video/x-msvideo"}));
            window.dispatchEvent(new DragEvent("drop", {dataTransfer: files, cancelable: true}));
        }""",
        list(video(tmp_path)),
    )
    page.until(lambda: "dropped.avi, frame 1 of 4" in page.status)
    page.choose("Sequence", NONE_CHOSEN)


def test_text_called_mp4_is_refused_and_the_page_stays(page):
    page.tab("Sequence")
    with page.page.expect_file_chooser() as chooser:
        page.page.get_by_role("button", name="Upload a video").click()
    chooser.value.set_files({"name": "text.mp4", "mimeType": "video/mp4", "buffer": b"no video"})
    page.page.get_by_text("text.mp4", exact=False).first.wait_for()
    assert "Dock found in plain" in page.status
