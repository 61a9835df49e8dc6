"""A newcomer's day on the page as docs/first-day.md tells it, with files of their own: clicks and seconds (``-s``)."""

import io
import json
import re
import time
import zipfile
from contextlib import contextmanager
from pathlib import Path

import cv2
import numpy as np
import pytest
import yaml
from dockpose import Camera, Dock, estimate
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options
from dockpose.camera.files import load_camera
from dockpose.sidecar import dock_from
from dockpose.simulate import Lights, Pose, Scene, render
from msgspec.structs import replace as changed

from tests.browser.conftest import visit
from tests.browser.test_experiment import words
from tests.browser.test_measured import rows

pytestmark = pytest.mark.browser
KALIBR = """\
cam0:
  camera_model: pinhole
  intrinsics: [910.0, 912.0, 636.5, 361.5]
  distortion_model: radtan
  distortion_coeffs: [0.0, 0.0, 0.0, 0.0]
  resolution: [1280, 720]
"""
CAMERA = Camera(910.0, 912.0, 636.5, 361.5, 1280, 720)
GIVEN_M, TRUE_M = 0.40, 0.404  # what the tape across the ring said, and what it is
RANGES_M = np.linspace(1.0, 2.8, 10)
FRAMES = 30
GOALS = {"own picture with own camera": 3, "compare": 1, "a row": 1, "play": 1, "ZIP": 1}


def scene(z_m):
    pose = Pose(position_m=(0.05, -0.03, float(z_m)), theta_x_deg=12.0, theta_y_deg=-20.0, roll_deg=7.0)
    return Scene(camera=CAMERA, dock=Dock(TRUE_M, 8), pose=pose, lights=Lights(level=600.0))


def as_png(image):
    return cv2.imencode(".png", image)[1].tobytes()


