import csv
import hashlib
import json

import cv2
import numpy as np
import pytest
from dockpose import Settings, estimate
from dockpose.app.cli import main
from dockpose.app.drawing.annotated import LAYERS
from dockpose.app.drawing.colours import TRUTH_COLOUR, bgr
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


def test_what_cannot_be_exported_is_said(tmp_path, folder, refusal):
    picture = tmp_path / "tank.png"
    picture.write_bytes(sample_path("plain").read_bytes())
    camera = ["--camera", str(sample_path("plain").with_suffix(".yaml"))]
    for source, out, more, sentence in (
        (picture, "out", [], "which camera"),
        (picture, "out", camera, "how large is the dock"),
        (folder, "a.docx", [], "there is no .docx"),
        (folder, "a.svg", ["--layers", "lamps"], "--layers has 'lamps'"),
        (tmp_path, "out", [], "is a folder, and no session"),
        (tmp_path / "gone.png", "out", [], "cannot be read"),
    ):
        words = ["export", str(source), "--out", str(tmp_path / out), *more]
        assert sentence in refusal(*words, status=1 if sentence == "cannot be read" else 2)
    assert set(LAYERS) >= {"lights", "scale"}


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


def test_the_command_line_exports_a_session(folder, tmp_path, capfd):
    assert main(["export", str(folder), "--out", str(tmp_path / "table.csv")]) == 0
    assert capfd.readouterr().out == f"{tmp_path / 'table.csv'}\n"
