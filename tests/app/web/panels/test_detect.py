from unittest.mock import MagicMock

from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import with_mask, with_method
from dockpose.app.state.parameters import put
from dockpose.app.state.view import with_sample
from dockpose.app.web.panels.detect import DetectPanel, threshold_sentence, thrown_out_sentence
from dockpose.thresholds import METHODS

from tests.support.methods import registered


def test_threshold_sentence_names_level_and_groups(analysis):
    assert f"level {analysis.estimate.threshold.level}, which keeps 10 groups" in threshold_sentence(analysis.estimate)


def test_what_was_thrown_out_is_said(analysis):
    assert thrown_out_sentence(analysis.estimate) == "All 10 groups lie on one ellipse."
    masked = with_mask(with_sample(analysis.view, "burnt_in_text"), 0, 0, 30, 30)
    words = thrown_out_sentence(analyse(masked).estimate)
    assert words.startswith("1 mask hides a part of the picture.")
    assert "do not" in words
    small = analyse(put(with_method(analysis.view, "fixed", 150), "min_area_px", 900)).estimate
    assert "groups below 900 px ignored." in thrown_out_sentence(small)


class Controls:
    """Takes any control, and keeps the choices of the dropdown of methods."""

    def __init__(self):
        self.methods: tuple[str, ...] = ()

    def __getattr__(self, name):
        return lambda *arguments, **options: MagicMock()

    def add_dropdown(self, label, options, **more):
        if label == "Threshold by":
            self.methods = options
        return MagicMock()


def test_the_dropdown_has_methods_of_ones_own_by_their_titles_before_the_fixed_level():
    controls = Controls()
    with registered(bright_tenth=("Brightest tenth", lambda grey: 200)):
        DetectPanel(MagicMock(server=MagicMock(gui=controls)))
    assert controls.methods[0] == "HATS (adaptive)"
    assert controls.methods[-2:] == ("Brightest tenth", "Fixed level")
    assert METHODS.title("otsu") == "Otsu"


def test_a_method_that_fails_is_named_where_the_level_would_stand(analysis):
    with registered(broken=("Broken", lambda grey: 1 // 0)):
        found = analyse(with_method(analysis.view, "broken")).estimate
    assert threshold_sentence(found).startswith("Threshold method 'broken' failed: ZeroDivisionError")
