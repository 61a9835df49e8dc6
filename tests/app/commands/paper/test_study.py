"""The command itself, on a few real scenes; kills and a cluster are in tests/bench/bench_study.py."""

import pandas as pd
import pytest
from dockpose.app.cli import main
from dockpose.study.judge import OUTCOMES, methods
from dockpose.study.summary import FACTORS

SCENES = 6
WORDS = ["study", "--scenes", str(SCENES), "--seed", "4"]
DRAWN = ("range_diameters", "ring_radius_px", "attenuation_lengths", "lit_share", "lamp_spacings")


@pytest.fixture(scope="module", autouse=True)
def few_plots():
    """Each factor takes a second to draw."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("dockpose.study.summary.FACTORS", {name: FACTORS[name] for name in DRAWN})
        yield


@pytest.fixture(scope="module")
def alone(tmp_path_factory, few_plots):
    """The folder of a study by one process."""
    folder = tmp_path_factory.mktemp("study") / "alone"
    assert main([*WORDS, "--jobs", "1", "--out", str(folder)]) == 0
    return folder


@pytest.mark.slow
def test_the_table_loads_with_pandas(alone):
    table = pd.read_csv(alone / "study.csv")
    assert len(table) == SCENES * len(methods())
    assert set(table["outcome"]) <= set(OUTCOMES)
    assert table["range_m"].dtype == float
    assert not [name for name in table if "elapsed" in name]
    cost = pd.read_csv(alone / "cost.csv")
    assert all(cost["elapsed_ms"] > 0)
    assert len(cost) == len(table)


def test_page_and_plots_are_there(alone):
    text = (alone / "index.html").read_text(encoding="utf-8")
    assert "Which method when" in text
    assert "src=" not in text  # it needs nothing beside it
    for name in ("by_lit_share", "hats_against", "methods", "calibration", "cost"):
        for kind in ("png", "svg"):
            assert (alone / "plots" / f"{name}.{kind}").stat().st_size > 1000


def test_ctrl_c_keeps_what_is_done(tmp_path, monkeypatch, capsys):
    def run(study, jobs, scheduler, done):
        done(0)
        raise KeyboardInterrupt

    monkeypatch.setattr("dockpose.app.processing.study.Study.run", run)
    assert main([*WORDS, "--out", str(tmp_path)]) == 130
    assert f"0 of {SCENES} scenes are kept in {tmp_path}, and the same command goes on" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--scenes", "0", "--seed", "1"], "--scenes is 0; it must be at least 1"),
        (["--scenes", "1", "--seed", "-1"], "--seed is -1; it must be at least 0"),
        (["--scenes", "1", "--seed", "1", "--jobs", "0"], "--jobs is 0; it must be at least 1"),
    ],
)
def test_bad_arguments_end_with_2(words, message, capsys):
    assert main(["study", *words]) == 2
    assert message in capsys.readouterr().err
