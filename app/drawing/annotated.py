"""The annotated picture, and the montage: a tile a threshold method, with the pixels that it keeps and its pose."""

import math
from collections.abc import Collection, Mapping
from typing import Any

import cv2
import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import colours
from dockpose.app.drawing.numbers import chance, count, length_words, level_words, pose_cells
from dockpose.camera.image import to_grey, to_levels
from dockpose.estimate import geometry
from dockpose.estimate.canvas import Canvas, to_bgr8
from dockpose.estimate.drawing import PARTS, draw_parts, draw_pose
from dockpose.lights.masks import Mask, hidden_pixels
from dockpose.pose.known import KnownPose, pose_error
from dockpose.thresholds import LEVELS

LAYERS = (*PARTS, "truth", "scale", "text")
DRAWN = tuple(layer for layer in LAYERS if layer != "truth")  # by default, as on the page


def annotate(
    image: Any,
    estimate: Estimate,
    *,
    words: bool = True,
    layers: Collection[str] = DRAWN,
    truth: KnownPose | None = None,
    headline: tuple[str, str] | None = None,
) -> np.ndarray:
    """Draw what was found on a full-size copy of the picture."""
    check_layers(layers)
    canvas = Canvas(to_bgr8(image))
    for mask in estimate.settings.masks:
        _draw_mask(canvas, mask)
    if truth is not None and "truth" in layers:
        draw_pose(canvas, estimate, truth, "truth", colours.TRUTH_COLOUR, width=2.0)
    draw_parts(canvas, estimate, layers)
    if "scale" in layers:
        _draw_scale(canvas, estimate)
    if words and "text" in layers:
        canvas.lines([*([headline] if headline else []), *_lines(estimate)])
    return canvas.pixels


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


WIDTH_PX = 1600
_GAP_PX, _MARGIN_PX, _STEP_PX, _LINES = 8, 8, 21, 4
_HIGHEST = 1.2  # height of a tile's picture as a share of its width; taller pictures get margins at their sides
_FONT, _SCALE = cv2.FONT_HERSHEY_SIMPLEX, 0.5
_PAPER, _STRIP, _NOTHING = (255, 255, 255), (38, 34, 30), (70, 64, 58)
_WHITE, _GREY = (255, 255, 255), (200, 200, 200)
# Bluish green and vermillion in BGR, lightened to be read on the dark strip; the words say the same.
_RIGHT, _WRONG = (170, 215, 90), (90, 160, 245)

_DIM = 0.45  # what a tile keeps of the picture's brightness, beside the pixels that the method keeps
_ON_TILES = ("lights", "ellipse")
_AROUND, _LEAST_HALF_PX = 1.6, 60.0  # of a ring's radius: what is shown around its middle

Roi = tuple[int, int, int, int]
Line = tuple[str, tuple[int, int, int]]


def montage(
    image: Any, estimates: Mapping[str, Estimate], truth: KnownPose | None = None, roi: Roi | None = None
) -> np.ndarray:
    """Put side by side which pixels every method keeps of one region of a picture, and what it found there."""
    if not estimates:
        raise ValueError("estimates is empty; a montage needs at least one")
    roi = roi or next(filter(None, map(around_ring, estimates.values())), None)
    columns = math.ceil(math.sqrt(len(estimates)))
    rows = math.ceil(len(estimates) / columns)
    width = (WIDTH_PX - (columns + 1) * _GAP_PX) // columns
    tiles = [_tile(image, name, found, truth, width, roi) for name, found in estimates.items()]
    height = len(tiles[0])
    sheet = np.full((rows * (height + _GAP_PX) + _GAP_PX, WIDTH_PX, 3), _PAPER, dtype=np.uint8)
    for index, tile in enumerate(tiles):
        top = _GAP_PX + index // columns * (height + _GAP_PX)
        left = _GAP_PX + index % columns * (width + _GAP_PX)
        sheet[top : top + height, left : left + width] = tile
    return sheet


def caption(name: str, found: Estimate, truth: KnownPose | None = None) -> list[Line]:
    """Return the lines of a tile's strip, each with its colour in BGR."""
    groups = count(0 if found.markers is None else len(found.markers), "group")
    lines: list[Line] = [
        (f"{name}: {level_words(found.threshold)}, {groups}, {found.lights_on_ring or 0} on the ring", _WHITE)
    ]
    pose = found.selected
    if pose is None:
        return [*lines, (f"No pose. {found.message}", _WRONG)]
    _, _, z, theta_x, theta_y = pose_cells(pose)
    lines.append((f"z {z} cm, theta x {theta_x} y {theta_y} deg{chance(pose, ', ')}", _GREY))
    error = pose_error(pose, truth)
    if error is not None:
        verdict = "Agrees with the truth" if error.agrees else "Not the truth"
        lines.append((f"{verdict}: {error}", _RIGHT if error.agrees else _WRONG))
    return lines


def around_ring(found: Estimate, around: float = _AROUND) -> Roi | None:
    """Return the region of a picture that shows a ring with a margin, 4 to 3; None where no ring was found."""
    if found.ellipse is None:
        return None
    x, y = found.ellipse.centre_px
    half = max(around * found.ellipse.semi_axes_px[0], _LEAST_HALF_PX)
    left, right = max(0, round(x - half * 4 / 3)), min(found.width, round(x + half * 4 / 3))
    top, bottom = max(0, round(y - half)), min(found.height, round(y + half))
    return (left, top, right, bottom) if left < right and top < bottom else None


def _tile(image: Any, name: str, found: Estimate, truth: KnownPose | None, width: int, roi: Roi | None) -> np.ndarray:
    shown = (_DIM * to_bgr8(image)).astype(np.uint8)
    shown[kept_pixels(image, found)] = colours.bgr(colours.ORANGE)
    picture = annotate(shown, found, words=False, layers=_ON_TILES)
    if roi is not None:
        left, top, right, bottom = roi
        picture = picture[top:bottom, left:right]
    picture = _fitted(picture, width)
    strip = np.full((_LINES * _STEP_PX + _MARGIN_PX, width, 3), _STRIP, dtype=np.uint8)
    wrapped = [piece for line in caption(name, found, truth) for piece in _wrap(line, width - 2 * _MARGIN_PX)]
    for row, (text, colour) in enumerate(wrapped[:_LINES]):
        at = (_MARGIN_PX, (row + 1) * _STEP_PX)
        cv2.putText(strip, text, at, _FONT, _SCALE, colour, 2 if row == 0 else 1, cv2.LINE_AA)
    return np.vstack([picture, strip])


def _fitted(picture: np.ndarray, width: int) -> np.ndarray:
    """Scale a picture to the width of a tile, or to its greatest height with margins at the sides."""
    height = min(round(width * len(picture) / picture.shape[1]), round(_HIGHEST * width))
    scale = min(width / picture.shape[1], height / len(picture))
    size = (max(1, round(picture.shape[1] * scale)), max(1, round(len(picture) * scale)))
    scaled = cv2.resize(picture, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR)
    tile = np.full((max(1, height, size[1]), width, 3), _NOTHING, dtype=np.uint8)
    left = (width - size[0]) // 2
    tile[: size[1], left : left + size[0]] = scaled
    return tile


def _wrap(line: Line, width: int) -> list[Line]:
    text, colour = line
    pieces = [""]
    for word in text.split():
        longer = f"{pieces[-1]} {word}".strip()
        if pieces[-1] and cv2.getTextSize(longer, _FONT, _SCALE, 1)[0][0] > width:
            pieces.append(word)
        else:
            pieces[-1] = longer
    return [(piece, colour) for piece in pieces]


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
