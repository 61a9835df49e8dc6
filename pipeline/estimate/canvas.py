"""Drawing on pixels with OpenCV: strokes and letters grow with the picture."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import cv2
import numpy as np
from dockpose.camera.image import to_levels
from dockpose.palette import TEXT_COLOUR, bgr

Point = np.ndarray | tuple[float, float]
_FONT = cv2.FONT_HERSHEY_SIMPLEX
_TEXT_SIZE, _STEP, _MARGIN = 0.42, 16, 8


class Canvas:
    """Draws on a picture in place.

    Points are in pixels; sizes and widths are in units of a 480th of the picture's shorter side, at least a pixel.
    Colours are those of :mod:`dockpose.palette`.
    """

    def __init__(self, pixels: np.ndarray) -> None:
        self.pixels = pixels
        self.unit = max(1.0, min(pixels.shape[:2]) / 480)

    def width(self, units: float = 1.0) -> int:
        """Return the width of a stroke in whole pixels, at least one."""
        return max(1, round(units * self.unit))

    def polyline(self, points: np.ndarray, colour: str, width: float = 1.0) -> None:
        """Draw a line through points (N, 2); those that are not finite are left out."""
        inside = np.clip(points[np.isfinite(points).all(axis=1)], -1e5, 1e5)
        if len(inside) >= 2:
            fixed = np.rint(inside * 16).astype(np.int32)[:, None]
            cv2.polylines(self.pixels, [fixed], False, bgr(colour), self.width(width), cv2.LINE_AA, shift=4)

    def circle(self, centre: Point, radius: float, colour: str, *, filled: bool = False) -> None:
        """Draw a circle."""
        width = -1 if filled else self.width()
        cv2.circle(self.pixels, _at(centre), self.width(radius), bgr(colour), width, cv2.LINE_AA)

    def cross(self, centre: Point, size: float, colour: str, *, tilted: bool = False) -> None:
        """Draw a plus, or an x where ``tilted``."""
        kind = cv2.MARKER_TILTED_CROSS if tilted else cv2.MARKER_CROSS
        cv2.drawMarker(self.pixels, _at(centre), bgr(colour), kind, int(size * self.unit), self.width())

    def text_size(self, text: str, size: float = _TEXT_SIZE) -> tuple[int, int]:
        """Return width and height of a text in pixels."""
        (width, height), _ = cv2.getTextSize(text, _FONT, size * self.unit, self.width())
        return width, height

    def text(self, text: str, at: Point, colour: str = TEXT_COLOUR, size: float = _TEXT_SIZE) -> None:
        """Write a text with a dark outline; ``at`` is its lower left corner."""
        self._text(text, at, bgr(colour), size)

    def lines(self, lines: Iterable[tuple[str, str]]) -> None:
        """Write lines, each with its colour, in the upper left corner on a darkened ground."""
        lines, unit = list(lines), self.unit
        right = int(max(self.text_size(text)[0] for text, _ in lines) + 2 * _MARGIN * unit)
        ground = self.pixels[: int(_STEP * unit * len(lines) + _MARGIN * unit), :right]
        ground[:] = (0.35 * ground).astype(np.uint8)
        for row, (text, colour) in enumerate(lines):
            bright = tuple(int(0.55 * channel + 0.45 * 255) for channel in bgr(colour))
            self._text(text, (_MARGIN * unit, _MARGIN * unit / 2 + _STEP * unit * (row + 0.75)), bright, _TEXT_SIZE)

    def _text(self, text: str, at: Point, colour: Any, size: float) -> None:
        for shade, width in (((0, 0, 0), 3), (colour, 1)):
            cv2.putText(self.pixels, text, _at(at), _FONT, size * self.unit, shade, self.width(width), cv2.LINE_AA)


def to_bgr8(image: Any) -> np.ndarray:
    """Return a new (H, W, 3) uint8 BGR copy of any picture that :func:`dockpose.estimate` takes."""
    array = np.asarray(image)
    if array.dtype == np.uint16:
        array = to_levels(array)[0]
    if array.ndim == 2:
        return cv2.cvtColor(array, cv2.COLOR_GRAY2BGR)
    return array[:, :, :3].copy()


def _at(point: Point) -> tuple[int, int]:
    x, y = np.clip(np.nan_to_num(point, nan=-1e5), -1e5, 1e5)
    return round(float(x)), round(float(y))
