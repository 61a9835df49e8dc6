from dockpose.app.export.study.plots import factor_plot, methods_plot
from dockpose.study.methods import METHODS
from dockpose.study.summary import summary_of

from tests.support.studied import table


def summary():
    return summary_of(table(20, lambda scene, method: "success" if scene % 3 else "wrong pose", docks=15))


def test_a_factors_plot_names_every_method_and_bin():
    one = summary()["factors"]["tilt_deg"]
    svg = factor_plot("tilt_deg", one).svg.decode()
    for title in [method.title for method in METHODS.values()]:
        assert title in svg
    for label in one["bins"]:
        assert label in svg
    assert "false docks in %" in svg


def test_the_same_numbers_give_the_same_bytes():
    assert methods_plot(summary()).svg == methods_plot(summary()).svg
    assert methods_plot(summary()).png == methods_plot(summary()).png
