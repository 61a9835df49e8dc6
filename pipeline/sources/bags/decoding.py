"""Messages of ROS and Foxglove with their fields, in each encoding in which recorders write them."""

import contextlib
import struct
from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import msgspec
from dockpose.sources.bags.storage import FOXGLOVE, Topic
from dockpose.sources.frames import SourceError

IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
CAMERA_INFO, FFMPEG_PACKET = "sensor_msgs/msg/CameraInfo", "ffmpeg_image_transport_msgs/msg/FFMPEGPacket"
VIDEO = (f"{FOXGLOVE}CompressedVideo", FFMPEG_PACKET)
COMPRESSED_KINDS = (COMPRESSED, f"{FOXGLOVE}CompressedImage")  # of pictures, or of video by what their format says
_RAW, _CALIBRATION = f"{FOXGLOVE}RawImage", f"{FOXGLOVE}CameraCalibration"
# Fields of Foxglove's messages in the order of their numbers in Protocol Buffers.
_NUMBERED = {
    _RAW: "timestamp width height encoding step data frame_id",
    COMPRESSED_KINDS[1]: "timestamp data format frame_id",
    VIDEO[0]: "timestamp frame_id data format",
    _CALIBRATION: "timestamp width height distortion_model D K R P frame_id",
}
_HEAD = "builtin_interfaces/Time timestamp\nstring frame_id\n"
# As ROS has them, which writes no names; what newer versions have at the end is left out.
DEFINITIONS = {
    _RAW: f"{_HEAD}uint32 width\nuint32 height\nstring encoding\nuint32 step\nuint8[] data\n",
    COMPRESSED_KINDS[1]: f"{_HEAD}uint8[] data\nstring format\n",
    VIDEO[0]: f"{_HEAD}uint8[] data\nstring format\n",
    _CALIBRATION: f"{_HEAD}uint32 width\nuint32 height\nstring distortion_model\n"
    "float64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n",
    **dict.fromkeys(("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"), "geometry_msgs/TransformStamped[] transforms\n"),
    FFMPEG_PACKET: "std_msgs/Header header\nint32 width\nint32 height\nstring encoding\nuint64 pts\nuint8 flags\n"
    "bool is_bigendian\nuint8[] data\n",
}
_ENCODINGS = {FFMPEG_PACKET: ("cdr",), **dict.fromkeys(_NUMBERED, ("cdr", "ros1", "protobuf", "json"))}
_OTHERS = ("cdr", "ros1")
PICTURES = (IMAGE, *COMPRESSED_KINDS, _RAW, *VIDEO)
CAMERAS = (CAMERA_INFO, _CALIBRATION)
_MOST_S = 1 << 32  # beyond which ROS has no time either


class _Time(msgspec.Struct):
    sec: int = 0
    nsec: int = 0


class Foxglove(msgspec.Struct):
    """A message of Foxglove's, of whichever type, in Protocol Buffers or JSON."""

    timestamp: _Time = msgspec.field(default_factory=_Time)
    frame_id: str = ""
    data: bytes = b""
    format: str = ""
    encoding: str = ""
    width: int = 0
    height: int = 0
    step: int = 0
    distortion_model: str = ""
    D: tuple[float, ...] = ()
    K: tuple[float, ...] = ()
    P: tuple[float, ...] = ()


def is_read(topic: Topic) -> bool:
    """Whether messages of a topic with pictures or cameras are in an encoding that is read."""
    return topic.encoding in _ENCODINGS.get(topic.kind, _OTHERS)


