import json

import pytest
from dockpose.app.export.study.report import advice_html, page_of, parts_of, trust_table
from dockpose.study.summary import summary_of

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
