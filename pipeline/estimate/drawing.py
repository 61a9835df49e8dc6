"""A plain drawing of an estimate, as notebooks show it: the lights, the ellipse and both poses over the picture."""

from __future__ import annotations

import weakref
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import cv2
import numpy as np
from dockpose import palette
from dockpose.camera.image import ImageError, read, to_grey, to_levels
from dockpose.estimate import geometry

if TYPE_CHECKING:
    from dockpose.estimate.result import Estimate

_POSES = tuple(palette.bgr(colour) for colour in palette.POSE_COLOURS)
_LIGHT, _ELLIPSE = palette.bgr(palette.LIGHT_COLOUR), palette.bgr(palette.ELLIPSE_COLOUR)
_DROPPED, _TEXT = palette.bgr(palette.DROPPED_COLOUR), palette.bgr(palette.TEXT_COLOUR)
_SHIFT = 4  # OpenCV draws to a sixteenth of a pixel
_LARGEST_PX = 1200  # of the drawing's longer side: notebooks keep what they show


def picture_of(image: Any, path: Path | None) -> Callable[[], Any]:
    """Return what gives the picture again: from its file, or from the caller's array for as long as that is kept."""
    if path is not None:
        return lambda: read(path)
    try:
        return weakref.ref(image)
    except TypeError:  # of a list
        return lambda: None


def draw(found: Estimate) -> np.ndarray:
    """Draw an estimate over its picture, (H, W, 3) BGR, or over black where that is gone."""
    scale = min(1.0, _LARGEST_PX / max(found.width, found.height))
    canvas = _Canvas(_background(found, scale), scale)
    if (outline := geometry.outline(found)) is not None:
        canvas.line(outline, _ELLIPSE, 1, is_closed=True)
    for index in reversed(range(len(found.candidates))):
        pose, width = found.candidates[index], 2 if found.candidates[index] is found.selected else 1
        canvas.line(geometry.dock_outline(pose, found), _POSES[index], width, is_closed=True)
        canvas.line(geometry.normal(pose, found), _POSES[index], width)
    if found.markers is not None:
        radii = np.clip(2 * np.sqrt(found.markers.areas_px / np.pi), 6, 24)
        for point, radius, is_light in zip(found.markers.points_px, radii, geometry.on_ring(found), strict=True):
            canvas.mark(point, radius, is_light)
    for number, line in enumerate(str(found).splitlines()):
        canvas.words(line, number, _POSES[number - 1] if 0 < number <= 2 and found.candidates else _TEXT)
    return canvas.pixels


def png(found: Estimate) -> bytes:
    """Return the drawing as a PNG file."""
    return cv2.imencode(".png", draw(found))[1].tobytes()


def _background(found: Estimate, scale: float) -> np.ndarray:
    """The picture in grey, or black, at that scale."""
    levels = np.zeros((found.height, found.width), np.uint8)
    try:
        image = None if found.picture is None else found.picture()
        if image is not None and np.shape(image)[:2] == levels.shape:
            levels = to_levels(to_grey(image))[0]
    except ImageError:  # the file is gone by now
        pass
    size = max(1, round(scale * found.width)), max(1, round(scale * found.height))
    return cv2.cvtColor(cv2.resize(levels, size, interpolation=cv2.INTER_AREA), cv2.COLOR_GRAY2BGR)


class _Canvas:
    """Draws in pixels of the picture, on a drawing of another scale."""

    def __init__(self, pixels: np.ndarray, scale: float) -> None:
        self.pixels, self._scale = pixels, scale

    def line(self, points: np.ndarray, colour: tuple[int, int, int], width: int, *, is_closed: bool = False) -> None:
        """Draw a line through points (N, 2) that all are in front of the camera, and not far outside the picture."""
        placed = self._placed(points)
        if placed is not None:
            cv2.polylines(self.pixels, [placed], is_closed, colour, width, cv2.LINE_AA, _SHIFT)

    def mark(self, point: np.ndarray, radius: float, is_light: bool) -> None:
        """Circle a light, and cross out what is not one."""
        if is_light:
            angles = np.linspace(0, 2 * np.pi, 24, endpoint=False)
            circle = radius / self._scale * np.column_stack([np.cos(angles), np.sin(angles)])
            self.line(point + circle, _LIGHT, 1, is_closed=True)
            return
        reach = radius / self._scale * np.array([[-1, -1], [1, 1]]) / np.sqrt(2)
        for way in ((1, 1), (1, -1)):
            self.line(point + reach * way, _DROPPED, 1)

    def words(self, text: str, number: int, colour: tuple[int, int, int]) -> None:
        """Write a line, the first at the top."""
        ascii_only = text.replace("±", "+-").encode("ascii", "replace").decode()
        for offset, shade in ((1, (0, 0, 0)), (0, colour)):
            place = (6 + offset, 16 + 16 * number + offset)
            cv2.putText(self.pixels, ascii_only, place, cv2.FONT_HERSHEY_SIMPLEX, 0.42, shade, 1, cv2.LINE_AA)

    def _placed(self, points: np.ndarray) -> np.ndarray | None:
        placed = ((np.asarray(points, float) + 0.5) * self._scale - 0.5) * (1 << _SHIFT)
        if not np.isfinite(placed).all() or np.abs(placed).max() > 1 << 20:  # OpenCV has 32 bits for a place
            return None
        return np.rint(placed).astype(np.int32)
