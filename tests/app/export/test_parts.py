import pytest
from dockpose.app.export.parts import by_verdict, sentences
from dockpose.study.statistics import wilson


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [(0.01, 0.2, "better"), (-0.2, -0.01, "worse"), (-0.1, 0.1, "open"), (0, 0, "open"), (None, None, "open")],
)
def test_the_interval_decides(low, high, wanted):
    assert by_verdict({"name": {"value": low, "low": low, "high": high}}) == {wanted: ["name"]}


def test_a_share_in_words():
    assert sentences("parts.txt", "share", wilson(2, 4)) == ["50 % (15 to 85)"]
