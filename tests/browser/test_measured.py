"""What was measured by hand: blank until it is typed, and nothing but numbers."""

import csv
import json

import pytest
from dockpose.app.state.view import MeasuredPose

from tests.browser.test_experiment import press_t, start, words

pytestmark = pytest.mark.browser
BOXES = ("x (cm)", "y (cm)", "z (cm)", "θx (°)", "θy (°)", "Distance (cm)")
COLUMNS = ("measured_x_cm", "measured_y_cm", "measured_z_cm", "measured_theta_x_deg", "measured_theta_y_deg")


def rows(folder):
    with open(folder / "results.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_what_is_typed_is_compared_at_once_and_what_is_blank_is_logged_as_blank(page, root):
    page.tab("Log")
    start(page, "blank")
    assert [page.box(name).input_value() for name in BOXES] == [""] * 6
    press_t(page)
    page.until(lambda: "Frame 1 is on disk" in words(page))
    assert "not yet measured" in words(page)
    (row,) = rows(root / "blank")
    assert [row[name] for name in (*COLUMNS, "distance_cm")] == [""] * 6
    assert json.loads((root / "blank/frames/0001.json").read_text())["status"] == "ok"
    page.box("z (cm)").fill("100")
    page.rest()
    page.box("θy (°)").fill("-11")
    page.until(lambda: page.app.view.measured == MeasuredPose(z_cm=100, theta_y_deg=-11))
    page.until(lambda: page.row_names()[-1] == "Measured")
    page.unfold("Which of the two poses")
    error = page.page.locator("#errors-measured tbody tr").first.locator("td").nth(3)
    page.until(lambda: float(error.inner_text()) == pytest.approx(10.0, abs=0.2))
    for name in ("z (cm)", "θy (°)"):
        page.box(name).fill("")
        page.rest()
    page.until(lambda: page.app.view.measured is None)


def test_what_is_typed_stays_in_its_box_and_ctrl_enter_takes_the_row(page, root):
    page.tab("Log")
    if page.box("Session").input_value() != "(none)":
        page.choose("Session", "(none)")
    start(page, "keys")
    for name, text in {"θx (°)": "-111,5", "Distance (cm)": "1,58 m", "z (cm)": "11t0n"}.items():
        page.box(name).click()
        page.page.keyboard.type(text, delay=60)
        assert page.box(name).input_value() == text
    assert rows(root / "keys") == []  # a letter in a box is no command
    page.page.keyboard.press("Control+Enter")
    page.page.get_by_text("Measured z (cm) is '11t0n'; it must be a number").wait_for()
    assert page.box("z (cm)").input_value() == "11t0n"
    assert rows(root / "keys") == []
    page.box("z (cm)").fill("110")
    page.page.keyboard.press("Control+Enter")  # at once: what was typed last belongs to the row
    page.until(lambda: "Frame 1 is on disk" in words(page))
    (row,) = rows(root / "keys")
    assert (row["measured_z_cm"], row["measured_theta_x_deg"], row["measured_x_cm"]) == ("110.0", "-111.5", "")
    assert float(row["distance_cm"]) == 158
