"""The study's page, its words and its plots."""

import json

import pytest
from dockpose.app.export.parts import Plot
from dockpose.app.export.study.plots import factor_figure
from dockpose.app.export.study.report import (
    advice_html,
    advice_text,
    calibration_text,
    claim_text,
    page_of,
    parts_of,
    trust_table,
)
from dockpose.study.judge import methods, title_of
from dockpose.study.summary import summary_of
from dockpose.thresholds import METHODS as THRESHOLDS
from dockpose.thresholds import register_threshold

from tests.support.studied import table

DRAWN = ("range_diameters", "ring_radius_px", "attenuation_lengths", "lit_share", "lamp_spacings")


@pytest.fixture(scope="module")
def columns():
    return table(40, lambda scene, method: "success" if scene % 4 else "refused")


@pytest.fixture(scope="module")
def summary(columns):
    return summary_of(columns)


def test_advice_is_a_fragment_that_a_saved_summary_gives_too(summary):
    html = advice_html(summary)
    assert html.startswith("<p>From 40 simulated scenes of seed 3, 40 with a dock.")
    assert html.count("<table>") == 3
    assert "<html" not in html
    assert advice_html(json.loads(json.dumps(summary))) == html


def test_trust_by_range(summary):
    trust = trust_table(summary, "range_diameters")
    rows = trust.rows
    assert trust.head[:3] == ["range in dock diameters", "docks", "found and right in %"]
    # 40 scenes spread evenly over 0 to 60 diameters: 1.5 apart, so 0 and 1.5 are below 2, of which the second is right.
    assert list(rows[0][:4]) == ["0 to 2", 2, 50.0, 100.0]
    assert rows[0][6] == pytest.approx(1.0)


@pytest.mark.slow
def test_the_page_has_everything_and_stands_alone(summary, columns):
    few = {name: summary["factors"][name] for name in DRAWN}  # each takes a second to draw
    summary = summary | {"factors": few}
    parts = parts_of(summary, columns)
    assert [part.key for part in parts] == ["claim", "all", "factors", "calibration", "cost"]
    assert len(parts[2].plots) == len(summary["factors"])
    html = page_of(summary, parts)
    assert html.index("Which method when") < html.index("HATS against its rivals")
    assert html.count("<svg") == sum(len(part.plots) for part in parts)
    assert "None" not in html.replace("none", "")
    assert "src=" not in html


SCENES = 100


def outcome(scene, method):
    """HATS is right in 80 of 100 scenes, Otsu in 50, Sezan in 95, Kapur in 79; the product in all."""
    right = {"hats": 80, "otsu": 50, "sezan": 95, "kapur": 79, "hats_and_local": 100}.get(method, 80)
    return "success" if scene < right else "refused"


@pytest.fixture(scope="module")
def hundred():
    return summary_of(table(SCENES, outcome))


def test_the_claim_stands_falls_or_is_open(hundred):
    text = " ".join(claim_text(hundred))
    assert "HATS gives the right pose in 80.0 %" in text
    assert "claim of HATS stands against Otsu (+30.0 points" in text
    assert "HATS falls behind Sezan (-15.0 points" in text
    assert "cannot tell HATS from Kapur (+1.0 points" in text


def test_advice_names_the_best_and_how_far(hundred):
    text = " ".join(advice_text(hundred))
    assert "HATS + local finds the right pose most often, in 100.0 %" in text
    assert "hold the truth of z 100 %; to hold 95 %, their widths would have to be multiplied by 0.5 for z." in text
    assert "nowhere does another method do better" in text.lower()
    assert "By range in dock diameters, at least 90 % of the reported poses are right everywhere." in text


def test_advice_says_where_another_is_better_and_where_not_to_trust():
    def worse(scene, method):
        return "wrong pose" if method == "hats_and_local" and scene >= 60 else "success"

    text = " ".join(advice_text(summary_of(table(SCENES, worse))))
    assert "at turbidity (0 clear, 1 harbour) 0.6 to 0.8" in text
    assert "fewer at" in text


def test_calibration_tells_what_does_not_hold():
    def wrong(scene, method):
        return "wrong pose" if scene % 2 else "success"

    text = " ".join(calibration_text(summary_of(table(SCENES, wrong))))
    assert "in 0 of 1 bins, but not at 0.95 to 0.99 (given 97 %, came 50 %)" in text
    assert "x 50.0 %" in text
    assert "as often as not" in text


def of_twenty():
    return summary_of(table(20, lambda scene, method: "success" if scene % 3 else "wrong pose", docks=15))


@pytest.mark.slow
def test_a_factors_plot_names_every_method_and_bin(monkeypatch):
    monkeypatch.setattr(THRESHOLDS, "_entries", dict(THRESHOLDS._entries))
    register_threshold("half_way", title="Half way up (mean)")(lambda grey: 128)
    one = of_twenty()["factors"]["tilt_deg"]
    svg = Plot.of("tilt_deg", "", factor_figure(one)).svg.decode()
    titles = [title_of(label) for label in methods()]
    assert "Half way up" in titles
    for title in titles:
        assert title in svg
    for label in one["bins"]:
        assert label in svg
    assert "false docks in %" in svg