def film(folder):
    """A film of a ring that drifts to the right, as a camera writes it."""
    picture, path = render(scene(2.0))[0], str(folder / "run.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 30, (CAMERA.width, CAMERA.height))
    for number in range(FRAMES):
        writer.write(cv2.cvtColor(np.roll(picture, 2 * number, axis=1), cv2.COLOR_GRAY2BGR))
    writer.release()
    return Path(path).read_bytes()


def is_ours(camera):
    """Whether a camera is that of the file, which says that the lens does not bend in zeros."""
    return camera is not None and not any(camera.distortion) and changed(camera, distortion=()) == CAMERA


# Whether the keys are at an element, or within it.
IS_AT = "one => one.contains(document.activeElement)"
MOST_TABS = 150  # from one end of the page to the other


class Day:
    """Presses what the guide names, in its order, and counts; by keys alone where that is asked for."""

    def __init__(self, page, *, by_keys=False):
        self.by_keys = by_keys
        text = Path("docs/first-day.md").read_text(encoding="utf-8")
        told = text.partition("## The same day on the page")[2].partition("\n## ")[0]
        self.names, self.page = re.findall(r"\*([^*]+)\*", told), page
        self.clicks, self.table = 0, {}

    @contextmanager
    def step(self, name):
        before, began = self.clicks, time.perf_counter()
        yield
        clicks, seconds = self.table.get(name, (0, 0.0))
        self.table[name] = max(clicks, self.clicks - before), max(seconds, time.perf_counter() - began)

    def click(self, locator):
        self.clicks += 1
        if not self.by_keys:
            locator.click()
            return
        one, keyboard = locator.element_handle(), self.page.page.keyboard
        for _ in range(MOST_TABS):
            if one.evaluate(IS_AT):
                break
            keyboard.press("Tab")
        assert one.evaluate(IS_AT), f"{MOST_TABS} presses of Tab do not lead to {locator}"
        if not one.evaluate("one => one.matches('input, textarea')"):
            keyboard.press("Enter")

    def press(self, name):
        """Press a button or a tab that is in sight, the next that the guide names."""
        assert self.names.pop(0) == name
        self.go(name)

    def pass_over(self, name):
        """What the guide names next is open already, or for another case."""
        assert self.names.pop(0) == name

    def go(self, name):
        """Press a button or a tab, whether or not the guide names it next."""
        shown = re.compile(rf"^\W*{re.escape(name)}$")  # some have an arrow before it
        button, tab = (self.page.page.get_by_role(role, name=shown) for role in ("button", "tab"))
        self.click(button.or_(tab).locator("visible=true").first)

    def send(self, name, *files, is_named=True):
        with self.page.page.expect_file_chooser() as chooser:
            (self.press if is_named else self.go)(name)
        chooser.value.set_files([{"name": name, "mimeType": "", "buffer": data} for name, data in files])


@pytest.fixture
def root(tmp_path):
    """The folder of the day's session."""
    return tmp_path / "sessions"


@pytest.fixture
def page(browser, root):
    with App(port=0, options=Options(sessions=root)) as app, visit(browser, app) as own:
        own.open()
        yield own


@pytest.mark.parametrize("by_keys", [False, True], ids=["mouse", "keys"])
def test_a_newcomer_s_day(page, root, tmp_path, by_keys):
    day, pictures = Day(page, by_keys=by_keys), [render(scene(z_m))[0] for z_m in RANGES_M]
    day.pass_over("Tank")
    with day.step("own picture with own camera"):
        day.send("Load a camera file", ("camchain.yaml", KALIBR.encode()))
        page.until(lambda: is_ours(page.app.view.tank.camera))
        day.pass_over("Calibrate")
        day.press("Source")
        day.send("Upload pictures", ("tank01.png", as_png(pictures[0])))
        page.until(lambda: page.has_found("tank01.png"))
    assert is_ours(page.app.view.camera)
    with day.step("diameter and lights"):
        day.press("Tank")
        for label, text in (("Diameter (cm)", f"{100 * GIVEN_M:g}"), ("Number of lights", "8")):
            day.click(page.box(label))
            page.page.keyboard.press("Control+a")
            page.page.keyboard.type(text)
            page.rest()
    page.until(lambda: page.app.view.dock == Dock(GIVEN_M, 8) and page.trust == "green")
    with day.step("compare"):
        day.press("Compare")
        page.page.locator("dockpose-compare .card").nth(8).wait_for()
    day.press("Back to the picture")
    day.pass_over("Set lights")
    day.go("Source")
    names = [f"tank{number:02d}.png" for number in range(2, 11)]
    day.send("Upload pictures", *zip(names, map(as_png, pictures[1:]), strict=True), is_named=False)
    page.until(lambda: page.app.kept.names()[-1:] == names[-1:] and page.has_found(names[0]))
    page.page.evaluate("document.activeElement.blur()")
    page.page.keyboard.press("p")  # the first of those that were sent is shown
    day.press("Log")
    for number, name in enumerate(["tank01.png", *names], start=1):
        page.until(lambda name=name: page.has_found(name) and page.app.wait_until_idle(0.1))
        with day.step("a row"):
            day.click(page.box("z (cm)"))
            page.page.keyboard.type(f"{100 * RANGES_M[number - 1]:.1f}")
            page.page.keyboard.press("Control+Enter")
            page.until(lambda number=number: f"Frame {number} is on disk" in words(page))
        page.page.keyboard.press("Escape")
        page.rest()
        page.page.keyboard.press("n")
    (folder,) = root.iterdir()
    assert [float(row["measured_z_cm"]) for row in rows(folder)] == pytest.approx(100 * RANGES_M, abs=0.06)
    day.press("Check against the tape")
    told = page.page.get_by_text("too short: the diameter or the focal length").first.inner_text()
    for name in ("Save the corrected dock", "Save the corrected camera"):  # whatever the files allow
        page.page.get_by_role("button", name=name).wait_for()
    share = re.search(r"All ranges are ([\d.]+) ±", told)
    assert share is not None
    assert float(share[1]) == pytest.approx(100 * (TRUE_M / GIVEN_M - 1), abs=0.15)
    day.press("Picture")
    day.press("Source")
    day.send("Upload a video", ("run.avi", film(tmp_path)))
    page.until(lambda: page.app.view.list_name == "sequence" and page.app.wait_until_idle(0.1))
    with day.step("play"):
        day.press("Play")
        page.until(lambda: f"frame {FRAMES} of" in page.page.locator("[role=status]").inner_text().lower())
    with day.step("ZIP"), page.page.expect_download() as download:
        day.press("Everything as ZIP")
    assert day.names == []
    elsewhere(download.value.path().read_bytes(), tmp_path / "elsewhere")
    print("\nwhat                        | clicks | goal | seconds")
    for what, (clicks, seconds) in day.table.items():
        print(f"{what:27} | {clicks:6} | {GOALS.get(what, '-'):>4} | {seconds:7.1f}")
    assert {what: day.table[what][0] for what in GOALS} == GOALS


def elsewhere(data, folder):
    """The picture, camera and dock of the ZIP file lead to its numbers by the library alone."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        archive.extractall(folder)
    settings = yaml.safe_load((folder / "settings.yaml").read_text(encoding="utf-8"))
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    camera, dock = load_camera(folder / "settings.yaml"), dock_from(settings["dock"], "settings.yaml")
    assert is_ours(camera)
    found = estimate(folder / "picture.png", camera, dock)
    assert found.selected is not None
    assert result["chosen"]["position_m"][2] == pytest.approx(found.selected.position_m[2], rel=1e-3)
