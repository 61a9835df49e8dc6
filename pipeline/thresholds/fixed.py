"""A level set by hand (as Park et al. 2009 did)."""

from __future__ import annotations

from dockpose.thresholds.histogram import Histogram, Threshold, threshold_at


def fixed(histogram: Histogram, level: int) -> Threshold:
    """Keep pixels at or above ``level`` (0..255)."""
    return threshold_at("fixed", histogram, level, f"Level {level} was set by hand.")
