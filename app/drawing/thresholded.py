"""The threshold's picture: which pixels are kept, and which of their groups are the dock's lights."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.annotated import DROPPED_COLOUR, LIGHT_COLOUR, MASK_COLOUR, TEXT_COLOUR
from dockpose.camera.image import to_grey, to_levels
from dockpose.lights.masks import hidden_pixels
from dockpose.thresholds import LEVELS

NOISE_COLOUR = (150, 150, 150)
_FONT = cv2.FONT_HERSHEY_SIMPLEX


def threshold_picture(image: Any, found: Estimate) -> np.ndarray:
    """Draw the pixels that the threshold keeps, the groups told apart by colour and by shape.

    Parameters
    ----------
    image : the picture that was estimated, 8 or 16 bit, grey or BGR.
    found : what was found in it.

    Returns
    -------
    (H, W, 3) uint8 BGR on black: lights on the ring green in a circle, groups that were thrown out orange under a
    cross, groups below the minimum area grey and unmarked, masks outlined.
    """
    kept = kept_pixels(image, found)
    canvas = np.zeros((*kept.shape, 3), dtype=np.uint8)
    canvas[kept] = NOISE_COLOUR
    unit = max(1.0, min(kept.shape) / 480)
    if found.markers is not None:
        _markers(canvas, kept, found, unit)
    for x, y, width, height in found.settings.masks:
        corner, opposite = (round(x), round(y)), (round(x + width) - 1, round(y + height) - 1)
        cv2.rectangle(canvas, corner, opposite, MASK_COLOUR, max(1, round(unit)))
    _legend(canvas, found, unit)
    return canvas


def kept_pixels(image: Any, found: Estimate) -> np.ndarray:
    """Which pixels (H, W) bool the threshold keeps."""
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
    """How many groups are lights on the ring, how many were thrown out, how many are below the minimum area."""
    if found.markers is None:
        return 0, 0, 0
    on_ring = found.lights_on_ring or 0
    return on_ring, len(found.markers) - on_ring, found.markers.dropped


def _markers(canvas: np.ndarray, kept: np.ndarray, found: Estimate, unit: float) -> None:
    markers, ring = found.markers, found.ring
    assert markers is not None
    on_ring = np.zeros(len(markers), dtype=bool) if ring is None else ring.on_ring
    width = max(1, round(unit))
    # Those thrown out first: where a light's box overlaps another's, the light must stay a light.
    for index in np.argsort(on_ring, kind="stable"):
        left, top, right, bottom = (int(edge) for edge in markers.boxes_px[index])
        colour = LIGHT_COLOUR if on_ring[index] else DROPPED_COLOUR
        box = slice(top, bottom + 1), slice(left, right + 1)
        canvas[box][kept[box]] = colour
        centre = (left + right) // 2, (top + bottom) // 2
        radius = math.ceil(max(right - left, bottom - top) / 2 + 5 * unit)
        if on_ring[index]:
            cv2.circle(canvas, centre, radius, colour, width, cv2.LINE_AA)
        else:
            cv2.drawMarker(canvas, centre, colour, cv2.MARKER_TILTED_CROSS, 2 * radius, width)


def _legend(canvas: np.ndarray, found: Estimate, unit: float) -> None:
    on_ring, thrown_out, small = counts(found)
    lines = (
        (f"o {on_ring} on the ring", LIGHT_COLOUR),
        (f"x {thrown_out} thrown out", DROPPED_COLOUR),
        (f". {small} below {found.settings.min_area_px} px", NOISE_COLOUR),
    )
    for row, (text, colour) in enumerate(lines):
        bright = tuple(int(0.55 * channel + 0.45 * 255) for channel in colour)
        at = (round(8 * unit), round((18 + 17 * row) * unit))
        thick = max(1, round(unit))
        cv2.putText(canvas, text, at, _FONT, 0.45 * unit, (0, 0, 0), 3 * thick, cv2.LINE_AA)
        cv2.putText(canvas, text, at, _FONT, 0.45 * unit, bright if row < 2 else TEXT_COLOUR, thick, cv2.LINE_AA)
