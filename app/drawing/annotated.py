"""The annotated picture: lights, ellipse, centres, both poses, and what they mean in words."""

from __future__ import annotations

import math
from collections.abc import Collection
from typing import Any

import cv2
import numpy as np
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.camera.camera import Camera
from dockpose.camera.image import to_levels
from dockpose.estimate import Estimate
from dockpose.lights.masks import Mask, hidden_pixels
from dockpose.pose.circle import CirclePose, rotation_from_angles

# Okabe and Ito's colours, which the colour-blind can tell apart, as BGR.
POSE_COLOURS = ((178, 114, 0), (0, 159, 230))
LIGHT_COLOUR = (115, 158, 0)
ELLIPSE_COLOUR = (167, 121, 204)
DROPPED_COLOUR = (0, 94, 213)
MASK_COLOUR = (233, 180, 86)
TEXT_COLOUR = (255, 255, 255)
_FONT = cv2.FONT_HERSHEY_SIMPLEX
LAYERS = ("lights", "ellipse", "centres", "axes", "normals", "text", "scale")
ON_PAGE = LAYERS[:-1]
_BAR_SHARE = 0.25  # of the picture's width, at most


def annotate(image: Any, estimate: Estimate, *, words: bool = True, layers: Collection[str] = ON_PAGE) -> np.ndarray:
    """Draw what was found on a copy of the picture, at full size.

    Parameters
    ----------
    image : the picture that was estimated, 8 or 16 bit, grey or BGR.
    estimate : what was found in it.
    words : whether to say in a corner what it means; False leaves the layer "text" out.
    layers : which of ``LAYERS`` to draw.

    Returns
    -------
    (H, W, 3) uint8 BGR. Lights on the ring are circled and numbered, other groups crossed out; the ellipse's centre is
    a plus, the dock's centre under the chosen pose a dot in a ring; each pose has an axis along its normal; the scale
    is a bar as long as it would be seen at the dock's distance. Masks are hatched.

    Raises
    ------
    ValueError
        if a layer is unknown.
    """
    check_layers(layers)
    canvas = to_bgr8(image)
    unit = max(1.0, min(canvas.shape[:2]) / 480)
    for mask in estimate.settings.masks:
        _hatch(canvas, mask, unit)
    if "ellipse" in layers and estimate.ellipse is not None:
        outline = in_picture(estimate, estimate.ellipse.points(240))
        _polyline(canvas, outline, ELLIPSE_COLOUR, unit, closed=True)
    if "lights" in layers:
        _markers(canvas, estimate, unit)
    for index in reversed(range(len(estimate.candidates))):
        if "axes" in layers:
            _pose_axes(canvas, estimate.candidates[index], index, estimate, unit)
        if "normals" in layers:
            _pose_normal(canvas, estimate.candidates[index], index, estimate, unit)
    if "centres" in layers:
        _centres(canvas, estimate, unit)
    if "scale" in layers:
        _scale(canvas, estimate, unit)
    if words and "text" in layers:
        _text_block(canvas, _lines(estimate), unit)
    return canvas


def check_layers(layers: Collection[str]) -> None:
    """Raise a ValueError that names a layer which is none of ``LAYERS``."""
    for layer in layers:
        if layer not in LAYERS:
            raise ValueError(f"layers has {layer!r}; there are {', '.join(LAYERS)}")


def scale_bar(estimate: Estimate) -> tuple[float, float] | None:
    """A round length in metres (1, 2 or 5 times a power of ten), and how many pixels long it is at the dock's distance.

    It is at most a quarter of the picture's width; None where there is no pose.
    """
    pose = estimate.selected
    if pose is None:
        return None
    ends = pose.position_m + np.outer([-0.5, 0.5], [estimate.dock.radius, 0, 0])
    left, right = estimate.camera.project(ends)
    per_metre = float(np.linalg.norm(right - left)) / estimate.dock.radius
    if not math.isfinite(per_metre) or per_metre <= 0:
        return None
    longest = _BAR_SHARE * estimate.width / per_metre
    power = 10.0 ** math.floor(math.log10(longest))
    length = max(factor * power for factor in (1, 2, 5) if factor * power <= longest * (1 + 1e-9))
    return length, length * per_metre


def length_words(length_m: float) -> str:
    """A length with its unit: centimetres below a metre."""
    return f"{length_m:g} m" if length_m >= 1 else f"{100 * length_m:g} cm"


def to_bgr8(image: Any) -> np.ndarray:
    """Return a fresh (H, W, 3) uint8 BGR copy of any picture that :func:`dockpose.estimate` takes."""
    array = np.asarray(image)
    if array.dtype == np.uint16:
        array = to_levels(array)[0]
    if array.ndim == 2:
        return cv2.cvtColor(array, cv2.COLOR_GRAY2BGR)
    return array[:, :, :3].copy()


