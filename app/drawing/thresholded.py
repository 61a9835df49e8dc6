"""Which pixels the threshold keeps, and how many of their groups are the dock's lights."""

from typing import Any

import numpy as np
from dockpose import Estimate
from dockpose.camera.image import to_grey, to_levels
from dockpose.lights.masks import hidden_pixels
from dockpose.thresholds import LEVELS


def kept_pixels(image: Any, found: Estimate) -> np.ndarray:
    """Return which pixels (H, W) bool the threshold keeps."""
    levels = to_levels(to_grey(image))[0]
    threshold = found.threshold
    if threshold is None or threshold.level >= LEVELS:
        return np.zeros(levels.shape, dtype=bool)
    if threshold.kept is not None:
        kept = np.zeros(levels.size, dtype=bool)
        kept[threshold.kept[0].index] = True
        return kept.reshape(levels.shape)
    kept = levels >= threshold.level
    if found.settings.masks:
        kept &= ~hidden_pixels(levels.shape, found.settings.masks)
    return kept


def counts(found: Estimate) -> tuple[int, int, int]:
    """Return how many groups are lights on the ring, were rejected, and are below the minimum area."""
    if found.markers is None:
        return 0, 0, 0
    on_ring = found.lights_on_ring or 0
    return on_ring, len(found.markers) - on_ring, found.markers.dropped
