import re
from contextlib import ExitStack, contextmanager
from dataclasses import replace
from datetime import date
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest
from dockpose.app.errors import UserError
from dockpose.app.experiment import Session
from dockpose.app.experiment import session as session_module
from dockpose.app.inputs.received import read_sent
from dockpose.app.processing.analysis import Analysis, analyse
from dockpose.app.state.view import MeasuredPose, open_source
from dockpose.app.web.choices import Choices
from dockpose.app.web.page import Page
from dockpose.app.web.panels.experiment import NO_SESSION, ExperimentPanel
from dockpose.app.web.panels.experiment_rows import BLANK, MOST_ROWS, session_table, state_html, taken_words
from dockpose.app.web.server.options import Options
from dockpose.camera.files import load_camera
from dockpose.sidecar import load_dock, sample_path

from tests.support.rows import changed


@pytest.mark.parametrize("count", [1, 12, MOST_ROWS, MOST_ROWS + 1, 2000])
def test_newest_rows_come_first(count):
    html = session_table([changed(number=number) for number in range(1, count + 1)])
    shown = [int(number) for number in re.findall(r'data-row="(\d+)"', html)]
    assert shown == list(range(count, max(0, count - MOST_ROWS), -1))
    assert f"{len(shown)} of {count} row" in html


def test_table_has_errors_and_their_mean_over_all_rows():
    rows = [changed(number=n, measured_z_cm=100.0 - n) for n in range(1, 13)]
    html = session_table(rows)
    assert "12 of 12 rows" in html
    assert "(98.00)<br> <b>+2.00</b>" in html
    assert "+6.50" in html  # the mean of 1 to 12
    assert "No frame was taken yet" in session_table([])


def test_outside_text_is_escaped():
    row = changed(notes="<img src=x>", status="no_lights", z_cm=None)
    html = session_table([row])
    assert "<img" not in html
    assert "No pose: no lights. &lt;img src=x&gt;" in html
    assert "<b>x" not in state_html(Path("/<b>x"), 1, "<b>x")
    assert taken_words(row) == "Frame 1 is on disk: tank, without a pose, not yet measured."


@pytest.fixture
def start(served, tmp_path):
    """Starts the program as far as the tab goes; what it returns is closed by its ``closing``, and at the end."""
    with ExitStack() as end:
        yield lambda: end.enter_context(started(served[0], tmp_path))


@pytest.fixture
def panel(start):
    return start()


@contextmanager
def started(server, folder, **options):
    told = []

    def notify(title, sentence, colour, client):
        told.append((title, sentence))

    with ExitStack() as closing:
        app: Any = SimpleNamespace(options=Options(sessions=folder, **options), notify=notify, choices=Choices())
        app.server, app.closing, app.view = server, closing, open_source(None, None, None)
        app.change = lambda function, client: setattr(app, "view", function(app.view))
        app.attempt, app.report = partial(Page.attempt, app), partial(Page.report, app)
        made = ExperimentPanel(app)
        yield SimpleNamespace(panel=made, told=told, client=SimpleNamespace(), folder=folder, closing=closing)


def test_after_a_restart_the_last_session_of_today_goes_on(start, monkeypatch):
    def take(one, name=""):
        one.panel.show(analyse(open_source(None, None, None)))
        one.panel._name.value = name
        one.panel.take(one.client)
        one.closing.close()
        return one.panel._session.record.name, one.panel._rows()[-1].number

    first = start()
    today, number = take(first)
    assert number == 1
    assert take(start()) == (today, 2)
    assert take(start(), "other tank") == ("other_tank", 1)
    last = start()
    assert take(last) == ("other_tank", 2)  # which was changed last
    assert "Going on with other_tank." in last.panel._words.content or last.told
    with Session.open(first.folder / "other_tank"):  # another program has it
        assert take(start()) == (today, 3)
    monkeypatch.setattr(session_module.datetime, "date", SimpleNamespace(today=lambda: date(2001, 2, 3)))
    assert take(start()) == ("2001-02-03", 1)


def test_after_a_loss_of_power_the_session_is_open_whatever_the_clock_says(served, tmp_path, monkeypatch):
    with started(served[0], tmp_path, resume=True) as one:
        assert one.panel._session is None
        one.panel.show(analyse(open_source(None, None, None)))
        one.panel.take(one.client)
        assert one.panel._session is not None
        name = one.panel._session.record.name
    monkeypatch.setattr(session_module.datetime, "date", SimpleNamespace(today=lambda: date(1970, 1, 1)))
    with started(served[0], tmp_path, resume=True) as again:
        assert again.panel._session is not None
        assert again.panel._session.record.name == name
        assert len(again.panel._rows()) == 1
    with started(served[0], tmp_path) as other:
        assert other.panel._session is None