def fields_of(topic: Topic, data: bytes) -> Any:
    """A message with its fields. Raises SourceError where it is damaged."""
    try:
        if topic.encoding == "json":
            return msgspec.json.decode(data, type=Foxglove)
        if topic.encoding == "protobuf":
            return msgspec.convert(dict(_numbered(topic.kind, data)), Foxglove)
        if topic.kind not in _NUMBERED:
            store = _store(topic.encoding)
            return (store.deserialize_ros1 if topic.encoding == "ros1" else store.deserialize_cdr)(data, topic.kind)
        definition = _store(topic.encoding).get_msgdef(topic.kind)  # read as far as it goes
        if topic.encoding == "ros1":
            return definition.deserialize_ros1(data, 0, definition.cls, _store("ros1"))[0]
        read = {b"\0\0": definition.deserialize_cdr_be, b"\0\1": definition.deserialize_cdr_le}[data[:2]]
        return read(data[4:], 0, definition.cls, _store("cdr"))[0]
    except Exception as error:  # which errors damaged bytes raise is not documented
        raise SourceError(f"the message is damaged ({len(data)} bytes)") from error


def frame_of(message: Any) -> str:
    """The frame of reference that a message names."""
    return getattr(message, "header", message).frame_id


def stamp_ns(topic: Topic, data: bytes) -> int | None:
    """The time stamp in the head of a message, in nanoseconds; None where it cannot be read."""
    try:
        if topic.encoding in ("json", "protobuf"):
            time = fields_of(topic, data).timestamp
            return time.sec * 10**9 + time.nsec if 0 <= time.sec < _MOST_S and 0 <= time.nsec < _MOST_S else None
        if topic.encoding == "ros1":
            seconds, nanoseconds = struct.unpack_from("<II", data, 0 if topic.kind in _NUMBERED else 4)
        else:
            seconds, nanoseconds = struct.unpack_from("<iI" if data[1] & 1 else ">iI", data, 4)
    except (struct.error, IndexError, SourceError):
        return None
    return seconds * 10**9 + nanoseconds


def without_stamp(topic: Topic, data: bytes) -> bytes:
    """What tells whether a camera's message says the same as another, whenever that was."""
    with contextlib.suppress(SourceError):
        if topic.encoding in ("json", "protobuf"):
            return repr(msgspec.structs.replace(fields_of(topic, data), timestamp=_Time())).encode()
    return data[12:]  # behind the stamp and what is before it


@lru_cache(maxsize=2)
def _store(encoding: str) -> Any:
    """What reads messages; it compiles itself for each type of message, which takes longer than many messages."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if encoding == "ros1" else Stores.ROS2_HUMBLE)
    for name, definition in DEFINITIONS.items():
        store.register(get_types_from_msg(definition, name))
    return store


def _numbered(kind: str, data: bytes) -> Iterator[tuple[str, Any]]:
    """The fields of a message in Protocol Buffers, with their names; of what is said twice the last."""
    names, lists = _NUMBERED[kind].split(), dict.fromkeys("DKRP", b"")
    for number, value in _parts(data):
        name = names[number - 1] if 0 < number <= len(names) else ""
        if name in lists:
            lists[name] += value
        elif name == "timestamp":
            times = dict(_parts(value))
            yield name, {"sec": times.get(1, 0), "nsec": times.get(2, 0)}
        elif name:
            yield name, value if name == "data" or isinstance(value, int) else value.decode("utf-8", "replace")
    yield from ((name, struct.unpack(f"<{len(each) // 8}d", each)) for name, each in lists.items())


def _parts(data: bytes) -> Iterator[tuple[int, Any]]:
    """The numbers of a message's fields, each with an integer or bytes; struct.error or IndexError where damaged."""
    at = 0
    while at < len(data):
        key, at = _varint(data, at)
        if key & 7 == 0:
            value, at = _varint(data, at)
            yield key >> 3, value
            continue
        length, at = _varint(data, at) if key & 7 == 2 else ({1: 8, 5: 4}.get(key & 7, len(data) + 1), at)
        if at + length > len(data):
            raise struct.error("a field is longer than its message")
        value = data[at : at + length]
        yield key >> 3, int.from_bytes(value, "little") if key & 7 == 5 else value
        at += length


def _varint(data: bytes, at: int) -> tuple[int, int]:
    value = shift = 0
    while shift < 64:
        byte = data[at]
        value, at, shift = value | (byte & 127) << shift, at + 1, shift + 7
        if byte < 128:
            return value, at
    raise struct.error("a number without end")
