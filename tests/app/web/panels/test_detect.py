import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.detection import with_mask
from dockpose.app.state.view import open_source, with_sample
from dockpose.app.web.panels.detect import method_label, threshold_sentence, thrown_out_sentence


@pytest.fixture(scope="module")
def analysis():
    return analyse(open_source(None, None, None))


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
