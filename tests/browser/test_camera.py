import cv2
import pytest
import yaml
from dockpose import Dock
from dockpose.app.state.parameters import PORT
from dockpose.simulate import Pose, Scene, render

from tests.support.scenes import CAMERA

pytestmark = pytest.mark.browser
TANK = (
    *("Lens distortion", "Port and water"),
    "Lights uneven or behind the ring",
)


@pytest.fixture(scope="module", autouse=True)
def unfolded(opened):
    for title in TANK:
        opened.unfold(title)


def test_port_and_water(page):
    page.tab("Tank")
    z_without = page.z_cm
    page.tick("Flat port")
    page.until(lambda: page.app.view.camera.port is not None and page.box("Air gap (mm)").is_enabled())
    page.until(lambda: page.z_cm != z_without)
    page.page.get_by_text("high in the water").wait_for()
    for parameter, number in zip(PORT.values(), (35, 12, 1.6, 1.34), strict=True):
        page.box(parameter.label).fill(str(number))
        page.until(lambda: parameter.get(page.app.view) == pytest.approx(number))  # noqa: B023
    page.tick("Flat port", False)
    page.until(lambda: page.app.view.camera.port is None)


def test_camera_is_saved_and_loaded(page):
    page.box("fx (px)").fill("812")
    page.until(lambda: page.app.view.camera.fx == 812)
    page.choose("Camera file as", "ros")
    _, saved = page.download("Save the camera")
    assert yaml.safe_load(saved)["camera_matrix"]["data"][0] == 812
    page.page.get_by_role("button", name="Not as given: fx (px): 700 → 812").click()
    page.until(lambda: page.app.view.camera.fx == 700)
    page.send("Load a camera file", ("mine.yaml", saved))
    page.until(lambda: page.box("fx (px)").input_value() == "812")


def test_given_angles_of_the_lights(page):
    page.tab("Tank")
    number = page.box("Number of lights")
    page.box("Light angles (°)").fill("0, 30, 80, 120, 180, 250, 300")
    page.rest()
    assert page.app.view.dock.lights == 10  # nothing is taken over while it is typed
    page.box("Light angles (°)").press("Enter")
    page.until(lambda: page.app.view.dock.angles_deg == (0, 30, 80, 120, 180, 250, 300))
    page.until(lambda: number.input_value() == "7")
    page.box("Light angles (°)").fill("0, 90")
    page.rest()
    page.box("Light angles (°)").press("Enter")
    page.page.get_by_text("There are 2 light angles; a dock has 3 to 60 lights").first.wait_for()
    page.until(lambda: page.box("Light angles (°)").input_value().startswith("0, 30, 80"))


def test_a_lamp_behind_the_ring_is_said_and_seen(page):
    dock = Dock(0.30, 8, extra_lights_m=((0.0, 0.0, 0.05),))
    pose = Pose(position_m=(0.1, -0.05, 1.5), theta_y_deg=25.0)
    image, _ = render(Scene(camera=CAMERA, dock=dock, pose=pose))
    page.upload("behind.png", cv2.imencode(".png", image)[1].tobytes())
    page.until(lambda: page.app.view.source == "behind.png")
    page.tab("Tank")
    page.box("Number of lights").fill("8")
    page.until(lambda: page.app.view.dock.lights == 8)
    page.box("Extra lamps (cm)").fill("0, 0, 5")
    page.box("Extra lamps (cm)").press("Enter")
    page.until(lambda: page.app.view.dock.extra_lights_m == ((0, 0, 0.05),))
    page.page.locator("[data-extra]").wait_for()
    page.page.get_by_text("Extra lights seen: 1 of 1.").first.wait_for()
    page.box("Extra lamps (cm)").fill("0, 0, 0.1")
    page.box("Extra lamps (cm)").press("Enter")
    page.page.get_by_text("or it tells nothing of the two poses").first.wait_for()
    page.until(lambda: page.box("Extra lamps (cm)").input_value() == "0, 0, 5")
