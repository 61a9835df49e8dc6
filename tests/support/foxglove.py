"""The types of Foxglove's messages as its documentation lists their fields, for readers that know none of our files."""

from typing import Any

from rosbags.typesys import get_types_from_msg

_FIELDS = {
    "Color": ("float64 r", "float64 g", "float64 b", "float64 a"),
    "Point2": ("float64 x", "float64 y"),
    "CircleAnnotation": (
        *("builtin_interfaces/Time timestamp", "foxglove_msgs/Point2 position", "float64 diameter"),
        *("float64 thickness", "foxglove_msgs/Color fill_color", "foxglove_msgs/Color outline_color"),
    ),
    "PointsAnnotation": (
        *("builtin_interfaces/Time timestamp", "uint8 POINTS=1", "uint8 LINE_LOOP=2", "uint8 LINE_STRIP=3"),
        *("uint8 LINE_LIST=4", "uint8 type", "foxglove_msgs/Point2[] points", "foxglove_msgs/Color outline_color"),
        *("foxglove_msgs/Color[] outline_colors", "foxglove_msgs/Color fill_color", "float64 thickness"),
    ),
    "TextAnnotation": (
        *("builtin_interfaces/Time timestamp", "foxglove_msgs/Point2 position", "string text", "float64 font_size"),
        *("foxglove_msgs/Color text_color", "foxglove_msgs/Color background_color"),
    ),
    "ImageAnnotations": (
        *("foxglove_msgs/CircleAnnotation[] circles", "foxglove_msgs/PointsAnnotation[] points"),
        "foxglove_msgs/TextAnnotation[] texts",
    ),
}


def register(store: Any) -> Any:
    """Let a store of rosbags know them."""
    for name, fields in _FIELDS.items():
        store.register(get_types_from_msg("\n".join(fields), f"foxglove_msgs/msg/{name}"))
    return store
