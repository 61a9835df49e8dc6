from dataclasses import replace

import numpy as np
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.detection import with_mask, with_method
from dockpose.app.web.charts.histogram import HistogramNumbers, groups_top, histogram_numbers
from dockpose.app.web.panels.detect import threshold_sentence
from dockpose.thresholds import Threshold


def numbers_of(analysis):
    numbers = HistogramNumbers().of(analysis, is_playing=False)
    assert numbers is not None
    return numbers


def test_numbers_are_those_of_the_threshold(analysis):
    threshold, numbers = analysis.estimate.threshold, numbers_of(analysis)
    assert numbers["counts"] == np.bincount(analysis.view.image.ravel(), minlength=256).tolist()
    assert len(numbers["counts"]) == len(numbers["groups"]) == 256
    assert numbers["groups"][threshold.level] == 10
    assert numbers["groups"][0] == -1
    assert numbers["groupsTop"] == 20
    assert sorted(peak["level"] for peak in numbers["peaks"]) == sorted(peak.level for peak in threshold.peaks)


def test_threshold_that_keeps_nothing(analysis):
    threshold = replace(analysis.estimate.threshold, level=256)
    numbers = histogram_numbers(threshold.histogram, threshold)
    assert (numbers["peaks"], numbers["groupsTop"]) == ([], 10)
    assert "above 255" in threshold_sentence(replace(analysis.estimate, threshold=threshold))


def test_peaks_with_what_they_vote_for():
    """Three heaps of pixels: background 20, a dim light at 100, brighter ones at 180 and 190."""
    counts = np.zeros(256, int)
    counts[[20, 100, 180, 190]] = 9000, 40, 40, 40
    groups = np.full(256, -1)
    groups[50:101], groups[101:185], groups[185:191], groups[191:] = 4, 3, 1, 0
    threshold = Threshold("hats", 100, 100, counts, "", groups, floor=50)
    votes = {peak["level"]: peak["groups"] for peak in histogram_numbers(counts, threshold)["peaks"]}
    assert votes == {190: 1, 180: 3, 100: 4}
    assert groups_top(threshold) == 10


def test_level_set_by_hand_keeps_the_curve(analysis):
    by_hand = [analyse(with_method(analysis.view, "fixed", level)) for level in (40, 150)]
    numbers, before = HistogramNumbers(), numbers_of(analysis)
    for level, one in zip((40, 150), by_hand, strict=True):
        now = numbers.of(one, is_playing=False) or {}
        assert one.view.settings.level == level
        for part in ("groups", "groupsTop", "peaks"):
            assert now[part] == before[part]
    masked = analyse(with_mask(by_hand[0].view, 0, 0, 320, 480))
    assert numbers_of(masked)["groups"] != before["groups"]


def test_while_playing_no_curve_is_computed_for_a_level_set_by_hand(analysis):
    by_hand = analyse(with_method(analysis.view, "fixed", 150))
    assert set((HistogramNumbers().of(by_hand, is_playing=True) or {})["groups"]) == {-1}


def test_nothing_is_computed_where_all_is_masked(analysis):
    masked = analyse(with_method(with_mask(analysis.view, 0, 0, 640, 480), "fixed", 150))
    assert HistogramNumbers().of(masked, is_playing=False) is None
