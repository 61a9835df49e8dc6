"""The 3D view in a real browser: how large the docks are in it, and the light drawing that stands for it."""

import itertools
import math

import numpy as np
import pytest
from dockpose.app.state.parameters import put
from dockpose.app.web.scene.drawing import drawing_of

from tests.app.web.scene.test_surroundings import on_screen

pytestmark = pytest.mark.browser

THIRD = 1 / 3
CORNERS = 24  # of a rim that is drawn


class Eye:
    """From where the browser looks at its scene, as it tells the program."""

    def __init__(self, page):
        told = page.page.evaluate("viserPage.eye")
        self.position, self.look_at, self.fov = np.array(told["position"]), np.array(told["look_at"]), told["fov"]
        self.aspect = told["image_width"] / told["image_height"]


def heights(page):
    """Height of the rim of each candidate over the view's, by the eye of the scene that is drawn."""
    eye, drawn = Eye(page), page.app.scene.drawn
    found = page.app.newest or page.app._current
    rims = drawn.docks[len(drawn.known) * CORNERS :].reshape(len(found.estimate.candidates), CORNERS, 3)
    assert eye.fov == pytest.approx(math.radians(50))
    return [float(np.ptp(on_screen(eye, rim, eye.aspect, 1.0)[:, 1])) for rim in rims]


def show(page, z_cm, **pose):
    """Simulate a dock in clear water, and wait until its scene is drawn."""
    near = {"x_cm": 0.05 * z_cm, "y_cm": 0.03 * z_cm, "theta_x_deg": 0.0, "theta_y_deg": 0.0, "roll_deg": 0.0}

    def simulated(view):
        for name, value in (near | {"turbidity": 0, "light": 4.0, "z_cm": z_cm} | pose).items():
            view = put(view, name, value)
        return view

    page.app.change(simulated, reload=True)
    page.until(lambda: page.app.wait_until_idle(1) and not page.app._is_hidden)
    assert page.app._current.estimate.status == "ok"


@pytest.mark.parametrize("size", [(1366, 768), (1920, 1080)])
def test_docks_fill_a_third_of_the_view_at_any_range_and_tilt(page, resized, size):
    resized(size)
    told = {}
    for z_cm, tilt_deg in itertools.product((50, 100, 300, 800), (5, 25, 45)):
        show(page, z_cm, theta_x_deg=tilt_deg)
        place = page.app.scene._viewpoints._placed
        page.until(
            lambda place=place: all(np.allclose(Eye(page).position, one.position, 1e-3) for one in place.values())
        )
        told[z_cm, tilt_deg] = heights(page)
    for (z_cm, tilt_deg), shares in told.items():
        print(f"{size[0]} x {size[1]}, {z_cm} cm, {tilt_deg} deg: " + ", ".join(f"{share:.2f}" for share in shares))
    assert all(min(shares) >= THIRD for shares in told.values())
    assert max(map(max, told.values())) < 1


def test_light_drawing_shows_the_docks_where_the_scene_has_them_and_gives_way_to_it(page):
    drawing = page.page.locator("dockpose-scene")
    page.until(drawing.is_hidden)
    page.page.evaluate(
        """() => {
          window.hidden = 0;
          new MutationObserver(() => (window.hidden += document.documentElement.hasAttribute("data-hides-scene")))
            .observe(document.documentElement, { attributeFilter: ["data-hides-scene"] });
        }"""
    )
    slider = page.slider("Diameter (cm)")
    slider.focus()
    before = page.app.view.dock.diameter
    page.page.keyboard.press("ArrowRight")
    page.until(lambda: page.app.view.dock.diameter > before)
    page.until(lambda: page.page.evaluate("window.hidden") == 1)
    page.until(drawing.is_hidden)
    page.until(lambda: page.app.wait_until_idle(1))
    wide, high = page.page.evaluate(
        "(() => { const box = viserPage.sceneBox(); return [box.clientWidth, box.clientHeight]; })()"
    )
    rim = page.page.evaluate(
        """document.querySelector("dockpose-scene .disc.chosen").getAttribute("d").split("Z")[0]"""
    )
    drawn = np.array([[float(part) for part in point.split()] for point in rim.removeprefix("M").split("L")])
    current = page.app._current
    rims = drawing_of(current).docks.reshape(-1, CORNERS, 3)
    chosen = rims[
        len(rims) - len(current.estimate.candidates) + current.estimate.candidates.index(current.estimate.selected)
    ]
    expected = on_screen(Eye(page), chosen, wide, high)
    for side in (np.min, np.max):
        np.testing.assert_allclose(side(drawn, axis=0), side(expected, axis=0), atol=0.02 * high)  # corners of a circle
