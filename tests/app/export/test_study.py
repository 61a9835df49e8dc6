"""The study's page, its words and its plots."""

import json
import re

import pytest
from dockpose.app.export.parts import Plot
from dockpose.app.export.study.plots import factor_figure
from dockpose.app.export.study.report import (
    advice_html,
    advice_text,
    calibration_text,
    claim_text,
    factor_text,
    trust_table,
    write_report,
)
from dockpose.study.judge import methods, title_of
from dockpose.study.summary import summary_of

from tests.support.methods import registered
from tests.support.studied import table

DRAWN = ("range_diameters", "ring_radius_px", "attenuation_lengths", "lit_share", "lamp_spacings")


@pytest.fixture(scope="module")
def columns():
    return table(40, lambda scene, method: "success" if scene % 4 else "refused")


@pytest.fixture(scope="module")
def summary(columns):
    return summary_of(columns)


def test_advice_and_trust_of_a_saved_summary(summary):
    html = advice_html(summary)
    assert html.startswith("<p>From 40 simulated scenes of seed 3, 40 with a dock.")
    assert (html.count("<table>"), html.count("<html")) == (1, 0)
    assert advice_html(json.loads(json.dumps(summary))) == html
    trust = trust_table(summary, "range_diameters")
    assert trust.head[:3] == ["range in dock diameters", "docks", "found and right in %"]
    # 40 scenes spread evenly over 0 to 60 diameters: 1.5 apart, so 0 and 1.5 are below 2, of which the second is right.
    assert list(trust.rows[0][:4]) == ["0 to 2", 2, 50.0, 100.0]
    assert trust.rows[0][6] == pytest.approx(1.0)


@pytest.mark.slow
def test_the_page_has_everything(summary, tmp_path):
    few = {name: summary["factors"][name] for name in DRAWN}  # each takes a second to draw
    text = write_report(tmp_path, summary | {"factors": few}).read_text(encoding="utf-8")
    heads = [line[3:] for line in text.splitlines() if line.startswith("## ")]
    assert [head.split(",")[0] for head in heads] == [
        *("Which method when", "HATS against its rivals", "All methods", "What makes it hard"),
        "Probabilities and intervals",
    ]
    shown = re.findall(r"\]\(\./(\S+)\)", text)
    assert shown == [
        f"{name}.svg" for name in ("hats_against", "methods", *(f"by_{name}" for name in few), "calibration")
    ]
    names = {path.name for path in tmp_path.iterdir()}
    assert {*shown, "summary.json", "advice.html", "factors.csv", "trust_range_diameters.csv"} <= names
    assert "None" not in text


def hundred(right, otherwise="refused"):
    """A hundred scenes, in the first ``right`` of which a method is right, 80 for those without a number."""
    return summary_of(table(100, lambda scene, label: "success" if scene < right.get(label, 80) else otherwise))


USUAL = {"hats": 80, "otsu": 50, "sezan": 95, "kapur": 79, "hats_and_local": 100}
SAID = [
    (claim_text, USUAL, "refused", "HATS gives the right pose in 80.0 %"),
    (claim_text, USUAL, "refused", "claim of HATS stands against Otsu (+30.0 points"),
    (claim_text, USUAL, "refused", "HATS falls behind Sezan (-15.0 points"),
    (claim_text, USUAL, "refused", "cannot tell HATS from Kapur (+1.0 points"),
    (factor_text, USUAL, "refused", "Against Otsu, HATS is better at turbidity (0 clear, 1 harbour) 0.4 to 0.6"),
    (factor_text, USUAL, "refused", "Against Kapur, HATS is nowhere better or worse beyond chance."),
    (advice_text, USUAL, "refused", "HATS + local finds the right pose most often, in 100.0 %"),
    (advice_text, USUAL, "refused", "to hold 95 %, their widths would have to be multiplied by 0.5 for z."),
    (advice_text, USUAL, "refused", "Nowhere does another method do better"),
    (advice_text, USUAL, "refused", "By range in dock diameters, at least 90 % of the reported poses are right ev"),
    (advice_text, {"hats_and_local": 60}, "wrong pose", "at turbidity (0 clear, 1 harbour) 0.6 to 0.8"),
    (advice_text, {"hats_and_local": 60}, "wrong pose", "fewer at"),
    (calibration_text, {"hats_and_local": 50}, "wrong pose", "but not at 0.95 to 0.99 (given 97 %, came 50 %)"),
    (calibration_text, {"hats_and_local": 50}, "wrong pose", "x 50.0 %"),
    (calibration_text, {"hats_and_local": 50}, "wrong pose", "as often as not"),
    (calibration_text, USUAL, "refused", "towards the ring's middle"),
]  # fmt: skip


@pytest.mark.parametrize(("say", "right", "otherwise", "words"), SAID)
def test_what_the_study_says(say, right, otherwise, words):
    assert words in " ".join(say(hundred(right, otherwise)))


@pytest.mark.slow
def test_a_factors_plot_names_every_method_and_bin():
    with registered(half_way=("Half way up (mean)", lambda grey: 128)):
        one = summary_of(table(20, lambda scene, method: "success" if scene % 3 else "wrong pose", docks=15))
        factor = one["factors"]["tilt_deg"]
        svg = Plot.of("tilt_deg", "", factor_figure(factor)).svg.decode()
        titles = [title_of(label) for label in methods()]
    assert "Half way up" in titles
    for text in (*titles, *factor["bins"], "false docks in %"):
        assert text in svg