def test_a_session_that_was_put_away_is_not_taken_up_again(panel):
    panel.panel.show(analyse(open_source(None, None, None)))
    panel.panel.take(panel.client)
    panel.panel._choice.value = NO_SESSION
    panel.panel._open_chosen(panel.client)
    panel.panel.take(panel.client)
    assert [row.number for row in panel.panel._rows()] == [1]
    assert len(list(panel.folder.iterdir())) == 2


def test_what_is_taken_is_what_is_shown(panel):
    first = analyse(open_source(None, None, None))
    panel.panel.take(panel.client)  # before anything is shown
    panel.panel.show(first)
    panel.panel._fields.texts = BLANK | {"measured_z_cm": "1.2.3"}
    panel.panel.take(panel.client)
    assert "1.2.3" in panel.told[-1][1]
    assert not list(panel.folder.glob("*/*"))  # what is refused starts no session
    panel.panel._fields.texts = BLANK
    # A result that no new estimate of the picture could give shows that none was made.
    shown = Analysis(first.view, replace(first.estimate, status="no_lights", choice=None))
    panel.panel.show(shown)
    panel.panel.take(panel.client)
    assert panel.told[-1] == ("Taken", "Frame 1 is on disk: plain, without a pose, not yet measured.")
    (folder,) = panel.folder.iterdir()
    np.testing.assert_array_equal(
        cv2.imread(str(folder / "frames/0001.png"), cv2.IMREAD_UNCHANGED), first.view.image.squeeze()
    )
    assert panel.panel._rows()[0].status == "no_lights"


def test_what_is_typed_goes_to_the_row_it_was_typed_for(panel):
    page = panel.panel
    page.show(analyse(open_source(None, None, None)))
    page.take(panel.client)

    def typed(target, **texts):
        page.typed(SimpleNamespace(number=1, boxes={"target": target, **texts}), panel.client)

    page._show_row(1)
    typed("the next frame", measured_z_cm="99")
    assert page._fields.texts == BLANK
    typed("row 1", measured_z_cm="109")
    typed("row 7", measured_z_cm="1")  # which there is none
    assert page._fields.texts == BLANK | {"measured_z_cm": "109"}
    page._show_row(None)
    assert page._fields.texts == BLANK | {"measured_z_cm": "99"}
    with pytest.raises(UserError, match="those of row 1 in this browser, and of the next frame in the program"):
        page._take(panel.client, {"target": "row 1", "measured_z_cm": "99"})
    assert len(page._rows()) == 1
    page._heard.append(2)
    typed("the next frame", measured_z_cm="5")  # a frame was taken with it
    assert page._fields.texts["measured_z_cm"] == "99"


def test_what_is_typed_for_the_next_frame_is_compared_with_the_pose_found_in_the_picture(panel):
    page = panel.panel

    def compared(**texts):
        page._fields.texts = BLANK | texts
        page._compare(panel.client)
        return page.app.view.measured

    assert compared(measured_z_cm="120,5", distance_cm="99") == MeasuredPose(z_cm=120.5)
    assert compared(measured_x_cm="1", measured_theta_y_deg="-2") == MeasuredPose(x_cm=1, theta_y_deg=-2)
    before = page.app.view
    assert compared(measured_x_cm="1", measured_theta_y_deg="-2") == before.measured
    assert page.app.view is before  # which is not worked on again
    assert compared(distance_cm="99", notes="calm") is compared(measured_z_cm="1.2.3") is None


def test_a_session_is_checked_against_the_tape_and_what_it_leads_to_is_saved(panel, tmp_path):
    files, page = {}, panel.panel
    panel.client.send_file_download = lambda name, data, save_immediately: files.update({name: data})
    check = page.trying(page._check_tape)
    for name in ("plain", "tilted", "far", "missing", "turbid", "snow"):
        shown = analyse(open_source(str(sample_path(name)), None, None))
        page.show(shown)
        assert shown.estimate.selected is not None
        tape_cm = 103.0 * shown.estimate.selected.position_m  # 3 % longer than what the camera says
        typed = {f"measured_{axis}_cm": f"{cm:.1f}" for axis, cm in zip("xyz", tape_cm, strict=True)}
        page._fields.texts = BLANK | typed
        page.take(panel.client)
        if name == "plain":
            check(panel.client)
            assert "3 rows with a pose and measured values are needed, and there are 1" in panel.told[-1][1]
            assert [button.visible for button in page._corrected.values()] == [False, False]
    check(panel.client)
    assert "too short: the diameter or the focal length." in page._told.content
    assert [button.visible for button in page._corrected.values()] == [True, True]
    for name in ("dock", "camera"):
        page._save_corrected(name, panel.client)
    view, dock = page.analysis.view, tmp_path / "corrected.yaml"
    dock.write_bytes(files["dock.yaml"])
    assert load_dock(dock).diameter == pytest.approx(1.03 * view.dock.diameter, rel=0.003)
    camera = read_sent(files["camera.yaml"], "camera.yaml", load_camera)
    assert camera.fx == pytest.approx(1.03 * view.camera.fx, rel=0.003)
    page._show_rows("")  # as after another row
    assert page._told.content == ""
