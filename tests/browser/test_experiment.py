import csv
import errno
import io
import shutil
import zipfile

import msgspec
import pytest
from dockpose.app.experiment import Session, session
from dockpose.app.experiment.record import COLUMNS, csv_text
from dockpose.app.web.panels.experiment import ALL, NEXT_FRAME, NO_SESSION, WHAT, ExperimentPanel

from tests.browser.test_export import saved
from tests.support.taking import FOUND, PICTURE

pytestmark = pytest.mark.browser
LONG, ROWS = "long", 25


@pytest.fixture(scope="module")
def root(tmp_path_factory):
    """A folder with one session of 25 rows, of which each is 1 cm off per row."""
    folder = tmp_path_factory.mktemp("experiments") / "sessions"
    with Session.create(folder / LONG) as made:
        first = made.take(PICTURE, FOUND, "tank", notes="by hand")
    assert first.z_cm is not None
    rows = [
        msgspec.structs.replace(first, number=n, file=f"frames/{n:04d}.png", measured_z_cm=first.z_cm - n)
        for n in range(1, ROWS + 1)
    ]
    (folder / LONG / "results.csv").write_text(csv_text([COLUMNS, *map(msgspec.structs.astuple, rows)]))
    for row in rows[1:]:
        for ending in (".png", ".json"):
            shutil.copy(folder / LONG / f"frames/0001{ending}", folder / LONG / f"{row.file[:-4]}{ending}")
    return folder


@pytest.fixture
def tab(page):
    """The tab Log without a session."""
    page.tab("Log")
    if page.box("Session").input_value() != NO_SESSION:
        page.choose("Session", NO_SESSION)
    page.box("New session").wait_for()
    return page


def start(page, name):
    page.box("New session").fill(name)
    page.rest()
    page.box("New session").press("Enter")
    page.until(lambda: "Started." in words(page))


def words(page):
    return page.page.locator("#experiment").inner_text()


def fill(page, **texts):
    for label, text in texts.items():
        boxes = {"x": "x (cm)", "y": "y (cm)", "z": "z (cm)", "tx": "θx (°)", "ty": "θy (°)", "d": "Distance (cm)"}
        box = page.row("Notes").locator("textarea").first if label == "notes" else page.box(boxes[label])
        box.fill(text)
        page.rest()


def press_t(page):
    page.page.evaluate("document.activeElement.blur()")
    page.page.keyboard.press("t")


