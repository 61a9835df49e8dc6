"""Figures that the pages tell are those of the two reports, which commands make."""

import html
import re

import dockpose

from tests.docs.pages import DOCS, ROOT

README = (ROOT / "README.md").read_text(encoding="utf-8")
PAPER = (DOCS / "paper.md").read_text(encoding="utf-8")


def rows_of(name):
    """Cells of all rows of a report's tables, and its text."""
    page = re.sub(r"<(svg|style)\b.*?</\1>", "", (ROOT / "static" / name).read_text(encoding="utf-8"), flags=re.DOTALL)
    rows = [
        re.findall(r"<t[dh][^>]*>(.*?)</t[dh]>", row, re.DOTALL)
        for row in re.findall(r"<tr>(.*?)</tr>", page, re.DOTALL)
    ]
    return [[plain(cell) for cell in row] for row in rows], plain(page)


def plain(text):
    return re.sub(r"\s+", " ", html.unescape(re.sub(r"<[^>]+>", "", text))).strip()


def test_the_version_is_the_same_everywhere():
    assert f"\nversion: {dockpose.__version__}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert re.findall(r"^## \[(\d.*?)\]", changes, re.MULTILINE)[0] == dockpose.__version__
    assert f"dockpose {dockpose.__version__}," in PAPER


def told_in(pattern, text):
    match = re.search(pattern, text)
    assert match is not None, pattern
    return match


def test_the_studys_figures():
    rows, text = rows_of("study.html")
    docks, scenes = (int(told_in(pattern, text)[1]) for pattern in (r"(\d+) with a dock", r"From (\d+) simulated"))
    right = told_in(r"most often, in ([\d.]+) % \(([\d.]+) to ([\d.]+)\)", text)
    assert f"| {float(right[1]):.0f} % of {docks} ({float(right[2]):.0f} to {float(right[3]):.0f}) |" in README
    reported = told_in(r"its right pose in ([\d.]+) % \(([\d.]+) to ([\d.]+)\) of the docks it reports", text)
    assert f"| {float(reported[1]):.0f} % ({float(reported[2]):.0f} to {float(reported[3]):g}) |" in README
    assert re.search(r"it reports a dock in 0\.0 %", text)
    assert f"| 0 of {scenes - docks} " in README
    held = told_in(
        r"truth of x ([\d.]+) %, y ([\d.]+) %, z ([\d.]+) %, theta_x ([\d.]+) % and theta_y ([\d.]+) %", text
    )
    assert f"| {float(held[3]):.0f} % (z) to {float(held[5]):.0f} % (pitch, yaw) |" in README
    (far,) = (row for row in rows if row[0] == "12 to 20")
    assert f"nine in ten below {far[3]} %, {far[4]} deg" in README


def test_approaches_in_closed_loop():
    rows = [line.strip("| ").split(" | ") for line in PAPER.splitlines() if line.startswith("| ")]
    right = {cells[0]: cells[3] for cells in rows if len(cells) == 7 and cells[0].startswith(("Table 1", "tracker"))}
    assert f"in {right['Table 1 by the letter']} the pose chosen in the last frame was the right one." in README
    assert right["tracker"] == "100"


def test_each_figure_of_the_paper_is_there():
    shown = re.findall(r"\]\((figures/paper/[^)]*)\)", PAPER)
    assert len(shown) == 11
    assert {path.name for path in (DOCS / "figures" / "paper").iterdir()} == {name.rpartition("/")[2] for name in shown}
