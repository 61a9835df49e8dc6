"""Foxglove's messages with pictures and cameras, in each encoding, and bags of them."""

import base64
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.support import bags
from tests.support.videos_in_bags import field, number

ENCODINGS = ("protobuf", "json", "cdr", "ros1")
# By https://github.com/foxglove/foxglove-sdk: the numbers of the fields, and which have four bytes or are lists.
_FIELDS = {
    "RawImage": {"width": 2, "height": 3, "encoding": 4, "step": 5, "data": 6, "frame_id": 7},
    "CompressedImage": {"data": 2, "format": 3, "frame_id": 4},
    "CompressedVideo": {"frame_id": 2, "data": 3, "format": 4},
    "CameraCalibration": {
        **{"width": 2, "height": 3, "distortion_model": 4, "D": 5, "K": 6, "R": 7, "P": 8, "frame_id": 9}
    },
}
# Their order in ROS, with the name that newer versions have at the end.
_IN_ROS = {
    "RawImage": "uint32 width\nuint32 height\nstring encoding\nuint32 step\nuint8[] data",
    "CompressedImage": "uint8[] data\nstring format",
    "CompressedVideo": "uint8[] data\nstring format",
    "CameraCalibration": "uint32 width\nuint32 height\nstring distortion_model\n"
    "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p",
}
_STORES = {"cdr": get_typestore(Stores.ROS2_HUMBLE), "ros1": get_typestore(Stores.ROS1_NOETIC)}
for _store in _STORES.values():
    for _kind, _definition in _IN_ROS.items():
        _text = f"builtin_interfaces/Time timestamp\nstring frame_id\n{_definition}\nstring message_id\n"
        _store.register(get_types_from_msg(_text, f"foxglove_msgs/msg/{_kind}"))


def encoded(kind: str, encoding: str, stamp_ns: int, values: dict[str, Any]) -> bytes:
    """A message of one of the types, as "RawImage"."""
    seconds, nanoseconds = divmod(stamp_ns, 10**9)
    if encoding == "json":
        plain = {
            key: base64.b64encode(each).decode() if isinstance(each, bytes) else each for key, each in values.items()
        }
        return json.dumps({"timestamp": {"sec": seconds, "nsec": nanoseconds}, **plain}).encode()
    if encoding == "protobuf":
        stamp = b"\x08" + number(seconds) + b"\x10" + number(nanoseconds)
        return field(1, stamp) + b"".join(_part(_FIELDS[kind][key], each) for key, each in values.items())
    store = _STORES[encoding]
    name = f"foxglove_msgs/msg/{kind}"
    stamp = store.types["builtin_interfaces/msg/Time"](sec=seconds, nanosec=nanoseconds)
    fields = {
        key.lower(): np.frombuffer(each, np.uint8)
        if isinstance(each, bytes)
        else np.array(each)
        if isinstance(each, list)
        else each
        for key, each in values.items()
    }
    serialize = store.serialize_ros1 if encoding == "ros1" else store.serialize_cdr
    return bytes(serialize(store.types[name](timestamp=stamp, message_id="0190a5c4", **fields), name))


def _part(key: int, value: Any) -> bytes:
    if isinstance(value, int):
        return number(key << 3 | 5) + struct.pack("<I", value)
    data = struct.pack(f"<{len(value)}d", *value) if isinstance(value, list) else value
    return field(key, data if isinstance(data, bytes) else data.encode())


def raw(picture: np.ndarray, encoding: str) -> dict[str, Any]:
    height, width = picture.shape[:2]
    about = {"width": width, "height": height, "encoding": encoding, "step": picture.strides[0]}
    return {"frame_id": "", **about, "data": picture.tobytes()}


def calibration(K: list[float], size: tuple[int, int], D: tuple[float, ...] = (), frame: str = "") -> dict[str, Any]:
    matrices = {"D": list(D), "K": K, "R": np.eye(3).ravel().tolist(), "P": [*K[:3], 0.0, *K[3:6], 0.0, *K[6:], 0.0]}
    return {"frame_id": frame, "width": size[0], "height": size[1], "distortion_model": "plumb_bob", **matrices}


def write(path: Path, encoding: str, entries: list[tuple[str, str, dict[str, Any]]], prefix: str | None = None) -> Path:
    """A bag of messages, each a topic, a type and its fields, ten a second; ``prefix`` stands before their types."""
    named = {"cdr": "foxglove_msgs/msg/", "ros1": "foxglove_msgs/"}.get(encoding, "foxglove.")
    schema = {"cdr": "ros2msg", "ros1": "ros1msg", "json": "jsonschema"}.get(encoding, encoding)
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        channels: dict[str, int] = {}
        for at, (topic, kind, values) in enumerate(entries):
            if topic not in channels:
                about = writer.register_schema((named if prefix is None else prefix) + kind, schema, b"")
                channels[topic] = writer.register_channel(topic, encoding, about)
            stamp_ns = bags.START_NS + at * bags.PERIOD_NS
            writer.add_message(channels[topic], stamp_ns, encoded(kind, encoding, stamp_ns, values), stamp_ns)
        writer.finish()
    return path
