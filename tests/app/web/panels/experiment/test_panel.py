import hashlib
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import cv2
import msgspec
import numpy as np
import pytest
import viser
from dockpose.app.cli import main
from dockpose.app.errors import UserError
from dockpose.app.experiment import Row, Session, SessionError
from dockpose.app.experiment.folder import SessionFolder
from dockpose.app.inputs.checksums import Checksums
from dockpose.app.inputs.folder import Shelf
from dockpose.app.processing.analysis import Analysis, analyse
from dockpose.app.processing.background import CancelledError, Progress
from dockpose.app.processing.following import chosen_by_track
from dockpose.app.processing.replay import differences, estimate_again
from dockpose.app.resources import sample_path
from dockpose.app.state.view import open_source, with_upload
from dockpose.app.web.panels.experiment.measured import BLANK, measured_of, texts_of, texts_of_pose, values_of
from dockpose.app.web.panels.experiment.panel import ExperimentPanel
from dockpose.app.web.panels.experiment.table import pages, rows_on_page, session_table, state_html, taken_words
from dockpose.app.web.server.start import silence
from dockpose.pose.known import KnownPose
from dockpose.simulate import Pose, Scene, render
from dockpose.tracking.tracker import Tracker

from tests.support.scenes import CAMERA, DOCK

ROW = Row(
    number=1, time="2026-01-01T00:00:00+00:00", source="tank", file="frames/0001.png", sha256="", status="ok",
    x_cm=1.0, y_cm=2.0, z_cm=100.0, theta_x_deg=10.0, theta_y_deg=-5.0,
)  # fmt: skip


def changed(**fields) -> Row:
    return msgspec.structs.replace(ROW, **fields)


def numbered(count):
    return [changed(number=n) for n in range(1, count + 1)]


@pytest.mark.parametrize(
    ("typed", "number"), [("", None), ("  ", None), ("12", 12), (" 1,5 ", 1.5), ("-3.25", -3.25), ("−4", -4), ("0", 0)]
)
def test_numbers_as_people_type_them(typed, number):
    values = values_of(BLANK | {"measured_x_cm": typed, "notes": "n"})
    assert values["measured_x_cm"] == number
    assert values["notes"] == "n"
    assert measured_of(values).x_cm == number


@pytest.mark.parametrize("typed", ["a metre", "1 2", "nan", "inf", "1,234.5"])
def test_what_is_no_number_is_named(typed):
    with pytest.raises(ValueError, match=r"Measured θy \(°\) is '.*'; it must be a number"):
        values_of(BLANK | {"measured_theta_y_deg": typed})


def test_boxes_show_what_a_row_has():
    texts = texts_of(changed(measured_z_cm=110.25, distance_cm=120.0, notes="n"))
    assert (texts["measured_x_cm"], texts["measured_z_cm"], texts["distance_cm"]) == ("", "110.25", "120")
    assert values_of(texts)["measured_z_cm"] == 110.25
    pose = texts_of_pose(KnownPose((0.01, -0.02, 1.1), 0, -5))
    assert list(pose.values()) == ["1", "-2", "110", "0", "-5", "", ""]


@pytest.mark.parametrize(("count", "number"), [(0, 1), (1, 1), (10, 1), (11, 2), (2000, 200)])
def test_pages(count, number):
    assert pages(count) == number


def test_newest_rows_come_first():
    rows = numbered(12)
    assert [row.number for row in rows_on_page(rows, 1)] == [12, 11, 10, 9, 8, 7, 6, 5, 4, 3]
    assert [row.number for row in rows_on_page(rows, 2)] == [2, 1]
    assert rows_on_page(rows, 3) == []


def test_table_has_errors_and_their_mean_over_all_rows():
    rows = [changed(number=n, measured_z_cm=100.0 - n) for n in range(1, 13)]
    html = session_table(rows, 2)
    assert "2 of 12 rows" in html
    assert "(98.00)<br><b>+2.00</b>" in html
    assert "+6.50" in html  # the mean of 1 to 12
    assert "No frame was taken yet" in session_table([], 1)


def test_outside_text_is_escaped():
    row = changed(notes="<img src=x>", status="no_lights", z_cm=None)
    html = session_table([row], 1)
    assert "<img" not in html
    assert "No pose: no lights. &lt;img src=x&gt;" in html
    assert "<b>x" not in state_html(Path("/<b>x"), 1, "<b>x")
    assert taken_words(row) == "Frame 1 is on disk: tank, without a pose, not yet measured."


