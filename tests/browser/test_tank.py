"""Whose numbers are in force, how far they can be trusted, and what rules the next picture too."""

from dataclasses import replace

import pytest
from dockpose import Camera
from dockpose.app.state.camera import camera_file
from dockpose.app.state.tank import Tank, Tanks
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options
from dockpose.sidecar import sample_path, samples_folder
from msgspec.structs import replace as changed

from tests.browser.conftest import HANGS_S

pytestmark = pytest.mark.browser
OWN = Camera(649.0, 649.0, 319.5, 239.5, 640, 480)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("settings")


@pytest.fixture(scope="module")
def app(folder):
    with App(port=0, options=Options(remember_in=folder, folder=samples_folder())) as running:
        yield running


@pytest.fixture
def tank(page):
    """The page with My tank's camera and dock given while a sample is looked at, as at the start of a day."""
    page.app.change(lambda view: replace(view, tank=changed(view.tank, knows_diameter=True)), reload=True)
    page.tab("Tank")
    page.send("Load a camera file", ("mine.yaml", camera_file(OWN, "dockpose")))
    page.until(lambda: page.app.view.tank.camera == OWN and page.app.wait_until_idle(0.1))
    page.until(lambda: "fx 649.0 px" in line(page))  # after which controls no longer move under the pointer
    return page


def line(page):
    return page.page.locator("#strip-origin").inner_text()


def button(page, words):
    return page.page.get_by_role("button", name=words)


def own_picture(page, name="own.png"):
    page.upload(name, sample_path("tilted").read_bytes())
    page.until(lambda: page.has_found(name))


def test_a_long_list_of_files_ends_within_a_low_window(page, resized):
    resized((1366, 600))
    page.box("File").click()
    files = page.page.get_by_role("listbox").filter(visible=True)
    files.wait_for()
    page.rest()
    frame = files.bounding_box()
    page.page.keyboard.press("Escape")
    assert 0 <= frame["y"] <= 600 - frame["height"]


def test_tanks_are_saved_under_names_and_one_choice_brings_one_back(tank, folder):
    own_picture(tank)
    tank.tab("Tank")
    tank.box("Save as").fill("Pool A")
    tank.rest()
    tank.box("Save as").press("Enter")
    tank.until(lambda: "Pool A: fx 649.0 px" in line(tank))
    assert Tanks(folder).get("Pool A").camera == OWN
    tank.box("Diameter (cm)").fill("45")
    tank.until(lambda: "dock 45 cm" in line(tank) and "changed since it was saved" in line(tank))
    tank.until(lambda: tank.box("Saved tanks").input_value() == "(not saved)")
    tank.choose("Saved tanks", "Pool A")
    tank.until(lambda: "dock 30 cm" in line(tank) and "changed" not in line(tank))
    tank.until(lambda: tank.box("Diameter (cm)").input_value() == "30")


def test_tank_is_there_at_the_next_start(folder, browser, app):
    app.change(lambda view: view)
    app.memory.write()
    with App(str(sample_path("tilted")), port=0, options=Options(remember_in=folder)) as again:
        assert again.wait_until_idle(HANGS_S)
        assert again.view.tank == app.view.tank


def test_notes_on_an_assumed_camera_and_dock_go_once_they_are_given_and_trust_has_its_reasons(page):
    page.app.change(lambda view: replace(view, tank=Tank()), reload=True)
    own_picture(page)
    assert page.trust == "red"  # the lights' spacing shows another focal length than 60 degrees of view: ± 25 %
    assert "view was assumed" in page.status
    page.tab("Source")
    button(page, "Load the camera's file").click()  # what to do next, which opens the tab where it is done
    page.page.get_by_role("button", name="Load a camera file").wait_for()
    assert page.page.locator("#strip-trust").inner_text() == "Dock seen, but do not rely on it"
    page.box("fx (px)").fill("700")
    page.rest()
    page.box("fy (px)").fill("700")
    page.until(lambda: "view was assumed" not in page.status)
    assert (page.trust, "30 cm was assumed" in page.status) == ("amber", True)
    assert "±" not in page.page.locator("#place").inner_text()
    assert button(page, "Load the camera's file").count() == 0  # it is no longer assumed
    button(page, "Is it 30 cm?").click()
    page.until(lambda: page.trust == "green" and "assumed" not in page.status and "assumed" not in line(page))
    assert "±" in page.page.locator("#place").inner_text()
    assert "Dock found in own.png" in page.status


REFUSED = {
    "Diameter (cm)": {"0": "0 is outside 1 to 300", "1.2 kg": "it must be a number"},
    "Number of lights": {"9.5": "it must be a whole number"},
    "fx (px)": {"99999": "99999 is outside 128 to 3200"},
}


def typed(page, box, text):
    box.click()
    page.page.keyboard.press("Control+a")
    page.page.keyboard.type(text, delay=20)
    page.page.keyboard.press("Tab")


@pytest.mark.parametrize("label", REFUSED)
def test_box_shows_what_is_in_force_and_what_it_refuses_is_told_whole(page, label):
    page.tab("Tank")
    box, before = page.box(label), page.app.view
    in_force = box.input_value()
    for text, why in REFUSED[label].items():
        typed(page, box, text)
        page.page.get_by_text(f"{label} is '{text}'").filter(has_text=why).wait_for()
        assert box.input_value() == in_force
    assert page.app.view is before


def test_a_number_is_taken_whole_with_its_unit_and_never_by_its_first_letters(page, monkeypatch):
    page.tab("Tank")
    box, in_force, note = page.box("Diameter (cm)"), [], page.app.history.note
    monkeypatch.setattr(
        page.app.history, "note", lambda *views: (in_force.append(views[1].dock.diameter), note(*views))
    )
    wanted = {"40,5": 0.405, "1.2 m": 1.2, "300 mm": 0.3, "812 mm": 0.812}
    for text, metres in wanted.items():
        typed(page, box, text)
        page.until(lambda metres=metres: page.app.view.dock.diameter == pytest.approx(metres))
    page.until(lambda: box.input_value() == "81.2")
    assert in_force == pytest.approx([*wanted.values()])


def test_a_number_that_only_another_can_be_is_told(page):
    page.tab("Tank")
    box = page.box("Number of lights")
    typed(page, box, "1")
    page.page.get_by_text("Number of lights cannot be 1; it is 3 now.").wait_for()
    page.until(lambda: page.app.view.dock.lights == 3 and box.input_value() == "3")


def test_error_budget_of_the_tank_in_force(page):
    page.tab("Tank")
    page.unfold("Error budget")
    page.page.get_by_role("button", name="Which errors to expect").click()
    rows = page.page.locator("#budget tbody tr")
    page.until(lambda: rows.count() == 24)
    assert "10 lights" in page.page.locator("#budget").locator("xpath=..").inner_text()
    page.box("Number of lights").fill("8")
    page.page.get_by_text("The camera or the dock has changed: press again.").wait_for()
    assert rows.count() == 0
