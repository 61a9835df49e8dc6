"""Pictures of one's own, from upload over clicks to the table of methods."""

import cv2
import numpy as np
import pytest
from dockpose.app.state.view import open_source

from tests.browser.conftest import visit
from tests.browser.test_set_lights import TRUTH_PX, squares, told
from tests.browser.test_view import on_screen, press

pytestmark = pytest.mark.browser


def test_pictures_are_uploaded_their_lights_clicked_and_the_methods_judged(browser, app):
    """Three of ten; a light each costs a click."""
    image = open_source(None, None, None).image
    with visit(browser, app) as page:
        page.open()
        for number in range(3):
            shifted = np.roll(image, 9 * number, axis=1)
            page.upload(f"mine{number}.png", cv2.imencode(".png", shifted)[1].tobytes())
            page.until(lambda number=number: f"mine{number}.png" in page.status and page.app.wait_until_idle(0.1))
            if number == 0:
                press(page, "hand")  # it stays in hand
            press(page, "clear")
            page.until(lambda: told(page) == 0)
            for light, point in enumerate(TRUTH_PX[:6], 1):
                page.page.mouse.click(*on_screen(page, *(point + [9 * number, 0])))
                page.until(lambda light=light: told(page) == light and squares(page) == light)
        page.tab("Compare")
        name, data = page.download("Judge by the lights that are set")
        page.page.locator("#methods tbody tr").first.wait_for()
        rows = page.page.locator("#methods tbody tr").all_inner_texts()
        assert name == "methods.zip"
        assert data[:2] == b"PK"
        assert rows[0].split("\t")[:3] == ["HATS", "3", "18 of 18"]
        assert page.errors == []
