import csv
import hashlib
import json
import zipfile

import cv2
import numpy as np
import pytest
from dockpose import Settings, estimate
from dockpose.app.cli import main
from dockpose.app.commands.estimate import replay_session
from dockpose.app.drawing.annotated import LAYERS
from dockpose.app.drawing.colours import TRUTH_COLOUR, bgr
from dockpose.app.errors import UserError
from dockpose.app.experiment import Session, read_session
from dockpose.app.inputs.pictures import load_sample
from dockpose.files import FileError
from dockpose.sidecar import sample_path

from tests.support.rows import measured

NAMES = ("plain", "tilted", "flat_port")
NASTY = "<script>alert(1)</script>&\"'"


def export(source, out, *more):
    return main(["export", str(source), "--out", str(out), *more])


@pytest.fixture
def folder(tmp_path):
    """A session of three sample scenes, one of them with another method."""
    with Session.create(tmp_path / "tank", NASTY) as session:
        for name, method in zip(NAMES, ("hats", "otsu", "hats"), strict=True):
            sample = load_sample(name)
            found = estimate(sample.image, sample.camera, sample.dock, Settings(method=method))
            session.take(sample.image, found, f"{name} {NASTY}", **measured(sample.truth), notes=NASTY)
    return tmp_path / "tank"


@pytest.mark.slow
def test_a_session_becomes_a_folder_of_files(folder, tmp_path, capsys):
    assert export(folder, tmp_path / "out") == 0
    written = {path.name for path in (tmp_path / "out").iterdir()}
    tables = {f"table.{ending}" for ending in ("csv", "tex")}
    assert written == {"report.html", "errors.svg", "errors.png"} | tables
    assert len(capsys.readouterr().out.splitlines()) == len(written)
    table = csv.DictReader((tmp_path / "out" / "table.csv").read_text(encoding="utf-8").splitlines())
    assert max(abs(float(row["error_z_cm"])) for row in table) < 2
    report = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert "<script" not in report
    assert report.count("data:image/jpeg") == 3
    assert "RMS error" in report


def test_a_picture_becomes_one_file_of_the_kind_asked_for(tmp_path):
    source = sample_path("plain")
    for name, start in (("a.svg", b"<?xml"), ("a.png", b"\x89PNG"), ("a.html", b"<!DOCTYPE")):
        assert export(source, tmp_path / name) == 0
        assert (tmp_path / name).read_bytes().startswith(start)
    export(source, tmp_path / "a.json")
    line = json.loads((tmp_path / "a.json").read_text())
    assert line["sha256"] == hashlib.sha256(source.read_bytes()).hexdigest()
    assert line["program"]["dockpose"]
    export(source, tmp_path / "bare.png", "--layers", "")
    drawn = cv2.imread(str(tmp_path / "bare.png"))
    np.testing.assert_array_equal(drawn, cv2.imread(str(source)))


def test_the_truth_is_drawn_where_it_is_asked_for_and_known(tmp_path, capsys):
    counts = []
    for name, layers in (("plain", "a"), ("plain", "truth")):
        assert export(sample_path(name), tmp_path / "a.png", "--layers", layers) == 0
        drawn = np.asarray(cv2.imread(str(tmp_path / "a.png")), dtype=int)
        counts.append((np.abs(drawn - bgr(TRUTH_COLOUR)).max(axis=2) < 40).sum())
    assert counts[0] == 0
    assert counts[1] > 100
    assert "truth" not in capsys.readouterr().err
    unknown, camera = tmp_path / "unknown.png", sample_path("plain").with_suffix(".yaml")
    unknown.write_bytes(sample_path("plain").read_bytes())
    assert (
        export(unknown, tmp_path / "b.png", "--layers", "truth", "--camera", str(camera), "--dock-diameter", "0.3") == 1
    )
    assert f"{unknown}: no truth is known of it" in capsys.readouterr().err


@pytest.fixture
def lines(tmp_path):
    path = tmp_path / "seq.jsonl"
    content = []
    for index, name in enumerate(NAMES):
        sample, source = load_sample(name), sample_path(name)
        found = estimate(sample.image, sample.camera, sample.dock)
        line = found.to_dict(str(source), index, 0.1 * index, hashlib.sha256(source.read_bytes()).hexdigest())
        content.append(line | {"track": {"probability": 0.99, "age": index, "predicted": False, "lost": False}})
    content[1]["source"] = NASTY
    path.write_text("".join(json.dumps(line) + "\n" for line in content))
    return path


@pytest.mark.slow
def test_a_sequence_becomes_a_zip(lines, tmp_path):
    assert export(lines, tmp_path / "seq.zip") == 0
    archive = zipfile.ZipFile(tmp_path / "seq.zip")
    assert set(archive.namelist()) == {"report.html", "results.csv", "poses.svg", "poses.png"}
    report = archive.read("report.html").decode()
    assert "<script" not in report
    assert report.count("data:image/jpeg") == 2  # the file that is not there cannot be shown
    assert "seen 99.0 %" in report
    table = csv.DictReader(archive.read("results.csv").decode().splitlines())
    assert [row["frame"] for row in table] == ["0", "1", "2"]
    assert table.fieldnames[-1] == "message"


