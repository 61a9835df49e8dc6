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
    ((shown,),) = NumberTable("main", "", ["x"], [[number]], digits=2).shown
    assert shown == text


def test_a_table_in_markdown_shows_its_cells_to_the_letter():
    part = Part("main", "", "", "", "", tables=[NumberTable("main", "", ["a|b", "x_px"], [["1 < 2", 0.5]])])
    text = page("reproduction.md", seed=1, versions={}, parts=[part], is_whole=True)
    assert "| a\\|b | x\\_px |\n| --- | --- |\n| 1 \\< 2 | 0.5 |\n" in text


def test_the_short_form_has_its_own_words_and_the_tables_that_are_for_it():
    words = ("kept", "left")
    tables = [NumberTable(name, f"Rows of {name}.", ["x"], [[1]], is_on_page=name == "kept") for name in words]
    part = Part("main", "", "", "", "By 1.5 m.", tables=tables, short="In short.")
    whole, short = (page("reproduction.md", seed=1, versions={}, parts=[part], is_whole=one) for one in (True, False))
    assert [text in whole for text in ("Rows of kept.", "Rows of left.", "By 1.5 m.", "In short.")] == [True] * 3 + [
        False
    ]
    assert ("Rows of kept." in short, "Rows of left." in short) == (True, False)
    assert ("By 1.5 m." in short, "In short." in short) == (False, True)
