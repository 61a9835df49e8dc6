"""What is drawn over a picture, as ``foxglove_msgs/msg/ImageAnnotations``, which Foxglove lays over the raw picture."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing.colours import TEXT_COLOUR, rgb
from dockpose.estimate.canvas import Canvas, Point
from dockpose.estimate.drawing import draw_parts

ANNOTATIONS = "foxglove_msgs/msg/ImageAnnotations"
DEFINITION = "annotations.txt"  # of the message, in static/
_STRIP, _LIST = 3, 4  # LINE_STRIP and LINE_LIST of PointsAnnotation
_NOTHING = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}
_GROUND = {**_NOTHING, "a": 0.6}  # behind words
_FONT_PX = 30.0  # height of letters in a unit of the canvas at size 1, as OpenCV's are
_UPRIGHT, _TILTED = (
    np.array(arms) / 2 for arms in (((-1, 0), (1, 0), (0, -1), (0, 1)), ((-1, -1), (1, 1), (-1, 1), (1, -1)))
)
_CENTRE = 0.5  # a pixel's centre by the corner of the first pixel; here it is at integers


def annotations_of(found: Estimate, headline: tuple[str, str], stamp: dict[str, Any]) -> dict[str, Any]:
    """What is drawn on an annotated picture, and the headline (words, colour), as fields of a message."""
    canvas = _Annotations(found.width, found.height, stamp)
    draw_parts(canvas, found)
    canvas.lines([headline])
    return canvas.fields


class _Annotations(Canvas):
    """A canvas that takes down what is drawn on it as fields of a message."""

    def __init__(self, width: int, height: int, stamp: dict[str, Any]) -> None:
        super().__init__(np.broadcast_to(np.uint8(0), (height, width, 3)))  # which takes no memory
        self._stamp = {"timestamp": stamp}
        self.fields: dict[str, Any] = {"circles": [], "points": [], "texts": []}

    def polyline(self, points: np.ndarray, colour: str, width: float = 1.0) -> None:
        self._add_points(_STRIP, points[np.isfinite(points).all(axis=1)], colour, width)

    def cross(self, centre: Point, size: float, colour: str, *, tilted: bool = False) -> None:
        self._add_points(_LIST, centre + size * self.unit * (_TILTED if tilted else _UPRIGHT), colour, 1.0)

    def circle(self, centre: Point, radius: float, colour: str, *, filled: bool = False) -> None:
        size = {"position": _point(centre), "diameter": 2 * float(radius) * self.unit, "thickness": self.unit}
        colours = {"fill_color": _colour(colour) if filled else _NOTHING, "outline_color": _colour(colour)}
        self.fields["circles"].append(self._stamp | size | colours)

    def text(self, text: str, at: Point, colour: str = TEXT_COLOUR, size: float = 0.45) -> None:
        font = {"font_size": _FONT_PX * size * self.unit, "text_color": _colour(colour), "background_color": _GROUND}
        self.fields["texts"].append(self._stamp | {"position": _point(at), "text": text} | font)

    def lines(self, lines: Iterable[tuple[str, str]]) -> None:
        for row, (text, colour) in enumerate(lines, 1):
            self.text(text, (8 * self.unit, 16 * row * self.unit), colour)

    def _add_points(self, kind: int, points: np.ndarray, colour: str, width: float) -> None:
        colours = {"outline_color": _colour(colour), "outline_colors": [], "fill_color": _NOTHING}
        line = {"type": kind, "points": list(map(_point, points)), "thickness": width * self.unit}
        self.fields["points"].append(self._stamp | line | colours)


def _point(point: Point) -> dict[str, float]:
    """A point, far away where it is behind the camera."""
    x, y = np.clip(np.nan_to_num(point, nan=-1e5), -1e5, 1e5).tolist()
    return {"x": x + _CENTRE, "y": y + _CENTRE}


def _colour(colour: str) -> dict[str, float]:
    return dict(zip("rgb", (part / 255 for part in rgb(colour)), strict=True)) | {"a": 1.0}
