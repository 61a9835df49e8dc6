"""The drawing of an estimate over its picture: the lights, the ellipse, both poses and the centres."""

import weakref
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from dockpose.camera import mark
from dockpose.camera.image import ImageError, read, to_grey
from dockpose.estimate import geometry
from dockpose.estimate.canvas import Canvas, to_bgr8
from dockpose.estimate.reached import Stages
from dockpose.palette import DROPPED_COLOUR, ELLIPSE_COLOUR, LIGHT_COLOUR, POSE_COLOURS, POSE_NAMES, TEXT_COLOUR
from dockpose.pose.circle import CirclePose
from dockpose.pose.known import KnownPose

PARTS = ("lights", "ellipse", "a", "b")
_LEAST_RADIUS = 6.0  # of a light's circle, in units of the canvas
_SQUARE = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1], [-1, -1]])  # around a light that was set by hand, in radii
_LARGEST_PX = 1200  # of the drawing's longer side: notebooks keep what they show


def picture_of(image: Any, path: Path | None) -> Callable[[], Any]:
    """Return what gives the picture again: from its file, or from the caller's array for as long as that is kept."""
    if path is not None:
        return lambda: read(path)
    try:
        return weakref.ref(image)
    except TypeError:  # of a list
        return lambda: None


def draw(found: Stages) -> np.ndarray:
    """Draw an estimate over its picture, (H, W, 3) BGR, or over black where that is gone."""
    canvas = Canvas(_background(found))
    draw_parts(canvas, found)
    lines = str(found).replace("±", "+-").encode("ascii", "replace").decode().splitlines()
    poses = POSE_COLOURS if found.candidates else ()
    canvas.lines([(line, poses[row - 1] if 0 < row <= len(poses) else TEXT_COLOUR) for row, line in enumerate(lines)])
    scale = min(1.0, _LARGEST_PX / max(found.width, found.height))
    size = max(1, round(scale * found.width)), max(1, round(scale * found.height))
    return cv2.resize(canvas.pixels, size, interpolation=cv2.INTER_AREA)


def draw_parts(canvas: Canvas, found: Stages, parts: Collection[str] = PARTS) -> None:
    """Draw those of ``PARTS``: the ellipse's centre goes with the ellipse, the dock's with the chosen pose."""
    named = zip(POSE_NAMES, found.candidates, POSE_COLOURS, strict=False)
    shown = [(name, pose, colour) for name, pose, colour in named if name.lower() in parts]
    for name, pose, colour in reversed(shown):
        draw_pose(canvas, found, pose, name, colour, width=1.0 if pose is found.selected else 0.5)
    outline, (ellipse, dock) = geometry.outline(found), geometry.centres(found)
    if "ellipse" in parts and outline is not None:
        _draw_line(canvas, found, np.vstack([outline, outline[:1]]), ELLIPSE_COLOUR)
    if "lights" in parts:
        _draw_lights(canvas, found)
    if "ellipse" in parts and ellipse is not None:
        canvas.cross(ellipse, 12, ELLIPSE_COLOUR)
    if dock is not None and any(pose is found.selected for _, pose, _ in shown):
        canvas.circle(dock, 5, TEXT_COLOUR)
        canvas.circle(dock, 1, TEXT_COLOUR, filled=True)


def draw_pose(
    canvas: Canvas, found: Stages, pose: CirclePose | KnownPose, name: str, colour: str, *, width: float
) -> None:
    """Draw the dock's rim, axes and normal as they are by a pose, with its name right of the normal's tip or left."""
    rim, axes, normal = geometry.pose_lines(pose, found)
    for place in geometry.extra_expected(pose, found):
        canvas.cross(place, 8, colour)
    for points in (np.vstack([rim, rim[:1]]), *axes):
        _draw_line(canvas, found, points, colour, width)
    if np.isfinite(normal).all():
        _draw_line(canvas, found, normal, colour, 2 * width)
        canvas.circle(normal[1], 4 * max(1.0, width / 2), colour, filled=width >= 1)
        right = 7 * canvas.unit if name in POSE_NAMES else -7 * canvas.unit - canvas.text_size(name, 0.55)[0]
        canvas.text(name, normal[1] + (right, 5 * canvas.unit), colour, 0.55)


def png(found: Stages) -> bytes:
    """Return the drawing as a PNG file."""
    return mark.to_png(draw(found))


def _draw_line(canvas: Canvas, found: Stages, points: np.ndarray, colour: str, width: float = 1.0) -> None:
    """Draw a line that stops short of the lights, so that they are seen."""
    for piece in geometry.beside_lights(points, found, _LEAST_RADIUS * canvas.unit):
        canvas.polyline(piece, colour, width)


def _draw_lights(canvas: Canvas, found: Stages) -> None:
    if found.markers is None:
        return
    points = found.markers.points_px
    radii = geometry.light_radii(found, _LEAST_RADIUS * canvas.unit) / canvas.unit
    lights = geometry.on_ring(found) | geometry.extra_seen(found)[1]
    for point, radius, is_light in zip(points, radii, lights, strict=True):
        if is_light and found.by_hand is not None:
            canvas.polyline(point + radius * canvas.unit * _SQUARE, LIGHT_COLOUR)
        elif is_light:
            canvas.circle(point, radius, LIGHT_COLOUR)
        else:
            canvas.cross(point, 2 * radius, DROPPED_COLOUR, tilted=True)
    for index, label, outward in geometry.light_labels(found):
        width, height = canvas.text_size(label, 0.45)
        middle = points[index] + outward * (radii[index] + 10) * canvas.unit
        canvas.text(label, (middle[0] - width / 2, middle[1] + height / 2), size=0.45)


def _background(found: Stages) -> np.ndarray:
    """The picture in grey, or black."""
    try:
        image = None if found.picture is None else found.picture()
        if image is not None and np.shape(image)[:2] == (found.height, found.width):
            return to_bgr8(to_grey(image))
    except ImageError:  # the file is gone by now
        pass
    return np.zeros((found.height, found.width, 3), np.uint8)
