"""``dockpose check --truth``: what was drawn is found, told, written and held; what cannot be is refused."""

import csv
import json
import math
import re

import numpy as np
import pytest
from dockpose import load_camera, load_dock, load_vehicle
from dockpose.app.cli import main
from scipy.spatial.transform import Rotation

from tests.support.moving import CAMERA, DOCK, MOUNT, draw
from tests.support.trajectories import result_lines, tum_lines

SCALE = 1.01


@pytest.fixture(scope="module")
def moved():
    """A course whose clocks are 3.7 s apart, whose dock is 1 % larger than was said, and some wrong poses."""
    return draw(4, duration_s=40.0, gaps=6, scale=SCALE, wrong_pose=0.05)


@pytest.fixture(scope="module")
def folder(tmp_path_factory, moved):
    folder = tmp_path_factory.mktemp("lab")
    (folder / "film.jsonl").write_text(result_lines(moved.results))
    (folder / "truth.txt").write_text(tum_lines(moved.truth))
    return folder


@pytest.fixture
def lab(folder, monkeypatch):
    monkeypatch.chdir(folder)
    return folder


@pytest.fixture(scope="module")
def found(folder):
    film, truth, out = (str(folder / name) for name in ("film.jsonl", "truth.txt", "c.json"))
    assert main(["check", film, "--truth", truth, "--json", out]) == 0
    return json.loads((folder / "c.json").read_text())


def table_of(path):
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def turned_deg(quaternion, rotation):
    return math.degrees((Rotation.from_quat(quaternion).inv() * rotation).magnitude())


def test_what_was_drawn_is_found(found, moved):
    assert found["offset_s"] == pytest.approx(3.7, abs=0.002)
    assert found["offset_sigma_s"] < 0.002
    assert found["mount"]["position_m"] == pytest.approx(moved.lever_m.tolist(), abs=0.002)
    assert turned_deg(found["mount"]["quaternion_xyzw"], MOUNT) < 0.1
    assert found["dock_in_world"]["position_m"] == pytest.approx(moved.dock_m.tolist(), abs=0.002)
    assert found["scale"] == pytest.approx(SCALE, abs=0.0005)
    assert set(found["rms"]) == {"x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg"}
    wrong = found["wrong_pose"]
    assert wrong["share"] == pytest.approx(0.05, abs=0.04)
    assert (found["results"], found["truth"], found["clock"]) == ("film.jsonl", "truth.txt", "time_s")


def test_it_is_told_in_plain_words(lab, capsys):
    assert main(["check", "film.jsonl", "--truth", "truth.txt"]) == 0
    told = capsys.readouterr().out
    offset = re.search(r"Clocks: add ([\d.]+) ± [\d.]+ s to the results' times", told)
    assert offset is not None, told
    assert float(offset[1]) == pytest.approx(3.7, abs=0.002)
    size = re.search(r"so that the dock measures ([\d.]+) ± [\d.]+ cm across", told)
    assert size is not None, told
    assert float(size[1]) == pytest.approx(100 * SCALE * DOCK.diameter, abs=0.02)
    assert "The wrong one of the two poses was chosen in" in told
    assert "another dock in 0" in told
    assert "A plain ring does not show its roll" in told
    assert re.search(r"frames +count +x \(cm\)", told)


def test_dock_camera_and_mount_so_corrected_are_written_and_read(lab, moved, capsys):
    named = {"--out": "d.yaml", "--out-camera": "k.yaml", "--out-vehicle": "v.yaml"}
    outs = [word for pair in named.items() for word in pair]
    assert main(["check", "film.jsonl", "--truth", "truth.txt", *outs]) == 0
    assert load_dock("d.yaml").diameter == pytest.approx(SCALE * DOCK.diameter, rel=0.0005)
    assert load_camera("k.yaml").fx == pytest.approx(SCALE * CAMERA.fx, rel=0.0005)
    mount = load_vehicle("v.yaml").T_body_camera
    assert mount.position_m == pytest.approx(moved.lever_m.tolist(), abs=0.002)
    assert mount.quaternion_xyzw is not None
    assert turned_deg(mount.quaternion_xyzw, MOUNT) < 0.1
    assert 0 < mount.position_sigma_m < 0.002
    assert 0 < mount.angle_sigma_deg < 0.1
    assert "its frame is taken as flu" in capsys.readouterr().out
    assert main(["check", "film.jsonl", "--truth", "truth.txt", "--mount", "v.yaml", "--json", "-"]) == 0
    held = json.loads(capsys.readouterr().out)
    assert held["mount"]["position_m"] == list(mount.position_m)
    assert held["mount"]["position_sigma_m"] is None


