import pytest
from dockpose.app.export.study.words import advice_text, calibration_text, claim_text, factor_text, verdict
from dockpose.study.summary import summary_of

from tests.support.studied import table

SCENES = 100


def outcome(scene, method):
    """HATS is right in 80 of 100 scenes, Otsu in 50, Sezan in 95, Kapur in 79; the product in all."""
    right = {"hats": 80, "otsu": 50, "sezan": 95, "kapur": 79, "hats_and_local": 100}.get(method, 80)
    return "success" if scene < right else "refused"


@pytest.fixture(scope="module")
def summary():
    return summary_of(table(SCENES, outcome))


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [(0.01, 0.2, "better"), (-0.2, -0.01, "worse"), (-0.1, 0.1, "open"), (0, 0, "open"), (None, None, "open")],
)
def test_the_interval_decides(low, high, wanted):
    assert verdict({"value": low, "low": low, "high": high}) == wanted


def test_the_claim_stands_falls_or_is_open(summary):
    text = " ".join(claim_text(summary))
    assert "HATS gives the right pose in 80.0 %" in text
    assert "claim of HATS stands against Otsu (+30.0 points" in text
    assert "HATS falls behind Sezan (-15.0 points" in text
    assert "cannot tell HATS from Kapur (+1.0 points" in text


def test_where_hats_is_better_or_worse(summary):
    text = factor_text(summary)
    assert "Against Otsu, HATS is better at turbidity (0 clear, 1 harbour) 0.4 to 0.6 and 0.6 to 0.8" in text[0]
    assert any("Sezan, HATS is worse at" in one for one in text)
    assert text[-1].startswith("Each rival is compared in")


def test_advice_names_the_best_and_how_far(summary):
    text = " ".join(advice_text(summary))
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


def test_a_range_that_is_mostly_too_long_is_told(summary):
    text = " ".join(calibration_text(summary))
    assert "The range is too long in 100.0 %" in text
    assert "towards the ring's middle" in text
