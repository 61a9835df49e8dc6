from dataclasses import replace

import numpy as np
import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.detection import with_mask, with_method
from dockpose.app.state.dock import with_lights
from dockpose.app.state.view import open_source, with_sample
from dockpose.app.web.panels.detect import method_label, threshold_sentence, thrown_out_sentence
from dockpose.app.web.panels.picture import widen
from dockpose.app.web.panels.result import COLUMNS, candidate_row, known_row, status_html, table_html
from dockpose.app.web.server.uploads import clean_name


@pytest.fixture(scope="module")
def analysis():
    return analyse(open_source(None, None, None))


@pytest.fixture(scope="module")
def empty():
    return analyse(with_method(open_source(None, None, None), "fixed", 255))


def test_row_of_the_likelier_candidate_agrees_with_the_truth(analysis):
    found = [float(cell) for cell in candidate_row(analysis.estimate.candidates[0])[:5]]
    true = [float(cell) for cell in known_row(analysis.view.truth)[:5]]
    assert found == pytest.approx(true, abs=0.3)
    assert len(candidate_row(analysis.estimate.candidates[0])) == len(COLUMNS)


def test_unknown_values_are_a_dash():
    pose = replace(analyse(open_source(None, None, None)).estimate.candidates[0], probability=None, rms_px=None)
    assert candidate_row(pose)[-2:] == ["–", "–"]


def test_table_names_the_chosen_one(analysis, empty):
    table = table_html(analysis)
    assert table.index("A, chosen") < table.index(" B<")
    assert "Truth" in table
    assert "chosen" not in table_html(empty)


def test_status_says_what_was_found_or_not(analysis, empty):
    assert "Dock found" in status_html(analysis)
    assert "No pose" in status_html(empty)
    assert empty.estimate.message in status_html(empty)


def test_outside_text_is_escaped(analysis):
    hostile = "<img src=x onerror=alert(1)>"
    view = replace(analysis.view, source=hostile, note=hostile)
    estimate = replace(analysis.estimate, message=hostile)
    page = status_html(replace(analysis, view=view, estimate=estimate))
    assert "<img" not in page
    assert page.count("&lt;img") == 3


def test_threshold_sentence_names_level_and_groups(analysis):
    assert f"level {analysis.estimate.threshold.level}, which keeps 10 groups" in threshold_sentence(analysis.estimate)


def test_what_was_thrown_out_is_said(analysis):
    assert thrown_out_sentence(analysis.estimate) == "All 10 groups lie on one ellipse."
    masked = with_mask(with_sample(analysis.view, "burnt_in_text"), 0, 0, 30, 30)
    words = thrown_out_sentence(analyse(masked).estimate)
    assert words.startswith("1 mask hides a part of the picture.")
    assert "do not" in words


def test_unknown_method_still_has_a_label():
    assert method_label("hats") == "HATS (adaptive)"
    assert method_label("otsu") == "Otsu"


@pytest.mark.parametrize(
    ("name", "clean"),
    [
        ("tank.png", "tank.png"),
        ("../../etc/passwd", "passwd"),
        ("C:\\pictures\\a.png", "a.png"),
        ("a\x00b\nc\x1b[31m.png", "abc[31m.png"),
        ("", "the file"),
        ("x" * 500, "x" * 80),
    ],
)
def test_names_of_uploads_are_made_harmless(name, clean):
    assert clean_name(name) == clean


def test_reading_without_known_lights_still_has_two_candidates(analysis):
    assert len(analyse(with_lights(analysis.view, 0)).estimate.candidates) == 2


@pytest.mark.parametrize(("height", "width", "shown"), [(480, 640, 640), (90, 160, 160), (1280, 720, 1707), (4, 1, 6)])
def test_tall_pictures_are_widened(height, width, shown):
    picture = np.zeros((height, width, 3), np.uint8)
    wide = widen(picture)
    assert wide.shape == (height, shown, 3)
    assert (wide == 0).sum() == picture.size
