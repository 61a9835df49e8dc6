"""A level set by hand (as Park et al. 2009 did)."""

from __future__ import annotations

from pipeline.thresholds.histogram import Histogram, Threshold


def fixed(histogram: Histogram, level: int) -> Threshold:
    """Keep pixels at or above ``level`` (0..255)."""
    return Threshold(
        method="fixed",
        level=level,
        native_level=level * histogram.native_step,
        histogram=histogram.counts,
        reason=f"Level {level} was set by hand.",
    )
