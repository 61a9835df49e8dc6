"""The figures of the layout: entries, imports against the order, lines, descriptions of parameters."""

from tests.support import layout
from tests.support.layout import HOUSES, ROOT
from tests.test_layout import MOST_ENTRIES, MOST_LINES, MOST_LINES_OF_APP, NOT_YET_NUMPYDOC, STILL_WRONG


def test_layout(capsys):
    rows = []
    for house in HOUSES:
        count, crowded = layout.entries(ROOT / house), max(layout.folders(house), key=layout.entries)
        longest = max(layout.files(house), key=layout.lines)
        good, documented = layout.described(house)
        rows += [
            (f"entries in {house}/", count, f"at most {MOST_ENTRIES}"),
            (f"entries in {crowded.relative_to(ROOT)}/, the fullest", layout.entries(crowded), MOST_ENTRIES + 1),
            (f"lines of {house}/", sum(map(layout.lines, layout.files(house))), ""),
            (f"lines of {longest.relative_to(ROOT)}, the longest", layout.lines(longest), f"at most {MOST_LINES}"),
            (f"parameters of {house}/ with a description", f"{good} of {documented}", "all"),
        ]
    wrong = layout.wrong_imports()
    rows.append(("imports between folders against the order", len(wrong), 0))
    with capsys.disabled():
        print()
        for what, measured, goal in rows:
            print(f"{what:60} {measured!s:>12}   {goal}")
        for path, imported in wrong:
            print(f"  {path} -> {imported}")
    assert set(wrong) <= STILL_WRONG
    assert sum(map(layout.lines, layout.files("app"))) <= MOST_LINES_OF_APP
    assert all(set(layout.undescribed(house)) <= NOT_YET_NUMPYDOC for house in HOUSES)