def test_sessions_stay_below_their_folder(tmp_path):
    shelf = SessionFolder(tmp_path / "sessions")
    assert shelf.names() == []
    assert not shelf.root.exists()
    for typed, name in (("../../up", "up"), ("/etc/passwd", "etc_passwd"), ("", None), ("up", "up-2"), ("CON", "CON_")):
        with shelf.start(typed) as session:
            assert session.folder.parent == shelf.root
            assert name is None or session.folder.name == name
    assert len(shelf.names()) == 5
    Session.create(tmp_path / "outside").close()
    (shelf.root / "link").symlink_to(tmp_path / "outside")
    for name in ("../outside", "link", str(tmp_path / "outside"), "none"):
        with pytest.raises(UserError):
            shelf.take_up(name)
    shelf.take_up("up").close()


def test_folder_that_is_a_file_is_said(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(SessionError, match="file"):
        SessionFolder(tmp_path / "file").start("a")
    assert main(["serve", "--port", "0", "--sessions", str(tmp_path / "file")]) == 2


def test_checksum_is_that_of_the_file_that_is_shown(tmp_path):
    shelf, data = Shelf(), sample_path("plain").read_bytes()
    checksums = Checksums(shelf, None)
    view = open_source(None, None, None)
    right = hashlib.sha256(data).hexdigest()
    assert checksums.sha256(view) == right
    assert checksums.sha256(replace(view, image=view.image + 1)) is None
    sent = with_upload(view, data, "mine.png")
    assert checksums.sha256(sent) is None  # no longer kept
    shelf.add("mine.png", data)
    assert checksums.sha256(replace(sent, image=sent.image.copy())) == right
    assert checksums.sha256(replace(sent, image=sent.image.copy(), list_name="sequence")) is None


def test_part_of_a_work_stops_with_it():
    told = []
    whole = Progress(told.append)
    part = whole.silent()
    assert list(part.over([1, 2])) == [1, 2]
    assert told == []
    whole.stop()
    with pytest.raises(CancelledError):
        list(part.over([1]))


@pytest.fixture
def panel(tmp_path):
    with silence():
        server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    told = []
    made = ExperimentPanel(
        server.gui,
        SessionFolder(tmp_path),
        Checksums(Shelf(), None),
        lambda title, sentence, colour, client: told.append((title, sentence)),
        lambda error: told.append(("failed", error)),
    )
    yield SimpleNamespace(panel=made, told=told, client=SimpleNamespace(), folder=tmp_path)
    made.close()
    with silence():
        server.stop()


def test_what_is_taken_is_what_is_shown(panel):
    first = analyse(open_source(None, None, None))
    panel.panel.show(first)
    panel.panel.take(panel.client)
    assert panel.told[-1][1].startswith("No session is open")
    panel.panel._trying(panel.panel._start_new)(panel.client)
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


def test_measured_pose_fills_boxes_once_and_distance_stays(panel):
    analysis = analyse(open_source(None, None, None))
    pose = KnownPose((0.0, 0.0, 1.2), 1.0, 2.0)
    fields = panel.panel._fields
    fields.texts = BLANK | {"distance_cm": "99"}
    known = replace(analysis, view=replace(analysis.view, measured=pose))
    panel.panel.show(known)
    assert (fields.texts["measured_z_cm"], fields.texts["distance_cm"]) == ("120", "99")
    fields.texts = fields.texts | {"measured_z_cm": "121"}
    panel.panel.show(known)
    assert fields.texts["measured_z_cm"] == "121"
    panel.panel.show(analysis)
    assert fields.texts["measured_z_cm"] == "121"


def test_what_the_frames_before_chose_is_chosen_again():
    tracker, chosen_by = Tracker(CAMERA, DOCK, use_region=False), set()
    for index in range(6):
        pose = Pose(position_m=(0.05, 0.02, 6.0 - 0.3 * index), theta_x_deg=4.0, theta_y_deg=-5.0)
        image = render(Scene(camera=CAMERA, dock=DOCK, pose=pose, seed=index))[0]
        line = msgspec.json.decode(msgspec.json.encode(chosen_by_track(tracker.see(image, 0.1 * index)).to_dict()))
        assert differences(line, estimate_again(image, line)) == []
        chosen_by.add(line["selected_by"])
    assert "tracking" in chosen_by


def test_rounding_is_no_difference():
    view = open_source(None, None, None)
    found = analyse(view).estimate
    for change, names in ((1e-13, []), (1e-6, ["candidates[0].position_m[2]"])):
        line = msgspec.json.decode(msgspec.json.encode(found.to_dict()))
        line["candidates"][0]["position_m"][2] += change
        assert [name for name, *_ in differences(line, found)] == names