def _hatch(canvas: np.ndarray, mask: Mask, unit: float) -> None:
    """Hatch and outline what a mask hides, and call it masked."""
    rows, columns = np.nonzero(hidden_pixels(canvas.shape[:2], [mask]))
    if len(rows) == 0:
        return
    striped = (rows + columns) % _width(8 * unit) < _width(unit)
    canvas[rows[striped], columns[striped]] = MASK_COLOUR
    left, top, right, bottom = columns[0], rows[0], columns[-1], rows[-1]
    cv2.rectangle(canvas, (int(left), int(top)), (int(right), int(bottom)), MASK_COLOUR, _width(unit))
    scale = 0.42 * unit
    (width, height), _ = cv2.getTextSize("masked", _FONT, scale, _width(unit))
    # Below the mask, or above it where the picture ends.
    y = bottom + height + 4 * unit if bottom + height + 6 * unit < len(canvas) else top - 4 * unit
    x = min(left, canvas.shape[1] - width)
    _text(canvas, "masked", (max(x, 0), max(y, height)), scale, unit, MASK_COLOUR)


def in_picture(estimate: Estimate, points_px: np.ndarray) -> np.ndarray:
    """Where the picture shows points (N, 2) of the undistorted picture.

    Behind a port that depends on how far away they are: they are taken to lie in the chosen pose's plane.
    """
    camera, pose = estimate.camera, estimate.selected
    if camera.port is None or pose is None:
        return camera.distort(points_px)
    rays = camera.pinhole_rays(points_px)
    return camera.project(rays * ((pose.position_m @ pose.normal) / (rays @ pose.normal))[:, None])


def _markers(canvas: np.ndarray, estimate: Estimate, unit: float) -> None:
    if estimate.markers is None:
        return
    on_ring = np.zeros(len(estimate.markers), dtype=bool) if estimate.ring is None else estimate.ring.on_ring
    numbers = estimate.light_numbers()
    centre = estimate.markers.points_px[on_ring].mean(axis=0) if on_ring.any() else None
    for index, (point, area) in enumerate(zip(estimate.markers.points_px, estimate.markers.areas_px, strict=True)):
        radius = min(max(6 * unit, 2 * math.sqrt(area / math.pi)), 24 * unit)
        if not on_ring[index]:
            cv2.drawMarker(canvas, _at(point), DROPPED_COLOUR, cv2.MARKER_TILTED_CROSS, int(2 * radius), _width(unit))
            continue
        cv2.circle(canvas, _at(point), round(radius), LIGHT_COLOUR, _width(unit), cv2.LINE_AA)
        number = numbers[index]
        label = str(index + 1 if number is None else number + 1)
        _label(canvas, label, point, centre, radius, unit)


def _label(
    canvas: np.ndarray, text: str, point: np.ndarray, centre: np.ndarray | None, radius: float, unit: float
) -> None:
    """Write a light's number outside the ring, where it hides nothing."""
    outward = np.array([1.0, 0.0]) if centre is None else point - centre
    outward = outward / max(float(np.linalg.norm(outward)), 1e-9)
    scale = 0.45 * unit
    (width, height), _ = cv2.getTextSize(text, _FONT, scale, _width(unit))
    middle = point + outward * (radius + 10 * unit)
    _text(canvas, text, (middle[0] - width / 2, middle[1] + height / 2), scale, unit)


def _pose_axes(canvas: np.ndarray, pose: CirclePose, index: int, estimate: Estimate, unit: float) -> None:
    """Draw two thin axes in the dock's plane."""
    for ends in axes_of(pose, estimate):
        width = unit if pose is estimate.selected else 0.5 * unit
        _line(canvas, estimate.camera, ends, POSE_COLOURS[index], width)


def _pose_normal(canvas: np.ndarray, pose: CirclePose, index: int, estimate: Estimate, unit: float) -> None:
    colour, chosen = POSE_COLOURS[index], pose is estimate.selected
    width = 2 * unit if chosen else unit
    ends_px = _line(canvas, estimate.camera, normal_of(pose, estimate), colour, width)
    if ends_px is None:
        return
    cv2.circle(canvas, _at(ends_px[1]), _width(4 * unit), colour, -1 if chosen else _width(unit), cv2.LINE_AA)
    _text(canvas, POSE_NAMES[index], (ends_px[1][0] + 7 * unit, ends_px[1][1] + 5 * unit), 0.55 * unit, unit, colour)


def axes_of(pose: CirclePose, estimate: Estimate) -> np.ndarray:
    """Ends (2, 2, 3) in metres of two diameters of the dock."""
    rotation = rotation_from_angles(pose.theta_x_rad, pose.theta_y_rad)
    return np.array([pose.position_m + estimate.dock.radius * np.outer([-1, 1], axis) for axis in rotation.T[:2]])


def normal_of(pose: CirclePose, estimate: Estimate) -> np.ndarray:
    """Ends (2, 3) in metres of the dock's normal, 1.3 radii long."""
    return np.array([pose.position_m, pose.position_m + 1.3 * estimate.dock.radius * pose.normal])


