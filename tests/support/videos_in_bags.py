"""Bags with a packet of video in each message."""

from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
from dockpose.sources.bags.decoding import DEFINITIONS, FFMPEG_PACKET
from mcap.writer import Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from tests.support import bags

STORE = get_typestore(Stores.ROS2_HUMBLE)
for _name, _definition in DEFINITIONS.items():
    STORE.register(get_types_from_msg(_definition, _name))
FOXGLOVE, FOXGLOVE_ROS = "foxglove.CompressedVideo", "foxglove_msgs/msg/CompressedVideo"
GROUP = 12  # frames from one key frame to the next


def packets(codec: str, count: int = 40, pictures: list[np.ndarray] | None = None) -> list[bytes]:
    """Pictures (72, 96), or those whose levels are 20, 25, 30 and so on."""
    pictures = pictures or [np.full((72, 96), 5 * number + 20, np.uint8) for number in range(count)]
    context: Any = av.CodecContext.create({"h264": "libx264", "h265": "libx265"}[codec], "w")
    context.width, context.height, context.pix_fmt = 96, 72, "yuv420p"
    context.framerate, context.time_base, context.gop_size = Fraction(10), Fraction(1, 10), GROUP
    context.options = {"tune": "zerolatency", "x265-params": f"log-level=none:keyint={GROUP}:bframes=0"}
    found = []
    for number, picture in enumerate(pictures):
        frame = av.VideoFrame.from_ndarray(picture, format="gray")
        frame.pts = number
        found += [bytes(packet) for packet in context.encode(frame)]
    return found + [bytes(packet) for packet in context.encode(None)]


def write(path: Path, kind: str, codec: str, data: list[bytes]) -> Path:
    """A bag in which they are ten a second."""
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start()
        encoding = "protobuf" if kind == FOXGLOVE else "cdr"
        channel = writer.register_channel(
            "/camera/video", encoding, writer.register_schema(kind, encoding.replace("cdr", "ros2msg"), b"")
        )
        for number, packet in enumerate(data):
            stamp_ns = bags.START_NS + number * bags.PERIOD_NS
            writer.add_message(channel, stamp_ns, _message(kind, codec, packet, stamp_ns), stamp_ns)
        writer.finish()
    return path


def _message(kind: str, codec: str, packet: bytes, stamp_ns: int) -> bytes:
    head, data = bags.header(STORE, stamp_ns), np.frombuffer(packet, np.uint8)
    if kind == FOXGLOVE:
        stamp = b"\x08" + number(stamp_ns // 10**9) + b"\x10" + number(stamp_ns % 10**9)
        return b"".join(field(*each) for each in ((1, stamp), (2, b"camera"), (3, packet), (4, codec.encode())))
    if kind == FOXGLOVE_ROS:
        message = STORE.types[kind](timestamp=head.stamp, frame_id="camera", data=data, format=codec)
    else:
        name = {"h264": "libx264", "h265": "hevc_nvenc"}[codec]
        about = {"width": 96, "height": 72, "encoding": name, "pts": 7, "flags": 0, "is_bigendian": False}
        message = STORE.types[FFMPEG_PACKET](header=head, **about, data=data)
    return bytes(STORE.serialize_cdr(message, kind))


def field(key: int, data: bytes) -> bytes:
    return number(key << 3 | 2) + number(len(data)) + data


def number(value: int) -> bytes:
    parts = [value >> 7 * at & 127 for at in range(max(1, (value.bit_length() + 6) // 7))]
    return bytes([*(part | 128 for part in parts[:-1]), parts[-1]])
