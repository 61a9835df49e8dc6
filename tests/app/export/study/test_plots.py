import pytest
from dockpose.app.export.parts import Plot
from dockpose.app.export.study.plots import factor_figure, methods_figure
from dockpose.study.judge import methods, title_of
from dockpose.study.summary import summary_of
from dockpose.thresholds import METHODS as THRESHOLDS
from dockpose.thresholds import register_threshold

from tests.support.studied import table


def summary():
    return summary_of(table(20, lambda scene, method: "success" if scene % 3 else "wrong pose", docks=15))


@pytest.mark.slow
def test_a_factors_plot_names_every_method_and_bin(monkeypatch):
    monkeypatch.setattr(THRESHOLDS, "_entries", dict(THRESHOLDS._entries))
    register_threshold("half_way", title="Half way up (mean)")(lambda grey: 128)
    one = summary()["factors"]["tilt_deg"]
    svg = Plot.of("tilt_deg", "", factor_figure(one)).svg.decode()
    titles = [title_of(label) for label in methods()]
    assert "Half way up" in titles
    for title in titles:
        assert title in svg
    for label in one["bins"]:
        assert label in svg
    assert "false docks in %" in svg


@pytest.mark.slow
def test_the_same_numbers_give_the_same_bytes():
    one = summary()
    first, second = (Plot.of("methods", "", methods_figure(one)) for _ in range(2))
    assert (first.svg, first.png) == (second.svg, second.png)
