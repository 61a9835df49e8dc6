from dataclasses import replace
from unittest.mock import MagicMock

import pytest
from dockpose.app.export.words import advice, status_line, why_this_one
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.changes import MEASURED_LIMITS, with_mask, with_measured, with_method, with_pose_by_hand
from dockpose.app.state.parameters import put
from dockpose.app.state.view import with_sample
from dockpose.app.web.panels import detect
from dockpose.pose.known import KnownPose
from dockpose.thresholds import METHODS

from tests.support.methods import registered


def test_threshold_and_what_was_thrown_out_are_said(analysis):
    words = detect.threshold_sentence(analysis.estimate)
    assert f"level {analysis.estimate.threshold.level}, which keeps 10 groups" in words
    assert detect.thrown_out_sentence(analysis.estimate) == "All 10 groups lie on one ellipse."
    masked = with_mask(with_sample(analysis.view, "burnt_in_text"), 0, 0, 30, 30)
    words = detect.thrown_out_sentence(analyse(masked).estimate)
    assert words.startswith("1 mask hides a part of the picture.")
    assert "do not" in words
    small = analyse(put(with_method(analysis.view, "fixed", 150), "min_area_px", 900)).estimate
    assert "groups below 900 px ignored." in detect.thrown_out_sentence(small)


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
        detect.DetectPanel(MagicMock(server=MagicMock(gui=controls)))
    assert controls.methods[0] == "HATS (adaptive)"
    assert controls.methods[-2:] == ("Brightest tenth", "Fixed level")
    assert METHODS["otsu"].title == "Otsu"


def test_a_method_that_fails_is_named_where_the_level_would_stand(analysis):
    with registered(broken=("Broken", lambda grey: 1 // 0)):
        found = analyse(with_method(analysis.view, "broken")).estimate
    assert detect.threshold_sentence(found).startswith("Threshold method 'broken' failed: ZeroDivisionError")


def test_status_line_is_what_is_always_in_view(analysis):
    line = status_line(replace(analysis.estimate, elapsed_ms=1.26))
    assert line.startswith("10 lights | HATS level ")
    assert line.endswith(" | pose A | 1.3 ms")


def test_status_line_and_advice_where_nothing_is_found(analysis):
    found = analyse(with_method(analysis.view, "fixed", 255)).estimate
    assert status_line(found).startswith("0 lights | Fixed level 255 | ")
    assert advice(found).startswith("Try ")
    assert "Try " not in status_line(found)  # the words above the picture say it
    assert advice(analysis.estimate) == ""
    assert why_this_one(found) == "There is no pose to choose."
    assert "px" in detect.details_html(found) or found.message in detect.details_html(found)


@pytest.mark.parametrize("status", ["no_lights", "too_few_markers", "not_a_ring", "no_ellipse"])
def test_every_status_has_advice(analysis, status):
    assert "Try " in advice(replace(analysis.estimate, status=status))


def test_why_this_one(analysis):
    assert "evenly spaced" in why_this_one(analysis.estimate)
    assert "counts as decided" in why_this_one(analysis.estimate)
    other = analysis.estimate.candidates[1]
    by_hand = analyse(with_pose_by_hand(analysis.view, other)).estimate
    assert "by hand" in why_this_one(by_hand)
    assert "pose B (by hand)" in status_line(by_hand)


def test_details_have_units_and_deviations(analysis):
    details = detect.details_html(analysis.estimate)
    for words in ("z (cm)", "±", "dock centre (px)", "eccentricity", "reprojection error (px)", "A, chosen"):
        assert words in details


def test_errors_against_a_measured_pose(analysis):
    pose = analysis.estimate.selected
    view = with_measured(analysis.view, dict(zip(MEASURED_LIMITS, (0, 0, 100, 0, 0), strict=True)))
    assert view.measured is not None
    cells = detect.error_cells(pose, view.measured)
    assert float(cells[2]) == pytest.approx(100 * (pose.position_m[2] - 1), abs=0.06)
    assert all(cell[0] in "+-" for cell in cells)
    assert "off by" in detect.errors_html(replace(analysis, view=view), "measured")
    assert detect.errors_html(analysis, "measured") == ""
    told = pose.to_dict()
    # Angles that differ by a whole turn are the same.
    known = KnownPose((0, 0, 1), told["theta_x_deg"], told["theta_y_deg"] - 360)
    assert [float(cell) for cell in detect.error_cells(pose, known)[3:]] == [0, 0]
