import re
from dataclasses import replace

import numpy as np
import pytest
from dockpose import Track, Tracked
from dockpose.app.processing.analysis import Analysis, TrackedFrame, Trajectory, analyse
from dockpose.app.processing.following import chosen_by_track
from dockpose.app.state.changes import with_method
from dockpose.app.web.html import result_cells, sigma_cells
from dockpose.app.web.panels.detect import details_html
from dockpose.app.web.panels.picture import COLUMNS, place_html, status_html, table_html
from dockpose.app.web.scene.drawing import drawing_of
from dockpose.sources import Frame

from tests.support.poses import with_sigmas


@pytest.fixture(scope="module")
def empty(view):
    return analyse(with_method(view, "fixed", 255))


def test_row_of_the_likelier_candidate_agrees_with_the_truth(analysis):
    found = [float(cell) for cell in result_cells(analysis.estimate.candidates[0])[:5]]
    true = [float(cell) for cell in result_cells(analysis.view.truth)[:5]]
    assert found == pytest.approx(true, abs=0.3)
    assert len(result_cells(analysis.estimate.candidates[0])) == len(COLUMNS)
    pose = replace(analysis.estimate.candidates[0], probability=None, rms_px=None)
    assert result_cells(pose)[-2:] == ["–", "–"]


def test_sigma_of_the_chosen_pose_stands_beneath_it(analysis, empty):
    pose = with_sigmas(analysis.estimate.candidates[0], (0.00123, 0.00004, np.inf))
    cells = [re.sub("<.*?>", "", cell) for cell in sigma_cells(pose)]
    assert cells == ["0.1", "0.004", "–", "0", "0", "", ""]
    assert "± A, one sigma" in table_html(analysis)
    # On hover, where it comes from, the largest part first.
    assert re.search('title="(camera|diameter) 0.3, (camera|diameter) 0.3, picture 0.0', table_html(analysis))
    assert "one sigma" not in table_html(empty)


@pytest.mark.parametrize("owner", ["camera_of", "dock_of"])
def test_no_error_is_given_and_nothing_is_green_where_camera_or_dock_is_assumed(view, owner):
    analysis = analyse(replace(view, **{owner: "guess"}))
    assert "±" in place_html(analyse(view))
    assert not {"±", "one sigma"} & set(re.findall("±|one sigma", place_html(analysis) + table_html(analysis)))
    assert 'data-trust="amber"' in place_html(analysis)
    assert "assumed" in status_html(analysis)


def test_table_names_the_chosen_one_and_the_status_says_what_was_found_or_not(analysis, empty):
    table = table_html(analysis)
    assert table.index("A, chosen") < table.index(" B<")
    assert "Truth" in table
    assert "chosen" not in table_html(empty)
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


@pytest.mark.parametrize("index", [0, 1])
def test_a_pose_of_a_sequence_is_as_likely_everywhere_as_its_frames_together_have_it(analysis, index):
    found, view = analysis.estimate, analysis.view
    track = Track(0.88, 3, predicted=False, lost=False, number=1)
    tracked = Tracked(found, track, index, None, found.candidates[index], found.candidates[index], index)
    frame = TrackedFrame(Frame(view.image, 2, 0.2, "x"), tracked, Trajectory())
    frame.trajectory.note(frame.frame, tracked)
    told = Analysis(view, chosen_by_track(tracked), frame)
    assert "88 % likely" in told.trust.sentence  # what the verdict says
    chosen, other = ("AB"[index], 88), ("BA"[index], 12)
    for name, likely in (chosen, other):
        assert drawing_of(told).labels[name].text == f"{name} {likely} %"
        row = re.findall(rf"[●○]</span> {name}.*?</tr>", table_html(told))[0]
        assert re.findall("<td.*?>(.*?)</td>", row)[5] == f"{likely}.0"
    assert not re.search(r"(100|\b0)\.0<", re.findall(r"likely \(%\).*?</tr>", details_html(told.shown))[0])
