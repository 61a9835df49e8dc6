"""The numbers behind the histogram beneath the picture, which static/histogram.js draws."""

import math
from typing import Any

import numpy as np
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.comparison import histogram_in, thresholds_by
from dockpose.thresholds import LEVELS, Histogram, Threshold

_LEAST_GROUPS = 10


class HistogramNumbers:
    """Makes the numbers; those that only another picture or other masks change are kept meanwhile."""

    def __init__(self) -> None:
        self._known: tuple[Any, ...] = ()
        self._histogram: Histogram | None = None
        self._curve: Threshold | None = None

    def of(self, analysis: Analysis, *, is_playing: bool) -> dict[str, Any] | None:
        """Return the numbers; None where no threshold was reached."""
        threshold, settings = analysis.estimate.threshold, analysis.estimate.settings
        if threshold is None:
            return None
        known = analysis.view.image, settings.masks, settings.min_area_px
        if self._histogram is None or known[0] is not self._known[0] or known[1:] != self._known[1:]:
            self._known, self._histogram = known, histogram_in(analysis.view, analysis.estimate)
            self._curve = None
        if (threshold.groups_at_level >= 0).any():
            self._curve = threshold
        elif self._curve is None and not is_playing:
            self._curve = thresholds_by(self._histogram, settings, ["hats"]).get("hats")
        return histogram_numbers(self._histogram.counts, self._curve)


def histogram_numbers(counts: np.ndarray, curve: Threshold | None) -> dict[str, Any]:
    """Return the pixels of each level, and what ``curve`` says of the groups that each leaves, -1 where unknown."""
    peaks = () if curve is None else curve.peaks
    return {
        "counts": counts.tolist(),
        "groups": [-1] * LEVELS if curve is None else curve.groups_at_level.tolist(),
        "groupsTop": groups_top(curve),
        "peaks": [{"level": peak.level, "groups": peak.groups, "votes": peak.votes} for peak in peaks],
    }


def groups_top(curve: Threshold | None) -> int:
    """Return the end of the axis of groups: twice those at the curve's level, in tens; far more below is noise."""
    at_level = int(curve.groups_at_level[curve.level]) if curve is not None and curve.level < LEVELS else 0
    return max(_LEAST_GROUPS, 10 * math.ceil(2 * at_level / 10))
