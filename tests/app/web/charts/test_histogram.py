import re
from dataclasses import replace

import numpy as np
import pytest
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.view import open_source
from dockpose.app.web.charts.chart import without_gaps
from dockpose.app.web.charts.histogram import groups_top, histogram_data, histogram_top, labelled_peaks, peaks_html
from dockpose.app.web.panels.detect import threshold_sentence
from dockpose.thresholds import Threshold


@pytest.fixture(scope="module")
def analysis():
    return analyse(open_source(None, None, None))


def drawn(threshold):
    levels, *curves, groups = histogram_data(threshold)
    shown = [without_gaps(curve, (0, histogram_top(threshold))) for curve in curves]
    return levels, *shown, without_gaps(groups, (0, groups_top(threshold)))


def test_histogram_marks_the_threshold(analysis):
    threshold = analysis.estimate.threshold
    levels, counts, spike, peaks, groups = drawn(threshold)
    assert len({len(levels), len(counts), len(spike), len(peaks), len(groups)}) == 1
    assert (np.diff(levels) > 0).all()
    assert levels[spike > 0].tolist() == [threshold.level]
    np.testing.assert_allclose(counts[levels == 20], np.log10(1 + threshold.histogram[20]))
    assert counts.max() < histogram_top(threshold)
    assert levels[peaks >= 0].tolist() == sorted(peak.level for peak in threshold.peaks)
    assert groups[levels == threshold.level] == 10
    assert groups[levels == 0] < 0
    assert groups_top(threshold) == 20


def test_histogram_of_a_threshold_that_keeps_nothing(analysis):
    levels, counts, spike, _, _ = drawn(replace(analysis.estimate.threshold, level=256))
    assert levels[spike > 0].tolist() == [256]
    assert np.isfinite(counts).all()
    words = threshold_sentence(replace(analysis.estimate, threshold=replace(analysis.estimate.threshold, level=256)))
    assert "above 255" in words


def test_peaks_are_labelled_with_their_votes():
    """Three heaps of pixels: background 20, a dim light at 100, brighter ones at 180 and 190 that are one label."""
    counts = np.zeros(256, int)
    counts[[20, 100, 180, 190]] = 9000, 40, 40, 40
    groups = np.full(256, -1)
    groups[50:101], groups[101:185], groups[185:191], groups[191:] = 4, 3, 1, 0
    threshold = Threshold("hats", 100, 100, counts, "", groups, floor=50)
    assert [(peak.level, peak.groups) for peak in labelled_peaks(threshold)] == [(180, 3), (100, 4)]
    html = peaks_html(threshold)
    assert re.findall(r'data-peak="(\d+)".*?>(\d+)<', html) == [("180", "3"), ("100", "4")]
    assert f"left: {100 * 180 / 256:.2f}%" in html
    assert "data-peak" not in peaks_html(replace(threshold, level=256))
