"""The study, on a few real scenes."""

import csv
import io

import pytest
from dockpose.app.cli import main
from dockpose.study.judge import OUTCOMES, methods
from dockpose.study.summary import FACTORS

SCENES = 6
WORDS = ["study", "--scenes", str(SCENES), "--seed", "4"]
DRAWN = ("range_diameters", "ring_radius_px", "attenuation_lengths", "lit_share", "lamp_spacings")


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    """The folder of a study by one process, with plots of few factors, each of which takes a second to draw."""
    folder = tmp_path_factory.mktemp("study") / "alone"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dockpose.study.summary.FACTORS", {name: FACTORS[name] for name in DRAWN})
        assert main([*WORDS, "--jobs", "1", "--out", str(folder)]) == 0
    return folder


@pytest.mark.slow
def test_the_table_has_a_row_for_each_scene_and_method_in_order_and_the_page_is_there(alone):
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
