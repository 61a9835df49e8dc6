"""Threshold methods, one function a method, behind one registry."""

from __future__ import annotations

from collections.abc import Callable

from pipeline.thresholds.fixed import fixed
from pipeline.thresholds.hats import hats
from pipeline.thresholds.histogram import LEVELS, Histogram, Peak, Threshold, histogram_of

METHODS: dict[str, Callable[..., Threshold]] = {"hats": hats, "fixed": fixed}

__all__ = ["LEVELS", "METHODS", "Histogram", "Peak", "Threshold", "fixed", "hats", "histogram_of"]
