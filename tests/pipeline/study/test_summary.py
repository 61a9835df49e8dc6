import json

import numpy as np
import pytest
from dockpose.study.judge import HATS, PRODUCT, methods
from dockpose.study.summary import FACTORS, Factor, columns_of, of_method, summary_of

from tests.support.studied import table


def outcome(scene, method):
    """Of 10 scenes 8 have a dock: HATS is right in 6, Otsu in the first 3; Sezan sees one in a scene without."""
    if scene >= 8:
        return "false dock" if method == "sezan" and scene == 9 else "correct refusal"
    right = {"otsu": 3, HATS: 6}.get(method, 8)
    return "success" if scene < right else "wrong pose" if method == HATS else "refused"


@pytest.fixture(scope="module")
def summary():
    return summary_of(table(10, outcome, docks=8))


@pytest.mark.parametrize(
    ("label", "shares"),
    [
        (HATS, {"success": 6 / 8, "wrong_pose": 2 / 8, "right_of_reported": 6 / 8, "position_error_share": 0.01}),
        ("otsu", {"refused": 5 / 8, "right_of_reported": 1.0}),
        ("sezan", {"false_dock": 1 / 10, "false_dock_without": 1 / 2, "false_dock_beside": 0}),
        (PRODUCT, {"nearer": 1.0, "z_in_95": 1.0, "too_far": 1.0}),
    ],
)
def test_shares_of_the_methods(summary, label, shares):
    assert {key: summary["methods"][label][key]["value"] for key in shares} == pytest.approx(shares)


def test_hats_against_a_rival_on_the_same_scenes(summary):
    one = summary["against"][HATS]["otsu"]
    assert (one["value"], one["first_only"], one["second_only"], one["count"]) == (3 / 8, 3, 0, 8)


def test_a_factors_bins_add_up(summary):
    for factor in summary["factors"].values():
        assert len(factor["bins"]) == len(factor["scenes"])
        for results in factor["methods"].values():
            assert sum(result["success"]["count"] for result in results) <= 8
    width = summary["factors"]["width_px"]
    assert [result["success"]["hits"] for result in width["methods"][HATS]] == [3, 3, 0, 0, 0]


def test_calibration_and_coverage_of_the_product(summary):
    (row,) = (row for row in summary["calibration"]["probability"] if row["came"]["count"])
    assert (row["bin"], row["came"]["value"], row["came"]["count"]) == ("0.95 to 0.99", 1.0, 8)
    assert row["told"] == pytest.approx(0.97)
    assert summary["coverage"]["all"]["x"]["count"] == 8
    assert summary["widen"]["z"] == pytest.approx(1 / 1.96)  # every error is one standard error
    assert summary["widen"]["x"] is None


def test_it_is_plain_json_without_anything_timed(summary):
    assert json.loads(json.dumps(summary, allow_nan=False)) == summary
    assert "elapsed" not in json.dumps(summary)
    assert (summary["scenes"], summary["docks"], summary["seed"]) == (10, 8, 3)
    assert list(summary["methods"]) == methods()


@pytest.mark.parametrize(
    ("factor", "labels", "values", "bins"),
    [
        (Factor("x", "", (0, 1, 3)), ["0 to 1", "1 to 3"], [-0.1, 0, 1, 3, 3.1, np.nan], [-1, 0, 1, 1, -1, -1]),
        (Factor("n", "", (0, 1, 4, 7), is_whole=True), ["0", "1 to 3", "4 to 7"], [0.0, 3, 4, 7], [0, 1, 2, 2]),
        (FACTORS["width_px"], ["320", "640", "800", "1280", "1920"], [320.0, 1920], [0, 4]),
    ],
)
def test_bins_hold_their_lower_edge_and_the_last_its_upper_one_too(factor, labels, values, bins):
    assert factor.labels == labels
    assert factor.bins_of(np.array(values)).tolist() == bins


def test_columns_are_numbers_but_for_words():
    columns = columns_of("scene,method,status,z_m\n0,hats,ok,1.5\n0,otsu,no_lights,\n")
    np.testing.assert_array_equal(columns["z_m"], [1.5, np.nan])
    assert of_method(columns, "otsu")["status"].tolist() == ["no_lights"]
