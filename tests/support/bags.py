"""Bags of ROS 1 and ROS 2, written by the libraries `mcap` and `rosbags` alone."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from dockpose.camera.files import save_camera
from dockpose.simulate import Approach, FilmPlan, film
from mcap.writer import CompressionType, Writer
from rosbags import rosbag1, rosbag2
from rosbags.typesys import Stores, get_typestore

from tests.support.scenes import CAMERA, random_scene

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
CAMERA_INFO, STRING = "sensor_msgs/msg/CameraInfo", "std_msgs/msg/String"
TOPIC = "/camera/image_raw"
START_NS = 1_750_000_000_123_456_789  # a day in June 2025
PERIOD_NS = 100_000_000

# Topic, type, time of recording, and the fields of a message.
Entry = tuple[str, str, int, Any]


def header(store: Any, stamp_ns: int) -> Any:
    types = store.types
    stamp = types["builtin_interfaces/msg/Time"](sec=stamp_ns // 10**9, nanosec=stamp_ns % 10**9)
    first = {"seq": 0} if store is ROS1 else {}
    return types["std_msgs/msg/Header"](**first, stamp=stamp, frame_id="camera")


def image(picture: np.ndarray, encoding: str, *, store: Any = ROS2, stamp_ns: int = START_NS, **changed: Any) -> Any:
    fields = {
        "header": header(store, stamp_ns),
        "height": picture.shape[0],
        "width": picture.shape[1],
        "encoding": encoding,
        "is_bigendian": 0,
        "step": picture.strides[0],
        "data": np.frombuffer(picture.tobytes(), np.uint8),
    }
    return store.types[IMAGE](**(fields | changed))


def compressed(picture: np.ndarray, ending: str, *, store: Any = ROS2, stamp_ns: int = START_NS) -> Any:
    data = np.frombuffer(cv2.imencode(f".{ending}", picture)[1].tobytes(), np.uint8)
    return store.types[COMPRESSED](header=header(store, stamp_ns), format=f"bgr8; {ending} compressed bgr8", data=data)


def camera_info(
    K: Iterable[float],
    size: tuple[int, int],
    *,
    store: Any = ROS2,
    model: str = "plumb_bob",
    D: Iterable[float] = (0.0,) * 5,
    P: Iterable[float] = (0.0,) * 12,
    binning: int = 0,
    roi: tuple[int, int, int, int] = (0, 0, 0, 0),
) -> Any:
    spell = str.upper if store is ROS1 else str
    x, y, width, height = roi
    region = store.types["sensor_msgs/msg/RegionOfInterest"](
        x_offset=x, y_offset=y, height=height, width=width, do_rectify=False
    )
    matrices = {"d": D, "k": K, "r": np.eye(3).ravel(), "p": P}
    return store.types[CAMERA_INFO](
        header=header(store, START_NS),
        height=size[1],
        width=size[0],
        distortion_model=model,
        **{spell(name): np.array(list(values), float) for name, values in matrices.items()},
        binning_x=binning,
        binning_y=binning,
        roi=region,
    )


def text(words: str) -> Any:
    return ROS2.types[STRING](data=words)


def noise(count: int = 12, shape: tuple[int, ...] = (48, 64)) -> list[np.ndarray]:
    """Pictures of noise, which no compression makes small."""
    rng = np.random.default_rng(1)
    return [rng.integers(0, 256, shape, np.uint8) for _ in range(count)]


def frames(
    pictures: Iterable[np.ndarray], encoding: str = "mono8", *, store: Any = ROS2, topic: str = TOPIC
) -> list[Entry]:
    """A message for each picture, ten a second, each recorded 20 ms after it was taken."""
    entries = []
    for number, picture in enumerate(pictures):
        stamp_ns = START_NS + number * PERIOD_NS
        entries.append((topic, IMAGE, stamp_ns + 20_000_000, image(picture, encoding, store=store, stamp_ns=stamp_ns)))
    return entries


def write_mcap(
    path: Path,
    entries: Iterable[Entry],
    *,
    store: Any = ROS2,
    compression: CompressionType = CompressionType.ZSTD,
    **options: Any,
) -> Path:
    is_ros1 = store is ROS1
    with path.open("wb") as file:
        writer = Writer(file, compression=compression, **options)
        writer.start(profile="ros1" if is_ros1 else "ros2")
        channels: dict[str, int] = {}
        for topic, kind, time_ns, message in entries:
            if topic not in channels:
                definition, _ = store.generate_msgdef(kind, ros_version=1 if is_ros1 else 2)
                name = kind.replace("/msg/", "/") if is_ros1 else kind
                schema = writer.register_schema(name, "ros1msg" if is_ros1 else "ros2msg", definition.encode())
                channels[topic] = writer.register_channel(topic, "ros1" if is_ros1 else "cdr", schema)
            data = bytes(store.serialize_ros1(message, kind) if is_ros1 else store.serialize_cdr(message, kind))
            writer.add_message(channels[topic], time_ns, data, time_ns)
        writer.finish()
    return path


def _write_all(writer: Any, entries: Iterable[Entry], store: Any, serialize: Callable[[Any, str], Any]) -> None:
    with writer:
        connections: dict[str, Any] = {}
        for topic, kind, time_ns, message in entries:
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            writer.write(connections[topic], time_ns, serialize(message, kind))


def write_rosbag2(
    folder: Path,
    entries: Iterable[Entry],
    storage: str = "SQLITE3",
    prepare: Callable[[Any], None] = lambda writer: None,
) -> Path:
    writer = rosbag2.Writer(folder, version=8, storage_plugin=getattr(rosbag2.StoragePlugin, storage))
    prepare(writer)
    _write_all(writer, entries, ROS2, ROS2.serialize_cdr)
    return folder


def write_rosbag1(
    path: Path, entries: Iterable[Entry], compression: str | None = None, chunk_bytes: int = 1 << 20
) -> Path:
    writer = rosbag1.Writer(path)
    writer.chunk_threshold = chunk_bytes
    if compression is not None:
        writer.set_compression(getattr(rosbag1.Writer.CompressionFormat, compression))
    _write_all(writer, entries, ROS1, ROS1.serialize_ros1)
    return path


def write_approach(folder: Path, count: int, dark: Iterable[int]) -> list[str]:
    """Write run.mcap of an approach, some frames of it dark, and camera.yaml; returns the options that name these."""
    plan = FilmPlan(scene=random_scene(3), motion=Approach(start_m=1.6, end_m=1.2, frames=count, rate_hz=10.0))
    shown = [frame.image for frame in film(plan)]
    for index in dark:
        shown[index] = np.full_like(shown[index], 10)
    write_mcap(folder / "run.mcap", frames(shown))
    save_camera(CAMERA, folder / "camera.yaml")
    return ["--camera", str(folder / "camera.yaml"), "--dock-diameter", "0.30", "--lights", "10"]
