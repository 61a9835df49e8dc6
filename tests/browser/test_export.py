import contextlib
import hashlib
import io
import json
import time
import zipfile
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from dockpose.app.drawing.annotated import LAYERS
from dockpose.app.drawing.colours import POSE_COLOURS, TRUTH_COLOUR, rgb
from dockpose.app.web.panels import export
from dockpose.app.web.panels.export import WHAT, ExportPanel
from dockpose.sidecar import sample_path
from PIL import Image

pytestmark = pytest.mark.browser


def saved(page, what):
    """Choose a file and press Save; returns its name and bytes."""
    if page.box("What").input_value() != what:
        page.choose("What", what)
    return page.download("Save")


def tick(page, label):
    page.page.get_by_label(label, exact=True).click()
    page.rest()


def size(data):
    return Image.open(io.BytesIO(data)).size


def is_picture(data):
    return size(data) == (640, 480)


def has_whole_json(data):
    line = json.loads(data)
    of_file = hashlib.sha256(sample_path("plain").read_bytes()).hexdigest()
    return line["schema"] == 1 and line["sha256"] == of_file and {"camera", "dock", "settings", "program"} <= set(line)


def is_seen_scene(data):
    picture = np.asarray(Image.open(io.BytesIO(data)))
    return picture.shape[2] == 4 and len(np.unique(picture.reshape(-1, 4), axis=0)) > 20


CHECKS = {
    "annotated.png": is_picture,
    "annotated.svg": lambda data: ElementTree.fromstring(data).tag.endswith("svg"),
    "picture.png": lambda data: (
        data and np.array_equal(np.asarray(Image.open(io.BytesIO(data))), np.asarray(Image.open(sample_path("plain"))))
    ),
    "report.html": lambda data: b"<!doctype html>" in data[:100].lower() and b"plain" in data,
    "result.csv": lambda data: len(data.decode().splitlines()) == 2,
    "result.json": has_whole_json,
    "settings.yaml": lambda data: {"camera", "dock", "settings"} <= set(yaml.safe_load(data)),
    "histogram.png": lambda data: min(size(data)) > 200,
    "histogram.svg": lambda data: ElementTree.fromstring(data).tag.endswith("svg"),
    "methods.png": lambda data: min(size(data)) > 200,
    "view_3d.png": is_seen_scene,
    "view_3d.html": lambda data: b"<html" in data[:1000].lower() and len(data) > 1e5,
}


@pytest.mark.parametrize("name", ["annotated.svg", "result.json", "view_3d.png"])
def test_file_is_saved_by_itself_and_opens(page, name):
    page.tab("Export")
    for what in (what for what in WHAT if WHAT[what] == name):
        called, data = saved(page, what)
        assert called == f"dockpose_plain_{name}"
        assert CHECKS[name](data), what


def test_saved_3d_page_draws_both_docks(page, browser, tmp_path):
    page.tab("Export")
    path = tmp_path / "view_3d.html"
    path.write_bytes(saved(page, next(what for what in WHAT if WHAT[what] == path.name))[1])
    with contextlib.closing(browser.new_page(viewport={"width": 1366, "height": 768})) as alone:
        alone.goto(path.as_uri())

        def pixels_of(colour):
            shown = np.asarray(Image.open(io.BytesIO(alone.screenshot())).convert("RGB")).astype(int)
            return (np.abs(shown - rgb(colour)).max(axis=2) < 30).sum()

        for colour in POSE_COLOURS:  # some hundred pixels each, where the page is drawn; no control has them
            page.until(lambda: pixels_of(colour) > 20)  # noqa: B023
        notice = alone.locator("#webgl-software-rendering")  # that it is drawn without a graphics card
        notice.wait_for(state="attached")
        assert notice.is_hidden()


def test_layers_are_drawn_as_over_the_picture_of_that_browser(page):
    panel = page.app._layout.of(ExportPanel)

    def show(names, *wanted):
        for name in names:
            page.page.locator(f"dockpose-picture [data-do=layer-{name}]").click()
        page.until(lambda: [*panel._layers.values()][-1:] == [[*wanted]])

    def pixels():
        page.tab("Export")
        data = saved(page, "Annotated picture (PNG)")[1]
        return np.asarray(Image.open(io.BytesIO(data)).convert("RGB")).astype(int)

    def truths(picture):
        return (np.abs(picture - rgb(TRUTH_COLOUR)).max(axis=2) < 40).sum()

    without = pixels()
    show(["truth"], *LAYERS)
    whole = pixels()
    assert truths(whole) > truths(without) + 100  # the headline is green too
    others = [name for name in LAYERS if name not in ("lights", "scale", "text")]  # whose buttons there are
    show(others, "lights", "scale", "text")
    bare = np.asarray(Image.open(sample_path("plain")).convert("RGB")).astype(int)
    changed = [(one != bare).any(axis=2).sum() for one in (pixels(), whole)]
    assert 0 < changed[0] < changed[1]
    show([name for name in others if name != "truth"], *(name for name in LAYERS if name != "truth"))
    np.testing.assert_array_equal(pixels(), without)


def test_zip_has_everything(page):
    page.tab("Export")
    archive = zipfile.ZipFile(io.BytesIO(page.download("Everything as ZIP")[1]))
    assert set(archive.namelist()) == set(WHAT.values())
    for name, is_right in CHECKS.items():
        assert is_right(archive.read(name)), name


def test_saving_is_stopped(page, monkeypatch):
    page.tab("Export")
    downloads = []
    page.page.on("download", lambda download: downloads.append(download))
    slow = {str(number): lambda: time.sleep(0.3) or b"" for number in range(100)}
    monkeypatch.setattr(export, "picture_files", lambda *a, **k: dict(slow))
    page.page.get_by_role("button", name="Everything as ZIP").click()
    stop = page.page.get_by_role("button", name="Stop", exact=True)
    stop.wait_for()
    page.page.get_by_role("button", name="Save", exact=True).click()
    page.page.get_by_text("Other work is running already").first.wait_for()
    stop.click()
    stop.wait_for(state="hidden")
    page.rest()
    assert downloads == []
