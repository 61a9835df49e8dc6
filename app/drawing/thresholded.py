"""The thresholded picture: which pixels are kept, and which of their groups are the dock's lights."""

from __future__ import annotations

import math
from typing import Any

import cv2
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import overlay
from dockpose.app.drawing.canvas import Canvas
from dockpose.app.drawing.colours import DROPPED_COLOUR, LIGHT_COLOUR, MASK_COLOUR, NOISE_COLOUR, bgr
from dockpose.camera.image import to_grey, to_levels
from dockpose.lights.masks import hidden_pixels
from dockpose.thresholds import LEVELS


def threshold_picture(image: Any, found: Estimate) -> np.ndarray:
    """Draw the pixels that the threshold keeps, and tell their groups apart by colour and by shape.

    Parameters
    ----------
    image : array_like
        The picture that was estimated, 8 or 16 bit, grey or BGR.
    found : Estimate
        What was found in it.

    Returns
    -------
    numpy.ndarray
        (H, W, 3) uint8 BGR on black: lights on the ring are green and circled, rejected groups orange and crossed out,
        groups below the minimum area grey and unmarked; masks are outlined.
    """
    kept = kept_pixels(image, found)
    canvas = Canvas(np.zeros((*kept.shape, 3), dtype=np.uint8))
    canvas.pixels[kept] = bgr(NOISE_COLOUR)
    _draw_groups(canvas, kept, found)
    for x, y, width, height in found.settings.masks:
        corner, opposite = (round(x), round(y)), (round(x + width) - 1, round(y + height) - 1)
        cv2.rectangle(canvas.pixels, corner, opposite, bgr(MASK_COLOUR), canvas.width())
    lights, rejected, small = counts(found)
    canvas.lines(
        (
            (f"o {lights} on the ring", LIGHT_COLOUR),
            (f"x {rejected} thrown out", DROPPED_COLOUR),
            (f". {small} below {found.settings.min_area_px} px", NOISE_COLOUR),
        )
    )
    return canvas.pixels


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


def _draw_groups(canvas: Canvas, kept: np.ndarray, found: Estimate) -> None:
    if found.markers is None:
        return
    on_ring = overlay.on_ring(found)
    # Rejected groups first: where a light's box overlaps another's, the light must stay a light.
    for index in np.argsort(on_ring, kind="stable"):
        left, top, right, bottom = (int(edge) for edge in found.markers.boxes_px[index])
        colour = LIGHT_COLOUR if on_ring[index] else DROPPED_COLOUR
        box = slice(top, bottom + 1), slice(left, right + 1)
        canvas.pixels[box][kept[box]] = bgr(colour)
        centre = (left + right) // 2, (top + bottom) // 2
        radius = math.ceil(max(right - left, bottom - top) / 2 + 5 * canvas.unit) / canvas.unit
        if on_ring[index]:
            canvas.circle(centre, radius, colour)
        else:
            canvas.cross(centre, 2 * radius, colour, tilted=True)
