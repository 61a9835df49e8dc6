from pathlib import Path

from dockpose.app.processing.background import Progress
from dockpose.app.processing.comparison import compare_view, compared, figure_15
from dockpose.app.state.parameters import put
from dockpose.app.state.scene import paper_scene, paper_scenes, rendered, with_paper_scene

FOUR = ("otsu", "kapur", "kittler", "sezan")


def quiet():
    return Progress(lambda share: None)


def test_every_method_with_the_settings_of_the_view(view):
    told = []
    found = compare_view(put(view, "min_area_px", 3), Progress(told.append))
    assert tuple(found) == compared()
    assert all(one.settings.method == name and one.settings.min_area_px == 3 for name, one in found.items())
    assert told == sorted(told)
    assert told[-1] == 1.0


def as_the_report_says():
    """By scene the levels, groups and verdicts of the report's table of Figure 15."""
    lines = Path("docs/paper.md").read_text(encoding="utf-8").partition("## Figure 15")[2].splitlines()
    begin = next(number for number, one in enumerate(lines) if one.startswith("| scene | HATS |"))
    rows = [[cell.strip() for cell in one.strip("|").split("|")] for one in lines[begin + 2 : begin + 7]]
    return {name: cells for name, *cells in rows}


def test_on_the_scenes_of_the_paper_the_numbers_are_those_of_the_report(view):
    assert set(as_the_report_says()) == set(paper_scenes())
    for name, said in as_the_report_says().items():
        shown = rendered(with_paper_scene(view, name))
        assert (shown.source, paper_scene(shown)) == (name, name)
        rows = figure_15(shown) or []
        assert [f"{level}: {groups}, {'' if right else 'not '}right" for _, level, groups, right in rows] == said
        assert figure_15(put(shown, "z_cm", 150)) is None
    assert figure_15(view) is None
