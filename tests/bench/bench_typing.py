"""Rows typed as gauges do that type like keyboards, 5 to 100 ms a key: each is logged as it stood in the boxes."""

import itertools

from dockpose.app.experiment.record import MEASURED_COLUMNS
from dockpose.app.web.app import App
from dockpose.app.web.server.options import Options

from tests.browser.conftest import browser as browser
from tests.browser.conftest import visit
from tests.browser.test_experiment import rows_on_disk, start, type_row, words

ROWS, DELAYS_MS = 200, (5, 10, 20, 40, 60, 100)


def test_rows_typed_fast_are_logged_as_they_stood_in_the_boxes(browser, tmp_path):
    with App(port=0, options=Options(sessions=tmp_path)) as app, visit(browser, app) as page:
        page.open()
        page.tab("Log")
        start(page, "gauge")
        typed = []
        for number, delay_ms in zip(range(1, ROWS + 1), itertools.cycle(DELAYS_MS), strict=False):
            values = [f"{number / 10:.1f}", f"-{number}.25", f"{300 + number}.4", "3", "-12.5", f"{310 + number}.9"]
            type_row(page, values, delay_ms)
            typed.append([float(value) for value in values])
            page.until(lambda: f"Frame {number} is on disk" in words(page))  # noqa: B023
            page.until(lambda: page.box("Distance (cm)").input_value() == "")
        rows = [[row[column] for column in MEASURED_COLUMNS] for row in rows_on_disk(tmp_path / "gauge")]
        same = sum(row == values for row, values in zip(rows, typed, strict=True))
        print(f"{same} of {ROWS} rows as they stood in the boxes")
        assert rows == typed
