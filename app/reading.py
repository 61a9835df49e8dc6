"""One run of the pipeline for the page: what was found in a View, and the picture that shows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.annotate import annotate
from app.state import View
from pipeline import Estimate, estimate


@dataclass(frozen=True, eq=False)
class Reading:
    """A view, what the pipeline found in it, and the annotated picture (H, W, 3) uint8 BGR."""

    view: View
    estimate: Estimate
    annotated: np.ndarray


def read_view(view: View) -> Reading:
    """Run the pipeline on a view."""
    found = estimate(view.image, view.camera, view.dock, view.settings)
    return Reading(view, found, annotate(view.image, found))
