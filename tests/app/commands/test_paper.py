"""The commands for papers, the study on a few real scenes."""

import csv
import io

import pytest
from dockpose import Camera, Dock
from dockpose.app.cli import main
from dockpose.app.export.words import budget_cells, budget_sentences, usual_ranges_m
from dockpose.camera.files import save_camera
from dockpose.study.budget import budget, farthest_apart_m, nearest_m
from dockpose.study.judge import OUTCOMES, methods
from dockpose.study.summary import FACTORS

CAMERA, DOCK = Camera(700, 700, 319.5, 239.5, 640, 480), Dock(0.30, 10)
SCENES = 6
WORDS = ["study", "--scenes", str(SCENES), "--seed", "4"]
DRAWN = ("range_diameters", "ring_radius_px", "attenuation_lengths", "lit_share", "lamp_spacings")


@pytest.fixture
def asked(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    save_camera(CAMERA, tmp_path / "camera.yaml")
    return ["budget", "--camera", "camera.yaml", "--dock-diameter", "30cm", "--lights", "10"]


def test_table_has_a_row_a_range_and_tilt_and_ends_in_words(asked, capsys):
    assert main([*asked, "--ranges", "1,4", "--tilts", "0,20"]) == 0
    printed = capsys.readouterr().out
    rows = [line.split() for line in printed.splitlines() if line.strip()[:2] in ("1 ", "4 ")]
    assert [row[:3] for row in rows] == [["1", "0", "65"], ["1", "20", "61"], ["4", "0", "16"], ["4", "20", "15"]]
    assert rows[0][-1] == "–"
    assert "one by one up to 16 m" in printed


def test_csv_has_the_errors_in_full(asked, capsys):
    assert main([*asked, "--ranges", "2", "--tilts", "0,30", "--csv", "-"]) == 0
    rows, expected = list(csv.DictReader(io.StringIO(capsys.readouterr().out))), budget(CAMERA, DOCK, 2.0, 30.0)
    assert [row["tilt_deg"] for row in rows] == ["0.0", "30.0"]
    assert rows[0]["told_apart"] == ""
    cells = {"sigma_z_m": expected.sigmas[2], "sigma_theta_x_deg": expected.sigmas[3]}
    cells |= {"told_apart": expected.tells_apart, "sigma_total_theta_y_deg": expected.totals[4]}
    assert {name: float(rows[1][name]) for name in cells} == pytest.approx(cells)


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["--tilts", "90"], "no error budget: tilt_deg is 90.0; it must be within 0 to 85"),
        (["--ranges", "1,x"], "--ranges 1,x must be numbers with commas between them"),
        (["--tilts=-1"], "tilt_deg is -1.0; it must be within 0 to 85"),
        (["--ranges", "1,0"], "range_m is 0.0"),
        (["--noise", "0"], "noise_px is 0.0"),
        (["--lights", "3"], "the dock has 3 lights; an error budget needs at least 4"),
    ],
)
def test_what_cannot_be_budgeted_is_said_in_one_line(asked, capsys, more, words):
    assert main([*asked, *more]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert words in line


def test_ranges_cells_and_sentences_of_a_budget():
    ranges = usual_ranges_m(CAMERA, DOCK)
    assert ranges == sorted(ranges)
    assert (ranges[0], ranges[-1]) == pytest.approx((nearest_m(CAMERA, DOCK), farthest_apart_m(CAMERA, DOCK)), rel=0.05)
    assert "(merge)" in budget_cells(budget(CAMERA, DOCK, 20.0, 0.0))[2]
    assert "(not all in view)" in budget_cells(budget(CAMERA, DOCK, 0.3, 10.0))[1]
    assert "no range at all at a tilt of 10°" in budget_sentences(CAMERA, DOCK, noise_px=20.0)[3]


@pytest.mark.slow
def test_the_table_has_a_row_for_each_scene_and_method_in_order_and_the_page_is_there(tmp_path, monkeypatch):
    """By one process, with plots of few factors, each of which takes a second to draw."""
    alone = tmp_path / "alone"
    monkeypatch.setattr("dockpose.study.summary.FACTORS", {name: FACTORS[name] for name in DRAWN})
    assert main([*WORDS, "--jobs", "1", "--out", str(alone)]) == 0
    rows = list(csv.DictReader(io.StringIO((alone / "study.csv").read_text(encoding="utf-8"))))
    assert [(row["scene"], row["method"]) for row in rows] == [
        (str(scene), label) for scene in range(SCENES) for label in methods()
    ]
    assert {row["outcome"] for row in rows} <= set(OUTCOMES)
    assert "Which method when" in (alone / "study.md").read_text(encoding="utf-8")
    for name in ("by_lit_share", "hats_against", "methods", "calibration"):
        for kind in ("png", "svg"):
            assert (alone / f"{name}.{kind}").stat().st_size > 1000


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--scenes", "0", "--seed", "1"], "--scenes is 0; it must be at least 1"),
        (["--scenes", "1", "--seed", "-1"], "--seed is -1; it must be at least 0"),
        (["--scenes", "1", "--seed", "1", "--jobs", "0"], "--jobs is 0; it must be at least 1"),
    ],
)
def test_bad_arguments_end_with_2(words, message, refusal):
    assert message in refusal("study", *words)