def test_what_is_given_is_held(lab, moved, capsys):
    lever = ",".join(f"{one:.9f}" for one in moved.lever_m)
    given = [f"--mount={lever}", "--offset", "3.7", "--json", "-"]
    assert main(["check", "film.jsonl", "--truth", "truth.txt", *given]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["offset_s"], found["offset_sigma_s"]) == (3.7, None)
    assert found["mount"]["position_m"] == pytest.approx(moved.lever_m.tolist(), abs=1e-8)
    assert found["mount"]["position_sigma_m"] is None
    assert turned_deg(found["mount"]["quaternion_xyzw"], MOUNT) < 0.1
    assert found["mount"]["angle_sigma_deg"] is not None


def test_report_tables_and_plots(lab, found, moved):
    assert main(["check", "film.jsonl", "--truth", "truth.txt", "--report", "report"]) == 0
    names = {path.name for path in (lab / "report").iterdir()}
    figures = {f"{stem}.{kind}" for stem in ("errors", "paths", "space", "clocks") for kind in ("svg", "png")}
    assert names == {"report.html", "compared.json", "frames.csv", "bands.csv", "table.tex", *figures}
    page = (lab / "report/report.html").read_text()
    assert page.count("<svg") == 4
    assert "Root mean square error" in page
    assert "<script" not in page
    rows = table_of(lab / "report/frames.csv")
    assert len(rows) == len(moved.results.times_s)
    row = next(row for row in rows if row["true_z_cm"] and row["is_wrong_pose"] == "0")
    at = int(np.argmin(np.abs(moved.results.times_s - float(row["time_s"]))))
    assert float(row["true_z_cm"]) == pytest.approx(100 * moved.positions_m[at, 2], abs=0.3)
    assert float(row["z_cm"]) - float(row["true_z_cm"]) == pytest.approx(float(row["error_z_cm"]), abs=2e-6)
    bands = {(row["frames"], row["kind"]): row for row in table_of(lab / "report/bands.csv")}
    assert float(bands["all", "rms"]["z_cm"]) == pytest.approx(100 * found["rms"]["z_m"], abs=6e-4)


def test_the_table_in_latex_has_measured_beside_estimated(lab):
    assert main(["check", "film.jsonl", "--truth", "truth.txt", "--report", "table.tex"]) == 0
    lines = (lab / "table.tex").read_text().splitlines()
    numbers = [line.removesuffix(r" \\").split(" & ") for line in lines if re.match(r"-?\d", line)]
    assert len(numbers) == 12
    depths = [float(row[2]) for row in numbers]
    assert depths == sorted(depths)
    assert all(len(row) == 10 for row in numbers)
    assert all(SCALE * float(row[7]) == pytest.approx(float(row[2]), rel=0.003) for row in numbers)
    assert [line.split(" &")[0] for line in lines if line[:1] in "MR"] == ["Mean absolute", "RMS"]
    assert lines[1].startswith(r"\begin{tabular}")
    assert lines[-1] == r"\end{tabular}"


BAD = {
    "--offset 3": "--offset needs --truth",
    "--truth none.txt": "none.txt: cannot be read",
    "--truth truth.txt --mount east": "--mount east: must be X,Y,Z in metres",
    "--truth truth.txt --mount 1,2": "--mount 1,2: must be X,Y,Z in metres",
    "--truth truth.txt --mount 0,0,0,0": "--mount 0,0,0,0: must be X,Y,Z in metres",
    "--truth truth.txt --json truth.txt": "--json truth.txt: would overwrite the input truth.txt",
    "--truth truth.txt --report report.pdf": "of this source there is no .pdf",
    "--truth film.jsonl": "film.jsonl: is a file of results|begins with",
    "--truth short.txt": "has 3 poses; 30 are needed",
}


@pytest.mark.parametrize("words", BAD)
def test_what_cannot_be_is_one_sentence(lab, words, capsys):
    (lab / "short.txt").write_text("".join((lab / "truth.txt").read_text().splitlines(keepends=True)[:3]))
    assert main(["check", "film.jsonl", *words.split()]) in (1, 2)
    told = capsys.readouterr().err
    assert re.search(BAD[words], told), told
    assert told.count("\n") == 1