@pytest.mark.parametrize(("cut", "status"), [(0, 0), (1, 0), (2, 1), (500, 1)])
def test_lines_that_were_cut_are_exported_as_far_as_they_are_whole_with_status_1(lines, tmp_path, capsys, cut, status):
    content = lines.read_bytes()
    lines.write_bytes(content[: len(content) - cut])
    assert export(lines, tmp_path / "t.csv") == status
    assert ("line 3, the last, is cut short" in capsys.readouterr().err) == bool(status)
    assert len((tmp_path / "t.csv").read_text().splitlines()) == 4 - status


def test_what_cannot_be_exported_is_said(tmp_path, folder, refusal):
    picture = tmp_path / "tank.png"
    picture.write_bytes(sample_path("plain").read_bytes())
    camera = ["--camera", str(sample_path("plain").with_suffix(".yaml"))]
    for source, out, more, sentence in (
        (picture, "out", [], "which camera"),
        (picture, "out", camera, "how large is the dock"),
        (folder, "a.docx", [], "there is no .docx"),
        (folder, "a.svg", ["--layers", "lamps"], "--layers has 'lamps'"),
        (tmp_path, "out", [], "which camera"),
        (tmp_path / "gone.png", "out", [], "cannot be read"),
    ):
        words = ["export", str(source), "--out", str(tmp_path / out), *more]
        assert sentence in refusal(*words, status=1 if sentence == "cannot be read" else 2)
    assert set(LAYERS) >= {"lights", "scale"}


def test_replaying_says_what_differs_and_why(folder, capsys):
    path = folder / "frames/0002.json"
    line = json.loads(path.read_text())
    line["threshold"]["level"] += 1
    line["program"]["numpy"] = "1.0"
    path.write_text(json.dumps(line))
    image = load_sample("flat_port").image
    cv2.imwrite(str(folder / "frames/0003.png"), image // 2)
    assert replay_session(folder) == 1
    first, second, last = capsys.readouterr().out.splitlines()
    level = line["threshold"]["level"]
    assert first.startswith(f"row 2: threshold.level {level} is now {level - 1} (numpy was 1.0, is ")
    assert second.startswith("row 3: ")
    assert "the picture's file was changed" in second
    assert last.endswith("1 of 3 rows give the same numbers, 2 differ.")


def test_what_a_session_lacks_is_named_with_status_1(folder, tmp_path, capsys):
    for path in ("frames/0001.png", "frames/0002.json"):
        (folder / path).unlink()
    table = (folder / "results.csv").read_bytes()
    (folder / "results.csv").write_bytes(b"".join(table.splitlines(keepends=True)[:-1]))
    assert export(folder, tmp_path / "t.csv") == 1
    told = capsys.readouterr().err.splitlines()
    assert [any(name in line for line in told) for name in ("0001.png: is", "0002.json", "0003.png: no row")] == [
        True
    ] * 3
    assert len(told) == 3
    (folder / "results.csv").write_bytes(table[:-60])
    with pytest.raises(FileError, match="row 3 has fewer cells than columns"):
        read_session(folder)


def test_replaying_tells_frames_that_cannot_be_read(folder, capsys):
    (folder / "frames/0001.png").unlink()
    line = json.loads((folder / "frames/0002.json").read_text())
    (folder / "frames/0002.json").write_text(json.dumps(line | {"settings": {"wobble": 1}}))
    assert replay_session(folder) == 1
    captured = capsys.readouterr()
    assert "row 1" in captured.err
    assert "wobble" in captured.err
    assert "1 of 3 rows give the same numbers, 2 cannot be read." in captured.out
    with pytest.raises(UserError, match="not a session"):
        replay_session(folder / "frames")


def test_the_command_line_exports_and_replays(folder, tmp_path, capfd, refusal):
    assert main(["export", str(folder), "--out", str(tmp_path / "table.csv")]) == 0
    assert capfd.readouterr().out == f"{tmp_path / 'table.csv'}\n"
    assert main(["estimate", "--session", str(folder)]) == 0
    assert "3 of 3 rows" in capfd.readouterr().out
    for bad in (
        ["estimate", "tank.png", "--session", str(folder)],
        ["estimate", "--session", str(folder), "--json", "-"],
        ["estimate", "--session", str(tmp_path)],
    ):
        assert refusal(*bad)


@pytest.mark.parametrize("option", [["--min-area", "9"], ["--level", "0"], ["--mask", "1,2,3,4"], ["--at-frame", "3"]])
def test_what_a_session_has_of_its_own_is_not_overruled_in_silence(folder, refusal, option):
    assert f"{option[0]} does not go with --session" in refusal("estimate", "--session", str(folder), *option)
