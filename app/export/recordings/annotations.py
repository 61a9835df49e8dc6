"""What is drawn over a picture, as ``foxglove_msgs/msg/ImageAnnotations``, which Foxglove lays over the raw picture."""

from typing import Any

import numpy as np
from dockpose import Estimate
from dockpose.app.drawing import colours
from dockpose.app.drawing.colours import POSE_COLOURS, POSE_NAMES
from dockpose.estimate import geometry

ANNOTATIONS = "foxglove_msgs/msg/ImageAnnotations"
_PARTS = {  # each after those that it is made of
    "Color": "float64 r, float64 g, float64 b, float64 a",
    "Point2": "float64 x, float64 y",
    "CircleAnnotation": "builtin_interfaces/Time timestamp, foxglove_msgs/Point2 position, float64 diameter, "
    "float64 thickness, foxglove_msgs/Color fill_color, foxglove_msgs/Color outline_color",
    "PointsAnnotation": "builtin_interfaces/Time timestamp, uint8 type, foxglove_msgs/Point2[] points, "
    "foxglove_msgs/Color outline_color, foxglove_msgs/Color[] outline_colors, foxglove_msgs/Color fill_color, "
    "float64 thickness",
    "TextAnnotation": "builtin_interfaces/Time timestamp, foxglove_msgs/Point2 position, string text, "
    "float64 font_size, foxglove_msgs/Color text_color, foxglove_msgs/Color background_color",
    "ImageAnnotations": "foxglove_msgs/CircleAnnotation[] circles, foxglove_msgs/PointsAnnotation[] points, "
    "foxglove_msgs/TextAnnotation[] texts",
}
DEFINITIONS = {f"foxglove_msgs/msg/{name}": fields.replace(", ", "\n") for name, fields in _PARTS.items()}
_LINE_STRIP, _LINE_LIST = 3, 4  # of PointsAnnotation
_NOTHING = {"r": 0.0, "g": 0.0, "b": 0.0, "a": 0.0}
_DIM = {**_NOTHING, "a": 0.6}  # behind words
_UNIT_SHARE = 1 / 480  # of the picture's smaller side: what sizes are in
_LEAST_RADIUS, _FONT = 6.0, 14.0  # in these units
_CENTRE = 0.5  # pixel centres are at integers here, and a half beyond them there


def annotations_of(found: Estimate, headline: tuple[str, str], stamp: dict[str, Any]) -> dict[str, Any]:
    """Lights with their numbers, the ellipse, both poses and the headline (words, colour) as fields of a message."""
    unit = _UNIT_SHARE * min(found.width, found.height)
    drawing = _Drawing(found, unit, {"timestamp": stamp})
    drawing.write(headline[0], np.array([0.5 * _FONT, 1.5 * _FONT]) * unit, headline[1])
    for name, pose, colour in reversed(list(zip(POSE_NAMES, found.candidates, POSE_COLOURS, strict=False))):
        rim, axes, normal = geometry.pose_lines(pose, found)
        thickness = 2.0 if pose is found.selected else 1.0
        for points in (np.vstack([rim, rim[:1]]), *axes, normal):
            drawing.line(points, colour, thickness)
        drawing.write(name, normal[1] + 0.5 * _FONT * unit, colour)
    outline, (ellipse, dock) = geometry.outline(found), geometry.centres(found)
    if outline is not None and ellipse is not None:
        drawing.line(np.vstack([outline, outline[:1]]), colours.ELLIPSE_COLOUR)
        drawing.cross(ellipse, colours.ELLIPSE_COLOUR)
    if dock is not None:
        drawing.circle(dock, 5 * unit, colours.TEXT_COLOUR)
    drawing.lights()
    return drawing.message


class _Drawing:
    """A message that grows; what leaves the numbers, as behind the camera, is left out. ``unit`` is in pixels."""

    def __init__(self, found: Estimate, unit: float, stamp: dict[str, Any]) -> None:
        self._found, self._unit, self._stamp = found, unit, stamp
        self.message: dict[str, Any] = {"circles": [], "points": [], "texts": []}

    def lights(self) -> None:
        """A circle around each light, with its number, and a cross at every other group."""
        markers, least = self._found.markers, _LEAST_RADIUS * self._unit
        if markers is None:
            return
        radii = geometry.light_radii(self._found, least)
        for point, radius, is_light in zip(markers.points_px, radii, geometry.on_ring(self._found), strict=True):
            if is_light:
                self.circle(point, radius, colours.LIGHT_COLOUR)
            else:
                self.cross(point, colours.DROPPED_COLOUR)
        for index, label, outward in geometry.light_labels(self._found):
            middle = markers.points_px[index] + outward * (radii[index] + _FONT * self._unit)
            self.write(label, middle + (-0.3 * _FONT * self._unit, 0.3 * _FONT * self._unit), colours.TEXT_COLOUR)

    def line(self, points: np.ndarray, colour: str, thickness: float = 1.0) -> None:
        """A line through points (N, 2) that stops short of the lights."""
        for piece in geometry.beside_lights(points, self._found, _LEAST_RADIUS * self._unit):
            self._add_points(_LINE_STRIP, piece, colour, thickness)

    def cross(self, middle: np.ndarray, colour: str) -> None:
        """Two lines that cross at a point (2,)."""
        arms = 0.7 * _LEAST_RADIUS * self._unit * np.array([[-1, -1], [1, 1], [-1, 1], [1, -1]])
        self._add_points(_LINE_LIST, middle + arms, colour, 1.0)

    def circle(self, middle: np.ndarray, radius_px: float, colour: str) -> None:
        """A circle around a point (2,)."""
        if np.isfinite(middle).all():
            size = {"diameter": 2 * float(radius_px), "thickness": self._unit}
            more = {"position": _point(middle), "fill_color": _NOTHING, "outline_color": _colour(colour)}
            self.message["circles"].append(self._stamp | more | size)

    def write(self, text: str, at: np.ndarray, colour: str) -> None:
        """Words whose lower left corner is at a point (2,)."""
        if np.isfinite(at).all():
            words = {"text": text, "font_size": _FONT * self._unit, "text_color": _colour(colour)}
            self.message["texts"].append(self._stamp | {"position": _point(at), "background_color": _DIM} | words)

    def _add_points(self, kind: int, points: np.ndarray, colour: str, thickness: float) -> None:
        if np.isfinite(points).all():
            more = {"outline_colors": [], "fill_color": _NOTHING, "thickness": thickness * self._unit}
            line = {"type": kind, "points": [_point(point) for point in points], "outline_color": _colour(colour)}
            self.message["points"].append(self._stamp | line | more)


def _point(point: np.ndarray) -> dict[str, float]:
    return {"x": float(point[0]) + _CENTRE, "y": float(point[1]) + _CENTRE}


def _colour(colour: str) -> dict[str, float]:
    red, green, blue = (part / 255 for part in colours.rgb(colour))
    return {"r": red, "g": green, "b": blue, "a": 1.0}
