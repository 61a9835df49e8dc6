"""The annotated picture; which pixels a threshold keeps, and the part of a picture around its ring."""

from collections.abc import Collection
from typing import Any

import cv2
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import colours
from dockpose.app.drawing.numbers import chance, length_words, level_words, pose_cells
from dockpose.camera.image import to_grey, to_levels
from dockpose.estimate import geometry
from dockpose.estimate.canvas import Canvas, to_bgr8
from dockpose.estimate.drawing import PARTS, draw_parts, draw_pose
from dockpose.lights.masks import Mask, hidden_pixels
from dockpose.pose.known import KnownPose
from dockpose.thresholds import LEVELS

LAYERS = (*PARTS, "truth", "scale", "text")
DRAWN = tuple(layer for layer in LAYERS if layer != "truth")  # by default, as on the page
_LEAST_HALF_PX = 60.0  # of the part around a ring


def annotate(
    image: Any,
    estimate: Estimate,
    *,
    layers: Collection[str] = DRAWN,
    truth: KnownPose | None = None,
    headline: tuple[str, str] | None = None,
) -> np.ndarray:
    """Draw what was found on a full-size copy of the picture."""
    check_layers(layers)
    canvas = Canvas(to_bgr8(image))
    for mask in estimate.settings.masks:
        _draw_mask(canvas, mask)
    draw_layers(canvas, estimate, layers, truth)
    if "text" in layers:
        canvas.lines([*([headline] if headline else []), *_lines(estimate)])
    return canvas.pixels


def draw_layers(canvas: Canvas, estimate: Estimate, layers: Collection[str], truth: KnownPose | None = None) -> None:
    """Draw all layers but the words."""
    if truth is not None and "truth" in layers:
        draw_pose(canvas, estimate, truth, "truth", colours.TRUTH_COLOUR, width=2.0)
    draw_parts(canvas, estimate, layers)
    if "scale" in layers:
        _draw_scale(canvas, estimate)


def check_layers(layers: Collection[str]) -> None:
    """Raise ValueError for a layer that is not in ``LAYERS``."""
    for layer in layers:
        if layer not in LAYERS:
            raise ValueError(f"layers has {layer!r}; there are {', '.join(LAYERS)}")


def _draw_mask(canvas: Canvas, mask: Mask) -> None:
    """Hatch, outline and name what a mask hides."""
    pixels, unit = canvas.pixels, canvas.unit
    rows, columns = np.nonzero(hidden_pixels(pixels.shape[:2], [mask]))
    if len(rows) == 0:
        return
    striped = (rows + columns) % canvas.width(8) < canvas.width()
    pixels[rows[striped], columns[striped]] = colours.bgr(colours.MASK_COLOUR)
    left, top, right, bottom = (int(edge) for edge in (columns[0], rows[0], columns[-1], rows[-1]))
    cv2.rectangle(pixels, (left, top), (right, bottom), colours.bgr(colours.MASK_COLOUR), canvas.width())
    width, height = canvas.text_size("masked")
    # Below the mask, or above it at the bottom of the picture.
    y = bottom + height + 4 * unit if bottom + height + 6 * unit < len(pixels) else top - 4 * unit
    canvas.text("masked", (max(min(left, pixels.shape[1] - width), 0), max(y, height)), colours.MASK_COLOUR)


def _draw_scale(canvas: Canvas, estimate: Estimate) -> None:
    bar = geometry.scale_bar(estimate)
    if bar is None:
        return
    length_m, length_px = bar
    height, width = canvas.pixels.shape[:2]
    right = np.array([width, height]) - 12 * canvas.unit
    left = right - (length_px, 0)
    canvas.polyline(np.array([left, right]), colours.SHADOW_COLOUR, 4)
    canvas.polyline(np.array([left, right]), colours.TEXT_COLOUR, 2)
    canvas.text(f"{length_words(length_m)} at the dock", left - (0, 6 * canvas.unit))


def _lines(estimate: Estimate) -> list[tuple[str, str]]:
    """Return the lines of the text in the corner, each with its colour; OpenCV's letters are ASCII only."""
    lines: list[tuple[str, str]] = []
    if estimate.threshold is not None:
        method = estimate.threshold.method
        name = method.upper() if method == "hats" else method
        lines.append((f"{name}: {level_words(estimate.threshold)}", colours.TEXT_COLOUR))
    if not estimate.candidates:
        return [*lines, (f"No pose ({estimate.status})", colours.DROPPED_COLOUR)]
    for name, pose, colour in zip(colours.POSE_NAMES, estimate.candidates, colours.POSE_COLOURS, strict=False):
        x, y, z, theta_x, theta_y = pose_cells(pose)
        lines += [
            (f"{name}{chance(pose, ' ')}{', chosen' if pose is estimate.selected else ''}", colour),
            (f" x {x}  y {y}  z {z} cm", colour),
            (f" theta x {theta_x}  y {theta_y} deg", colour),
        ]
    return [*lines, ("+ ellipse centre", colours.ELLIPSE_COLOUR), ("o dock centre", colours.TEXT_COLOUR)]


def around_ring(found: Estimate, around: float) -> tuple[int, int, int, int] | None:
    """Return the region of a picture that shows a ring with a margin, 4 to 3; None where no ring was found."""
    if found.ellipse is None:
        return None
    x, y = found.ellipse.centre_px
    half = max(around * found.ellipse.semi_axes_px[0], _LEAST_HALF_PX)
    left, right = max(0, round(x - half * 4 / 3)), min(found.width, round(x + half * 4 / 3))
    top, bottom = max(0, round(y - half)), min(found.height, round(y + half))
    return (left, top, right, bottom) if left < right and top < bottom else None


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
