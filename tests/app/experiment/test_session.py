import csv
import io
import json
import threading
from datetime import datetime

import cv2
import msgspec
import numpy as np
import pytest
import yaml
from dockpose import Camera, estimate
from dockpose.app.cli import main
from dockpose.app.errors import UserError
from dockpose.app.experiment import Row, Session, SessionError, read_session
from dockpose.app.experiment.session import SessionFolder
from dockpose.files import FileError
from dockpose.simulate import render
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.support.scenes import CAMERA, DOCK, random_scene

PICTURE, TRUTH = render(random_scene(2, position_m=(0.06, -0.04, 1.1), theta_x_deg=6.0, theta_y_deg=-12.0))
FOUND = estimate(PICTURE, CAMERA, DOCK)


@pytest.fixture
def session(tmp_path):
    with Session.create(tmp_path / "tank", notes="Becken 3, trüb") as session:
        yield session


def on_disk(session):
    with (session.folder / "results.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_a_row_says_what_was_estimated_and_measured(session):
    measured = {"measured_z_cm": 110.5, "distance_cm": 111.0}
    row = session.take(PICTURE, FOUND, "tank.png", "ab" * 32, **measured, notes="lamp off")
    assert row.z_cm is not None
    assert FOUND.selected is not None
    assert FOUND.selected.sigma_position_m is not None
    assert (row.number, row.file, row.status, row.lights) == (1, "frames/0001.png", "ok", 10)
    assert row.estimated == pytest.approx((6, -4, 110, 6, -12), abs=0.2)  # the simulated truth
    assert row.errors[:2] == (None, None)
    assert row.errors[2] == pytest.approx(row.z_cm - 110.5)
    assert row.sigma_z_cm == pytest.approx(100 * FOUND.selected.sigma_position_m[2], abs=1e-6)
    (kept,) = on_disk(session)
    assert float(kept["z_cm"]) == row.z_cm
    assert float(kept["measured_z_cm"]) == 110.5
    assert kept["measured_x_cm"] == ""
    assert (kept["source"], kept["notes"], kept["source_sha256"]) == ("tank.png", "lamp off", "ab" * 32)


def test_the_frame_is_exactly_the_pixels_with_all_that_was_found(session):
    row = session.take(PICTURE, FOUND, "tank.png", sha256="ab" * 32)
    kept = cv2.imread(str(session.folder / row.file), cv2.IMREAD_UNCHANGED)
    np.testing.assert_array_equal(kept, PICTURE)
    line = json.loads((session.folder / "frames/0001.json").read_text())
    expected = json.loads(json.dumps(FOUND.to_dict("tank.png", 0, None, "ab" * 32)))
    assert {key: line[key] for key in expected} == expected
    assert line["picture"] == {"file": "0001.png", "sha256": row.sha256}
    assert {"dockpose", "numpy", "opencv", "scipy", "numba"} <= set(line["program"])


@pytest.mark.parametrize("kind", ["grey 16", "bgr 8", "bgr 16", "bgra 8"])
def test_every_kind_of_picture_is_kept_losslessly(session, kind):
    rng = np.random.default_rng(1)
    depth, channels = (
        (np.uint16 if "16" in kind else np.uint8),
        {"grey": (), "bgr": (3,), "bgra": (4,)}[kind.split()[0]],
    )
    image = rng.integers(0, np.iinfo(depth).max, (30, 40, *channels), dtype=depth, endpoint=True)
    found = estimate(image, Camera(70, 70, 19.5, 14.5, 40, 30), DOCK)
    row = session.take(image, found, kind)
    kept = cv2.imread(str(session.folder / row.file), cv2.IMREAD_UNCHANGED)
    assert kept is not None
    assert kept.dtype == depth
    np.testing.assert_array_equal(kept, image)


def test_a_picture_without_a_dock_is_a_row_too(session):
    image = np.full((480, 640), 10, np.uint8)
    row = session.take(image, estimate(image, CAMERA, DOCK), "dark", measured_z_cm=100.0)
    assert (row.status, row.pose, row.z_cm, row.errors) == ("no_lights", None, None, (None,) * 5)


def test_session_yaml_tells_when_and_with_what(session):
    info = yaml.safe_load((session.folder / "session.yaml").read_text(encoding="utf-8"))
    assert (info["schema"], info["notes"]) == (1, "Becken 3, trüb")
    assert {"dockpose", "python", "numpy", "opencv", "scipy", "numba", "machine"} == set(info["program"])
    assert datetime.fromisoformat(str(info["created"])).tzinfo is not None


def test_measured_values_and_notes_can_be_changed_and_nothing_else(session):
    session.take(PICTURE, FOUND, "a", measured_x_cm=1.0)
    session.take(PICTURE, FOUND, "b")
    changed = session.edit(1, measured_x_cm=None, measured_theta_y_deg=-11.5, notes="second try")
    assert (changed.measured_x_cm, changed.measured_theta_y_deg, changed.notes) == (None, -11.5, "second try")
    assert [kept["notes"] for kept in on_disk(session)] == ["second try", ""]
    with pytest.raises(ValueError, match="z_cm cannot be changed"):
        session.edit(1, z_cm=1.0)
    with pytest.raises(ValueError, match=r"measured_x_cm.*nan"):
        session.edit(1, measured_x_cm=float("nan"))
    with pytest.raises(ValueError, match="number is 3"):
        session.edit(3, notes="")
    with pytest.raises(ValueError, match="notes has 10001 characters"):
        session.edit(1, notes="x" * 10_001)
    assert session.rows[0] == changed


def test_angles_differ_by_the_shorter_way_round():
    row = Row(
        number=1,
        time="",
        source="",
        file="frames/0001.png",
        sha256="",
        status="ok",
        x_cm=40.0,
        z_cm=30.0,
        theta_y_deg=179.0,
        measured_theta_y_deg=-179.0,
    )
    assert row.errors[4] == pytest.approx(-2)
    assert row.range_cm == pytest.approx(50)
    assert msgspec.structs.replace(row, measured_z_cm=60.0).range_cm == 60
    assert msgspec.structs.replace(row, measured_z_cm=60.0, distance_cm=61.0).range_cm == 61


@pytest.mark.extra
@given(source=st.text(max_size=60), notes=st.text(max_size=60))
@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_text_is_read_back_by_pandas_and_by_us(session, source, notes):
    import pandas  # pyright: ignore[reportMissingImports]

    row = session.take(np.zeros((2, 2), np.uint8), FOUND, source, notes=notes)
    table = pandas.read_csv(
        session.folder / "results.csv", keep_default_na=False, dtype=str, encoding="utf-8", encoding_errors="strict"
    )
    assert table["source"].tolist()[-1] == row.source
    assert table["notes"].tolist()[-1] == row.notes
    assert read_session(session.folder).rows[-1] == row
    plain = "".join(character if character.isprintable() else "" for character in source)
    assert all(character in row.source for character in plain)


def test_takes_from_several_threads_are_all_kept(session):
    def work(name):
        for _ in range(5):
            session.take(PICTURE, FOUND, name)

    threads = [threading.Thread(target=work, args=(str(index),)) for index in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert [row.number for row in read_session(session.folder).rows] == list(range(1, 21))
    assert sorted(row.source for row in session.rows) == sorted("0123" * 5)


def test_a_session_of_an_older_version_is_read_and_goes_on(session):
    session.take(PICTURE, FOUND, "a")
    session.close()
    path = session.folder / "results.csv"
    with path.open(newline="") as file:
        head, row = csv.reader(file)
    kept = [place for place, name in enumerate(head) if not name.startswith("sigma_total")]
    path.write_text("".join(",".join(line[place] for place in kept) + "\n" for line in (head, row)))
    with Session.open(session.folder) as again:
        assert again.rows[0].sigma_total_z_cm is None
        again.take(PICTURE, FOUND, "b")
    first, second = read_session(session.folder).rows
    assert first.z_cm == second.z_cm
    assert (second.sigma_total_z_cm or 0.0) > (second.sigma_z_cm or 0.0)


@pytest.mark.parametrize(
    ("results", "words"),
    [
        ("number,time\n1,x\n", "has no column source"),
        ("\xff", "not a text file|has no column"),
        (None, "row 1.*frames"),
    ],
)
def test_results_that_cannot_be_read_are_named(session, results, words):
    session.take(PICTURE, FOUND, "a")
    session.close()
    path = session.folder / "results.csv"
    text = path.read_text().replace("frames/0001", "frames/../../0001") if results is None else results
    path.write_bytes(text.encode("latin-1"))
    with pytest.raises(FileError, match=words) as caught:
        Session.open(session.folder)
    assert "results.csv" in str(caught.value)
    path.write_bytes(b"")
    with pytest.raises(FileError, match="no column"):
        Session.open(session.folder)  # and the lock was given back each time


def test_a_column_of_someone_elses_is_not_lost_in_silence(session):
    session.take(PICTURE, FOUND, "a")
    session.close()
    path = session.folder / "results.csv"
    rows = list(csv.reader(io.StringIO(path.read_text())))
    path.write_text("".join(",".join([*row, "mine"]) + "\n" for row in rows))
    assert len(read_session(session.folder).rows) == 1
    with pytest.raises(FileError, match="column mine would be lost"):
        Session.open(session.folder)


def test_a_change_by_another_program_is_not_overwritten(session):
    session.take(PICTURE, FOUND, "a")
    path = session.folder / "results.csv"
    path.write_text(path.read_text().replace(",a,", ",b,"))
    before = path.read_bytes()
    with pytest.raises(FileError, match="changed by another program"):
        session.take(PICTURE, FOUND, "c")
    assert path.read_bytes() == before
    assert sorted(entry.name for entry in (session.folder / "frames").iterdir()) == ["0001.json", "0001.png"]


def test_folders_that_are_no_sessions(tmp_path):
    with pytest.raises(SessionError, match=r"not a session; it has no file session\.yaml"):
        Session.open(tmp_path)
    (tmp_path / "thesis.tex").write_text("x")
    with pytest.raises(SessionError, match="not empty"):
        Session.create(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]
    (tmp_path / "session.yaml").write_text("schema: 2\n")
    with pytest.raises(FileError, match="schema is 2"):
        Session.open(tmp_path)


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