def _scale(canvas: np.ndarray, estimate: Estimate, unit: float) -> None:
    bar = scale_bar(estimate)
    if bar is None:
        return
    length_m, length_px = bar
    x, y = canvas.shape[1] - 12 * unit - length_px, canvas.shape[0] - 12 * unit
    ends = np.array([[x, y], [x + length_px, y]])
    for colour, width in (((0, 0, 0), 4 * unit), (TEXT_COLOUR, 2 * unit)):
        _polyline(canvas, ends, colour, width, closed=False)
    _text(canvas, f"{length_words(length_m)} at the dock", (x, y - 6 * unit), 0.42 * unit, unit)


def _centres(canvas: np.ndarray, estimate: Estimate, unit: float) -> None:
    if estimate.ellipse is not None:
        (centre,) = in_picture(estimate, np.array([estimate.ellipse.centre_px]))
        cv2.drawMarker(canvas, _at(centre), ELLIPSE_COLOUR, cv2.MARKER_CROSS, _width(12 * unit), _width(unit))
    if estimate.selected is not None:
        (centre,) = estimate.camera.project([estimate.selected.position_m])
        cv2.circle(canvas, _at(centre), _width(5 * unit), TEXT_COLOUR, _width(unit), cv2.LINE_AA)
        cv2.circle(canvas, _at(centre), _width(unit), TEXT_COLOUR, -1, cv2.LINE_AA)


def _lines(estimate: Estimate) -> list[tuple[str, tuple[int, int, int]]]:
    """Lines of the block of text, each with its colour."""
    lines: list[tuple[str, tuple[int, int, int]]] = []
    if estimate.threshold is not None:
        level = estimate.threshold.level
        name = estimate.threshold.method.upper() if estimate.threshold.method == "hats" else estimate.threshold.method
        lines.append((f"{name}: level {level}" if level < 256 else f"{name}: no level", TEXT_COLOUR))
    if not estimate.candidates:
        lines.append((f"No pose ({estimate.status})", DROPPED_COLOUR))
        return lines
    for index, pose in enumerate(estimate.candidates):
        x, y, z = 100 * pose.position_m
        tx, ty = math.degrees(pose.theta_x_rad), math.degrees(pose.theta_y_rad)
        chance = "" if pose.probability is None else f" {100 * pose.probability:.0f} %"
        chosen = estimate.choice is not None and index == estimate.choice.selected
        lines.append((f"{POSE_NAMES[index]}{chance}{', chosen' if chosen else ''}", POSE_COLOURS[index]))
        lines.append((f" x {x:.1f}  y {y:.1f}  z {z:.1f} cm", POSE_COLOURS[index]))
        lines.append((f" theta x {tx:.1f}  y {ty:.1f} deg", POSE_COLOURS[index]))
    lines.append(("+ ellipse centre", ELLIPSE_COLOUR))
    lines.append(("o dock centre", TEXT_COLOUR))
    return lines


def _text_block(canvas: np.ndarray, lines: list[tuple[str, tuple[int, int, int]]], unit: float) -> None:
    scale, step, margin = 0.42 * unit, 16 * unit, 8 * unit
    width = max(cv2.getTextSize(text, _FONT, scale, _width(unit))[0][0] for text, _ in lines)
    right, bottom = int(width + 2 * margin), int(step * len(lines) + margin)
    block = canvas[:bottom, :right]
    block[:] = (0.35 * block).astype(np.uint8)
    for row, (text, colour) in enumerate(lines):
        bright = tuple(int(0.55 * channel + 0.45 * 255) for channel in colour)
        _text(canvas, text, (margin, margin / 2 + step * (row + 0.75)), scale, unit, bright)


def _text(
    canvas: np.ndarray, text: str, at: tuple[float, float], scale: float, unit: float, colour: Any = TEXT_COLOUR
) -> None:
    where = (round(float(at[0])), round(float(at[1])))
    cv2.putText(canvas, text, where, _FONT, scale, (0, 0, 0), _width(3 * unit), cv2.LINE_AA)
    cv2.putText(canvas, text, where, _FONT, scale, colour, _width(unit), cv2.LINE_AA)


def _line(canvas: np.ndarray, camera: Camera, ends_m: np.ndarray, colour: Any, unit: float) -> np.ndarray | None:
    """Draw a straight piece in space; nothing where an end is behind the camera. Returns its ends in pixels."""
    ends = camera.project(ends_m)
    if not np.isfinite(ends).all():
        return None
    _polyline(canvas, ends, colour, unit, closed=False)
    return ends


def _polyline(canvas: np.ndarray, points: np.ndarray, colour: Any, unit: float, *, closed: bool) -> None:
    inside = np.clip(points[np.isfinite(points).all(axis=1)], -1e5, 1e5)
    if len(inside) < 2:
        return
    fixed = np.rint(inside * 16).astype(np.int32)[:, None]
    cv2.polylines(canvas, [fixed], closed, colour, _width(unit), cv2.LINE_AA, shift=4)


def _at(point: np.ndarray) -> tuple[int, int]:
    x, y = np.clip(np.nan_to_num(point, nan=-1e5), -1e5, 1e5)
    return round(float(x)), round(float(y))


def _width(value: float) -> int:
    return max(1, round(value))
