import shutil

import pytest
import yaml
from dockpose.app.state.parameters import DETECTION, DISTORTION, LENS, SCENE
from dockpose.app.web import notifications
from dockpose.app.web.app import App
from dockpose.app.web.panels.source import NONE_CHOSEN, OWN_PICTURE, SourcePanel
from dockpose.app.web.server.options import Options
from dockpose.sidecar import sample_path, samples_folder

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def app(tmp_path_factory):
    """The page with a folder of its own: the samples, and a folder of two pictures below it."""
    root = shutil.copytree(samples_folder(), tmp_path_factory.mktemp("folder") / "pictures")
    (root / "tank").mkdir()
    for name in ("first.png", "second.png"):
        shutil.copy(sample_path("tilted"), root / "tank" / name)
    with App(port=0, options=Options(folder=root)) as running:
        yield running


@pytest.fixture(scope="module", autouse=True)
def unfolded(opened):
    for title in ("Water and light", "Disturbances"):
        opened.unfold(title)


def files(page):
    """The list of the files in the folder that is chosen."""
    panel = page.app._layout.of(SourcePanel)
    return panel._choices["folder"]


def test_every_slider_of_camera_detection_and_scene_changes_it(page):
    for name, parameter in (LENS | DISTORTION | DETECTION | SCENE).items():
        limits = parameter.range(page.app.view)
        share = 0.05 if name in DISTORTION else round(limits.low + 0.6 * (limits.high - limits.low))
        value = {"z_cm": 140, "light": 4, "surface_cm": 40, "min_area_px": 20}.get(name, share)
        page.box(parameter.label).fill(f"{value:g}")
        # Under HATS there is no level yet.
        page.until(lambda: parameter.path != "settings.level" or page.app.view.settings.level is not None)  # noqa: B023
        page.until(lambda: parameter.get(page.app.view) == pytest.approx(value, abs=1e-6))  # noqa: B023
    page.until(lambda: "simulated scene" in page.status and page.box("Sample scene").input_value() == OWN_PICTURE)


def test_scene_is_saved_and_loaded(page):
    page.box("Dock z (cm)").fill("130")
    page.until(lambda: "130.0 cm ahead" in page.status or page.z_cm == pytest.approx(130, abs=1))
    assert page.row_names()[-1] == "Truth"
    _, saved = page.download("Save the scene")
    assert yaml.safe_load(saved)["pose"]["position_m"][2] == 1.3
    page.box("Dock z (cm)").fill("90")
    page.until(lambda: page.z_cm == pytest.approx(90, abs=1))
    page.send("Load a scene", ("mine.yaml", saved))
    page.until(lambda: page.z_cm == pytest.approx(130, abs=1))


def test_simulates_with_the_camera_in_use(page):
    page.box("fx (px)").fill("800")
    page.until(lambda: page.app.view.camera.fx == 800)
    page.tab("Source")
    page.page.get_by_role("button", name="Use my camera and dock").click()
    page.until(lambda: page.app.view.scene.camera.fx == 800 and "simulated scene" in page.status)


def test_several_pictures_at_once_and_turning_pages(page):
    page.send("Upload pictures", *[(f"{name}.png", sample_path(name).read_bytes()) for name in ("plain", "tilted")])
    page.until(lambda: page.has_found("plain.png"))  # the first of them
    page.page.keyboard.press("n")
    page.until(lambda: page.has_found("tilted.png"))
    page.page.keyboard.press("n")
    page.page.get_by_text("tilted.png is the last of ").wait_for()
    page.page.keyboard.press("p")
    page.until(lambda: page.has_found("plain.png"))
    assert page.box("Uploaded").input_value() == "plain.png"
    page.choose("Uploaded", "tilted.png")
    page.until(lambda: page.has_found("tilted.png"))


def test_dropped_pictures_are_taken(page):
    page.drop("dropped.png", sample_path("tilted").read_bytes(), "image/png")
    page.until(lambda: page.has_found("dropped.png"))


def test_folder_of_this_machine(page):
    assert page.box("Folder").input_value() == "."
    page.choose("File", "tilted.png")
    page.until(lambda: page.has_found("tilted.png"))
    page.until(lambda: page.row_names()[-1] == "Truth")  # the YAML beside it tells it
    page.page.keyboard.press("n")
    page.until(lambda: page.app.view.item != "tilted.png")
    assert page.app.view.list_name == "folder"
    page.choose("Sample scene", "plain")
    page.until(lambda: page.box("File").input_value() == NONE_CHOSEN)


def test_folder_below_lists_its_own_pictures(page):
    before = page.app.view
    page.choose("Folder", "tank")
    page.until(lambda: files(page).options == (NONE_CHOSEN, "tank/first.png", "tank/second.png"))
    assert page.app.view is before  # choosing a folder leaves the picture
    page.choose("File", "tank/second.png")
    page.until(lambda: page.has_found("tank/second.png"))
    page.page.keyboard.press("p")
    page.until(lambda: page.has_found("tank/first.png"))
    page.choose("Folder", ".")
    page.until(lambda: "tilted.png" in files(page).options)


BAD = {
    "text": ("Upload pictures", "notes.png", lambda: b"no pixels", "notes.png: is not a picture"),
    "unknown key": ("Load a scene", "odd.yaml", lambda: sea(), "odd.yaml: Object contains unknown field `sea`"),
    "no video": ("Upload a video", "text.mp4", lambda: b"no video", "text.mp4"),
}


def sea():
    return sample_path("plain").with_suffix(".yaml").read_bytes() + b"sea: 3\n"


@pytest.mark.parametrize("case", BAD)
def test_bad_files_are_named_with_the_reason_and_change_nothing(page, case):
    button, name, data, words = BAD[case]
    before = page.app.view
    page.send(button, (name, data()))
    page.page.get_by_text(words).first.wait_for()
    assert page.app.view is before
    assert "Dock found in plain" in page.status


def test_forty_files_at_once(page, monkeypatch):
    monkeypatch.setattr(notifications, "_RUSH_S", 600.0)  # however long a busy machine takes for one
    good = sample_path("tilted").read_bytes()
    files = [(f"f{number}.png", good if number % 2 else b"junk") for number in range(40)]
    page.send("Upload pictures", *files)
    page.page.get_by_text("more) | f38.png: is not a picture").first.wait_for()  # which closes again by itself
    page.until(lambda: "f39.png" in page.app.kept.names())
    assert "f1.png" in page.status  # the first that could be read
    assert [name for name in page.app.kept.names() if name.startswith("f")] == [f"f{n}.png" for n in range(1, 40, 2)]
