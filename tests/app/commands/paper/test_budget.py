import csv
import io

import pytest
from dockpose import Camera, Dock
from dockpose.app.cli import main
from dockpose.app.export.budget import budget_cells, budget_sentences, usual_ranges_m
from dockpose.camera.files import save_camera
from dockpose.study.budget import budget, farthest_apart_m, nearest_m

CAMERA, DOCK = Camera(700, 700, 319.5, 239.5, 640, 480), Dock(0.30, 10)


@pytest.fixture
def asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_camera(CAMERA, tmp_path / "camera.yaml")
    return ["budget", "--camera", "camera.yaml", "--dock-diameter", "30cm", "--lights", "10", "--draws", "20"]


def test_table_has_a_row_a_range_and_tilt_and_ends_in_words(asked, capsys):
    assert main([*asked, "--ranges", "1,4", "--tilts", "0,20"]) == 0
    printed = capsys.readouterr().out
    rows = [line.split() for line in printed.splitlines() if line.strip()[:2] in ("1 ", "4 ")]
    assert [row[:3] for row in rows] == [["1", "0", "65"], ["1", "20", "61"], ["4", "0", "16"], ["4", "20", "15"]]
    assert rows[0][-1] == "–"
    assert "one by one up to 16 m" in printed
    assert "20 simulated sets" in printed


def test_csv_has_expected_and_simulated_errors_in_full(asked, capsys):
    assert main([*asked, "--ranges", "2", "--tilts", "0,30", "--csv", "-"]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    expected = budget(CAMERA, DOCK, 2.0, 30.0)
    assert [row["tilt_deg"] for row in rows] == ["0.0", "30.0"]
    assert rows[0]["told_apart"] == rows[0]["simulated_told_apart"] == ""
    assert float(rows[1]["sigma_z_m"]) == pytest.approx(expected.sigma_position_m[2])
    assert float(rows[1]["told_apart"]) == pytest.approx(expected.tells_apart)
    # Of 20 draws a standard deviation is known to 16 %.
    assert float(rows[1]["simulated_sigma_z_m"]) == pytest.approx(expected.sigma_position_m[2], rel=0.6)


def test_same_seed_same_table(asked, capsys):
    texts = []
    for seed in ("3", "3", "4"):
        assert main([*asked, "--ranges", "2", "--csv", "-", "--seed", seed]) == 0
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1] != texts[2]


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--tilts", "90"], "no error budget: tilt_deg is 90.0; it must be within 0 to 85"),
        (["--ranges", "1,x"], "--ranges 1,x must be numbers with commas between them"),
        (["--noise", "0"], "noise_px is 0.0"),
        (["--lights", "3"], "the dock has 3 lights; an error budget needs at least 4"),
        (["--draws", "0"], "draws is 0"),
    ],
)
def test_what_cannot_be_budgeted_is_said_in_one_line(asked, capsys, more, words):
    assert main([*asked, *more]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line


def test_usual_ranges_go_from_filling_the_picture_to_merging_lights():
    ranges = usual_ranges_m(CAMERA, DOCK)
    assert ranges == sorted(ranges)
    assert ranges[0] == pytest.approx(nearest_m(CAMERA, DOCK), rel=0.05)
    assert ranges[-1] == pytest.approx(farthest_apart_m(CAMERA, DOCK), rel=0.05)


def test_cells_say_what_is_not_seen():
    assert "(merge)" in budget_cells(budget(CAMERA, DOCK, 20.0, 0.0))[2]
    assert "(not all in view)" in budget_cells(budget(CAMERA, DOCK, 0.3, 10.0))[1]


def test_sentences_name_no_range_where_none_will_do():
    blurred = budget_sentences(CAMERA, DOCK, noise_px=20.0)
    assert "no range at all at a tilt of 10°" in blurred[3]