def rows_on_disk(folder):
    with (folder / "results.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def measured(row):
    """What was measured of a row: x, y, z, θx and θy."""
    return [float(row[f"measured_{name}"]) for name in ("x_cm", "y_cm", "z_cm", "theta_x_deg", "theta_y_deg")]


def numbers(page):
    return page.page.locator("#experiment-rows tr[data-row]").evaluate_all("all => all.map(one => one.dataset.row)")


def test_frames_are_taken_by_key_and_button_with_what_was_measured(tab, root):
    start(tab, "../Tank 1: murky?")
    folder = root / "Tank_1_murky"
    assert str(folder) in words(tab)
    tab.page.locator("a[href='help#log']").wait_for()
    fill(tab, x="6,5", y="-4", z="110", tx="5", ty="-11", d="111", notes="first <b>try</b>")
    press_t(tab)
    tab.until(lambda: "Frame 1 is on disk: plain, z 110.0 cm, measured." in words(tab))
    (row,) = rows_on_disk(folder)
    assert measured(row) == [6.5, -4, 110, 5, -11]
    assert (float(row["distance_cm"]), row["notes"], row["source"]) == (111, "first <b>try</b>", "plain")
    assert (folder / "frames/0001.png").is_file()
    tab.until(lambda: tab.box("z (cm)").input_value() == "")
    cell = tab.page.locator("#experiment-rows tr[data-row='1'] td").nth(3)
    assert cell.inner_text().split()[:2] == ["110.00", "(110.00)"]
    assert "\n" not in cell.inner_text()
    assert "first <b>try</b>" in tab.page.locator("#experiment-rows").inner_text()
    tab.until(lambda: tab.page.locator("canvas:visible").count() >= 3)  # two charts and, once it rests, the 3D scene
    tab.page.get_by_label("Keep values").click()
    fill(tab, z="112")
    tab.page.get_by_role("button", name="Take (T)").click()
    tab.until(lambda: "Frame 2 is on disk" in words(tab))
    assert tab.box("z (cm)").input_value() == "112"
    tab.page.get_by_label("Keep values").click()
    assert numbers(tab) == ["2", "1"]
    assert [float(row["measured_z_cm"]) for row in rows_on_disk(folder)] == [110, 112]
    fill(tab, z="")


def test_row_is_changed_afterwards_while_the_next_frame_keeps_its_own(tab, root):
    start(tab, "later")
    press_t(tab)
    tab.until(lambda: "not yet measured" in words(tab))
    fill(tab, z="99")
    tab.choose("Belongs to", "row 1")
    tab.until(lambda: tab.box("z (cm)").input_value() == "")
    fill(tab, z="109", notes="by tape")
    tab.page.get_by_role("button", name="Save row 1").click()
    tab.until(lambda: "Row 1 is on disk as changed." in words(tab))
    (row,) = rows_on_disk(root / "later")
    assert (float(row["measured_z_cm"]), row["notes"]) == (109, "by tape")
    tab.choose("Belongs to", NEXT_FRAME)
    tab.until(lambda: tab.box("z (cm)").input_value() == "99")
    tab.choose("Session", NO_SESSION)
    tab.until(lambda: "To begin" in words(tab))
    tab.choose("Session", "later")
    tab.until(lambda: "Reopened. 1 frame in" in words(tab))
    tab.choose("Belongs to", "row 1")
    tab.until(lambda: tab.box("z (cm)").input_value() == "109")
    tab.choose("Belongs to", NEXT_FRAME)
    fill(tab, z="")


def panel_of(page):
    (panel,) = (panel for panel in page.app._layout.panels if isinstance(panel, ExperimentPanel))
    return panel


def act_of(page, do):
    """What is done for requests, and the kind of request of that name."""
    acts = page.app._layout._requests.acts
    return acts, next(kind for kind in acts if kind.__name__ == do)


def test_what_is_typed_stays_where_it_was_typed_when_the_program_is_slow_to_show_another_row(tab, monkeypatch):
    start(tab, "slow")
    press_t(tab)
    tab.until(lambda: "not yet measured" in words(tab))
    panel, heard = panel_of(tab), []
    typed = panel.typed
    monkeypatch.setitem(*act_of(tab, "typed"), lambda asked, client: (heard.append(asked.boxes), typed(asked, client)))
    with panel._lock:  # as while it works on something else
        fill(tab, z="99")
        tab.choose("Belongs to", "row 1")
        tab.until(lambda: heard)
    assert heard == [{"target": NEXT_FRAME, "measured_z_cm": "99"}]
    tab.until(lambda: tab.box("z (cm)").input_value() == "")
    tab.choose("Belongs to", NEXT_FRAME)
    tab.until(lambda: tab.box("z (cm)").input_value() == "99")
    fill(tab, z="")


def test_what_goes_wrong_is_said_and_nothing_typed_is_lost(tab, root, monkeypatch):
    start(tab, "faults")
    fill(tab, z="1.2.3")
    press_t(tab)
    tab.page.get_by_text("Measured z (cm) is '1.2.3'").first.wait_for()
    fill(tab, z="100", notes="kept")

    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    with monkeypatch.context() as patch:
        patch.setattr(session, "write_whole", full)
        press_t(tab)
        tab.page.get_by_text("frame 1 cannot be saved: the disk is full").first.wait_for()
    assert rows_on_disk(root / "faults") == []
    assert tab.box("z (cm)").input_value() == "100"
    press_t(tab)
    tab.until(lambda: "Frame 1 is on disk" in words(tab))
    assert rows_on_disk(root / "faults")[0]["notes"] == "kept"
    with Session.open(root / LONG):
        tab.choose("Session", LONG)
        tab.page.get_by_text("it is in use by process").first.wait_for()
        tab.until(lambda: tab.box("Session").input_value() == "faults")


def test_a_long_session_and_its_downloads(tab):
    tab.choose("Session", LONG)
    tab.until(lambda: numbers(tab) == [str(n) for n in range(25, 0, -1)])
    table = tab.page.locator("#experiment-rows")
    assert table.locator("tr[data-summary='Mean']").inner_text().split()[3] == "+13.00"  # of 1 to 25
    assert "25 of 25 rows" in table.locator("xpath=..").inner_text()
    called, data = saved(tab, "Table (CSV)")
    assert called == "dockpose_long_table.csv"
    errors = [float(row["error_z_cm"]) for row in csv.DictReader(data.decode().splitlines())]
    assert errors == pytest.approx(list(range(1, 26)))
    called, data = saved(tab, "All of these (ZIP)")
    assert called == "dockpose_long.zip"
    archive = zipfile.ZipFile(io.BytesIO(data))
    assert set(archive.namelist()) == set(WHAT.values()) - {ALL}
    assert b"longtable" in archive.read("table.tex")


def type_row(page, values, delay_ms):
    """Type a row's x, y, z, θx, θy and distance as a gauge does, take it at once, and return what the boxes had."""
    page.box("x (cm)").click()
    keyboard = page.page.keyboard
    for value in values:
        keyboard.type(value, delay=delay_ms)
        if value is not values[-1]:
            keyboard.press("Tab")
    keyboard.press("Control+Enter")


@pytest.mark.parametrize("delay_ms", [0, 40])
def test_what_is_typed_fast_is_logged_as_it_stands_in_the_boxes(tab, root, delay_ms):
    name = f"gauge{delay_ms}"
    start(tab, name)
    for number in range(1, 4):
        values = [f"{number}1.5", "-4.25", f"31{number}.4", "3", "-12.5", "311.4"]
        type_row(tab, values, delay_ms)
        tab.until(lambda: f"Frame {number} is on disk" in words(tab))  # noqa: B023
        tab.until(lambda: tab.box("Distance (cm)").input_value() == "")
        row = rows_on_disk(root / name)[-1]
        assert [*measured(row), float(row["distance_cm"])] == [float(value) for value in values]
        assert len(rows_on_disk(root / name)) == number


def test_what_is_typed_fast_stays_when_another_tab_is_opened(tab, root):
    start(tab, "elsewhere")
    tab.box("z (cm)").click()
    tab.page.keyboard.type("311.4")
    tab.page.keyboard.press("Tab")
    tab.page.keyboard.type("5")
    panel = panel_of(tab)
    tab.until(lambda: panel._next_texts["measured_z_cm"] == "311.4")
    tab.tab("Detect")
    press_t(tab)
    tab.until(lambda: (root / "elsewhere/frames/0001.png").is_file() and len(rows_on_disk(root / "elsewhere")) == 1)
    (row,) = rows_on_disk(root / "elsewhere")
    assert (float(row["measured_z_cm"]), float(row["measured_theta_x_deg"])) == (311.4, 5)
    tab.tab("Log")
