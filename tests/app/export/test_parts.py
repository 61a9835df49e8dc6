import pytest
from dockpose.app.export.parts import NumberTable, Part, by_verdict, page, sentences
from dockpose.study.statistics import wilson


@pytest.mark.parametrize(
    ("low", "high", "wanted"),
    [(0.01, 0.2, "better"), (-0.2, -0.01, "worse"), (-0.1, 0.1, "open"), (0, 0, "open"), (None, None, "open")],
)
def test_the_interval_decides(low, high, wanted):
    assert by_verdict({"name": {"value": low, "low": low, "high": high}}) == {wanted: ["name"]}


def test_a_share_in_words():
    assert sentences("parts.txt", "share", wilson(2, 4)) == ["50 % (15 to 85)"]


@pytest.mark.parametrize(
    ("number", "text"), [(99.6, "100"), (99.4, "99"), (1234.5, "1234"), (0.0123, "0.012"), (-99.7, "-100"), (None, "–")]
)
def test_numbers_are_rounded_and_large_ones_written_out(number, text):
    ((shown,),) = NumberTable("main", ["x"], [[number]], digits=2).shown
    assert shown == text


def test_a_page_in_markdown_shows_cells_to_the_letter_and_those_tables_that_have_a_caption():
    captions = {"shown": "Px.", "left": ""}
    tables = [NumberTable(name, ["a|b", "x_px"], [["1 < 2", 0.5]], caption) for name, caption in captions.items()]
    text = page("paper.md", seed=1, versions={}, parts=[Part("main", "Figure 1: x", "By 1.5 m.", tables=tables)])
    assert "## Figure 1: x\n\nBy 1.5 m.\n\nPx.\n\n| a\\|b | x\\_px |\n| --- | --- |\n| 1 \\< 2 | 0.5 |\n" in text
    assert text.count("x\\_px") == 1
