"""Good inputs to begin from, each small, and arrays and numbers of every kind."""

import contextlib
import functools
import io
import json
import sqlite3
import tempfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import av
import cv2
import msgspec
import numpy as np
from dockpose import Camera, Dock, Entrance, Settings, estimate
from dockpose.app.experiment.session import Session
from dockpose.app.export.data import settings_yaml
from dockpose.app.inputs.pictures import save_dock
from dockpose.app.processing.analysis import analyse
from dockpose.app.state.preferences import Remembered
from dockpose.app.state.tank import Tank, Tanks
from dockpose.app.state.view import open_source
from dockpose.camera.files import FORMATS, save_camera
from dockpose.camera.port import FlatPort
from dockpose.files import to_yaml
from dockpose.sources.bags.decoding import FFMPEG_PACKET
from dockpose.sources.bags.storage import Topic
from dockpose.tracking.tracker import Tracker
from mcap.writer import CompressionType

from tests.pipeline.camera.formats.test_readers import FORMS, as_bytes
from tests.support import bags as ros
from tests.support import foxglove_messages, videos_in_bags
from tests.support.trajectories import FILES

CAMERA, DOCK = Camera(fx=90, fy=90, cx=47.5, cy=35.5, width=96, height=72), Dock(0.30, 8)
SAMPLES = Path(__file__).parents[2] / "sample_images"
_DTYPES = ("u1", "u2", "i1", "i2", "i4", "u4", "i8", "f2", "f4", "f8", "c8", "?", "O", ">u2", "S3", "M8[s]")
_EXTREMES = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    0.3,
    700.0,
    1e-308,
    1e-12,
    1e-6,
    1e6,
    1e9,
    1e16,
    1e150,
    1e308,
    np.inf,
    -np.inf,
    np.nan,
)


@functools.cache
def ring_picture() -> np.ndarray:
    """A small picture (72, 96) of a ring of eight lights."""
    image = np.full((72, 96), 20, np.uint8)
    for angle in 2 * np.pi * np.arange(8) / 8:
        place = int(48 + 25 * np.cos(angle)), int(36 + 20 * np.sin(angle))
        cv2.circle(image, place, 2, 240, -1, cv2.LINE_AA)
    return image


@functools.cache
def pictures() -> list[bytes]:
    """Picture files of each format and depth."""
    grey = ring_picture()
    deep, colour = grey.astype(np.uint16) * 200, cv2.merge([grey, grey // 2, grey])
    alpha = cv2.merge([grey, grey, grey, 255 - grey])
    kinds = [(".png", grey), (".png", deep), (".png", colour), (".png", alpha), (".jpg", grey), (".jpg", colour)]
    kinds += [(".tiff", grey), (".tiff", deep), (".bmp", colour), (".webp", colour), (".pgm", grey), (".ppm", colour)]
    return [cv2.imencode(ending, image)[1].tobytes() for ending, image in kinds]


@functools.cache
def cameras() -> list[bytes]:
    """Camera files of each format."""
    lens = msgspec.structs.replace(CAMERA, distortion=(-0.2, 0.05, 0.001, -0.001, 0.0))
    fisheye = msgspec.structs.replace(CAMERA, distortion=(0.05, 0.01, 0.0, 0.0), fisheye=True)
    port = msgspec.structs.replace(CAMERA, port=FlatPort(0.02, 0.01))
    with tempfile.TemporaryDirectory() as folder:
        path, written = Path(folder) / "c.yaml", []
        for camera in (CAMERA, lens, fisheye, port):
            for kind in FORMATS if camera.port is None else ("dockpose",):
                if kind != "kalibr" or not any(camera.distortion[4:]):
                    save_camera(camera, path, kind)
                    written.append(path.read_bytes())
    return written


@functools.cache
def camera_forms() -> list[bytes]:
    """Camera files of other programs."""
    return [as_bytes(content) for content, _ in FORMS.values()]


@functools.cache
def docks() -> list[bytes]:
    """Dock files."""
    off_axis = Entrance(position_m=(0.1, 0.0, 0.2), normal=(0.0, -1.0, -1.0))
    kinds = (DOCK, Dock(0.5), Dock(0.3, 5, entrance=off_axis), Dock(0.3, angles_deg=(0, 80, 170, 260)))
    with tempfile.TemporaryDirectory() as folder:
        path, written = Path(folder) / "d.yaml", []
        for dock in kinds:
            save_dock(dock, path, CAMERA)
            written.append(path.read_bytes())
    return written


@functools.cache
def scenes() -> list[bytes]:
    """Scene files: the samples, each for a small picture."""
    small = {b"width_px: 640": b"width_px: 96", b"height_px: 480": b"height_px: 72"}
    found = []
    for path in sorted(SAMPLES.glob("*.yaml")):
        data = path.read_bytes()
        for old, new in small.items():
            data = data.replace(old, new)
        found.append(data)
    motion = b"\nmotion: {kind: hover, frames: 3}\n"
    return [*found, found[0] + motion]


@functools.cache
def settings_files() -> list[bytes]:
    """Settings files as the page saves them."""
    saved = settings_yaml(analyse(open_source(None, None, None, Tank()))).encode()
    return [saved, to_yaml({"settings": {"method": "otsu"}}).encode()]


@functools.cache
def own_files() -> list[bytes]:
    """The files in which the page remembers its last state and the tanks."""
    with tempfile.TemporaryDirectory() as folder:
        Tanks(Path(folder)).save(Tank(camera=CAMERA, dock=DOCK), "basin")
        tanks = (Path(folder) / "tanks.yaml").read_bytes()
    return [tanks, to_yaml(msgspec.to_builtins(Remembered(sample="plain"))).encode()]


@functools.cache
def json_lines() -> list[bytes]:
    """Lines of JSON as ``dockpose estimate`` writes them, of pictures and of a sequence."""
    found, tracker = estimate(ring_picture(), CAMERA, DOCK), Tracker(CAMERA, DOCK)
    nothing = estimate(np.zeros((72, 96), np.uint8), CAMERA, DOCK)
    lines = [found.to_dict("a.png", 0, None, "ab"), nothing.to_dict("b.png", 0)]
    tracked = [tracker.see(ring_picture(), 0.1 * number).to_dict("v.mp4", number, 0.1 * number) for number in range(3)]
    return [b"".join(json.dumps(line).encode() + b"\n" for line in each) for each in (lines[:1], lines, tracked)]


@functools.cache
def sessions() -> list[bytes]:
    """The files of a session, apart by a line of dashes."""
    with tempfile.TemporaryDirectory() as folder:
        place = Path(folder) / "s"
        session = Session.create(place)
        row = session.take(ring_picture(), estimate(ring_picture(), CAMERA, DOCK), "a.png")
        session.close()
        line = (place / row.file).with_suffix(".json").read_bytes()
        parts = [(place / "session.yaml").read_bytes(), (place / "results.csv").read_bytes(), line]
    return [b"\n=====\n".join(parts)]


@functools.cache
def videos(kind: str) -> list[bytes]:
    """Short videos of a container, of several codecs."""
    codecs = {"mp4": ("libx264", "mpeg4"), "mkv": ("ffv1", "libx264", "mjpeg")}[kind]
    written = []
    for codec in codecs:
        file = io.BytesIO()
        with av.open(file, "w", format={"mp4": "mp4", "mkv": "matroska"}[kind]) as container:
            stream = cast("av.VideoStream", container.add_stream(codec, rate=10))
            stream.width, stream.height = 96, 72
            stream.pix_fmt = {"ffv1": "gray", "mjpeg": "yuvj420p"}.get(codec, "yuv420p")
            for _ in range(4):
                container.mux(stream.encode(av.VideoFrame.from_ndarray(ring_picture(), format="gray")))
            container.mux(stream.encode(None))
        written.append(file.getvalue())
    return written


@functools.cache
def bags() -> list[bytes]:
    """Bags in MCAP, without and with compression."""
    with tempfile.TemporaryDirectory() as folder:
        path, written = Path(folder) / "b.mcap", []
        for compression in (CompressionType.NONE, CompressionType.ZSTD):
            entries = [
                (ros.TOPIC, ros.IMAGE, stamp, ros.image(ring_picture(), "mono8", stamp_ns=stamp))
                for stamp in range(ros.START_NS, ros.START_NS + 3 * ros.PERIOD_NS, ros.PERIOD_NS)
            ]
            ros.write_mcap(path, entries, compression=compression)
            written.append(path.read_bytes())
        for kind in (videos_in_bags.FOXGLOVE, FFMPEG_PACKET):
            written.append(videos_in_bags.write(path, kind, "h264", videos_in_bags.packets("h264", 4)).read_bytes())
    return written


_KINDS = {
    "RawImage": foxglove_messages.raw(np.zeros((6, 8), np.uint8), "mono8"),
    "CompressedImage": {
        "frame_id": "c",
        "data": cv2.imencode(".png", np.zeros((6, 8), np.uint8))[1].tobytes(),
        "format": "",
    },
    "CameraCalibration": foxglove_messages.calibration([7.0, 0, 3.5, 0, 7, 2.5, 0, 0, 1], (8, 6), (0.1, 0, 0, 0, 0)),
}
TOPICS = tuple(
    Topic("/c", f"foxglove_msgs/msg/{kind}", encoding) for kind in _KINDS for encoding in foxglove_messages.ENCODINGS
)


@functools.cache
def bag_messages() -> list[bytes]:
    """Messages of Foxglove's in each encoding, after a byte that says which of :data:`TOPICS` it is."""
    each = ((kind, encoding) for kind in _KINDS for encoding in foxglove_messages.ENCODINGS)
    return [
        bytes([number]) + foxglove_messages.encoded(kind, encoding, ros.START_NS, _KINDS[kind])
        for number, (kind, encoding) in enumerate(each)
    ]


@functools.cache
def foxglove_bags() -> list[bytes]:
    """Bags of a picture and its camera in each encoding."""
    with tempfile.TemporaryDirectory() as folder:
        return [
            foxglove_messages.write(
                Path(folder) / "b.mcap", encoding, [("/c/image", kind, _KINDS[kind]), camera]
            ).read_bytes()
            for encoding in foxglove_messages.ENCODINGS
            for kind in ("RawImage", "CompressedImage")
            for camera in [("/c/calibration", "CameraCalibration", _KINDS["CameraCalibration"])]
        ]


@functools.cache
def trajectories() -> list[bytes]:
    """Columns, body and text of each form, apart by lines of dashes."""
    return ["\n=====\n".join(one).encode() for one in FILES]


def killed_databases() -> list[bytes]:
    """A database and the log beside it, apart by a line of dashes."""
    with tempfile.TemporaryDirectory() as folder:
        entries = ros.frames([ring_picture()[:6, :8].copy()])
        (path,) = ros.write_rosbag2(Path(folder) / "b", entries).glob("*.db3")
        with contextlib.closing(sqlite3.connect(path)) as connection:
            connection.execute("PRAGMA page_size=512")
            connection.execute("VACUUM")
            connection.execute("PRAGMA journal_mode=wal")
            connection.execute("INSERT INTO messages SELECT id + 1, topic_id, timestamp, data FROM messages")
            connection.commit()
            return [b"\n=====\n".join(Path(f"{path}{end}").read_bytes() for end in ("", "-wal"))]


def random_array(rng: np.random.Generator) -> Any:
    """An array of any dtype, shape, stride and values; most of the kinds that are pictures."""
    if rng.random() < 0.05:
        return rng.choice(np.array(_EXTREMES))
    kind = str(rng.choice(("u1", "u2"))) if rng.random() < 0.8 else str(rng.choice(_DTYPES))
    dims = int(rng.choice((0, 1, 2, 3, 4), p=(0.02, 0.03, 0.6, 0.3, 0.05)))
    shape = [int(rng.choice((0, 1, 2, 3, 17, 72, 96, 150))) for _ in range(dims)]
    if dims >= 2 and rng.random() < 0.8:
        shape[0], shape[1] = 72, 96
    if dims > 3:
        shape[2:] = [int(rng.choice((0, 1, 2, 3))) for _ in shape[2:]]
    if dims == 3:
        shape[2] = int(rng.choice((0, 1, 2, 3, 3, 3, 4, 4, 5)))
    image = _filled(rng, tuple(shape), kind)
    if dims >= 2 and rng.random() < 0.4:
        image = [image[::-1], image[:, ::-1], image[::2, 1:], image.T if dims == 2 else image[..., ::-1]][
            int(rng.integers(4))
        ]
    if rng.random() < 0.1:
        image = np.broadcast_to(image[:1], image.shape) if dims and image.shape[0] else image
    return image


def _filled(rng: np.random.Generator, shape: tuple[int, ...], kind: str) -> np.ndarray:
    if kind in ("O", "S3", "M8[s]"):
        return np.zeros(shape, kind)
    way = rng.random()
    if way < 0.3 and len(shape) >= 2 and shape[:2] == (72, 96):
        ring = ring_picture().astype(float) * (200 if kind.endswith("2") else 1)
        ring = ring + rng.normal(0, rng.choice((0, 3, 30)), ring.shape)
        return np.broadcast_to(ring.reshape(ring.shape + (1,) * (len(shape) - 2)), shape).clip(0, 255).astype(kind)
    if way < 0.5:
        return np.full(shape, rng.choice((0, 1, 127, 254, 255)), kind)
    top = 65536 if kind.endswith("u2") else 256
    values = rng.integers(0, top, shape)
    if way < 0.75:
        values = np.where(rng.random(shape) < rng.choice((0.001, 0.02, 0.5)), values, values // 16)
    array = values.astype(kind)
    if array.dtype.kind == "f" and array.size:
        array.flat[int(rng.integers(array.size))] = rng.choice((np.nan, np.inf, -np.inf))
    return array


def random_settings(rng: np.random.Generator) -> Settings:
    """Settings of any method."""
    method = str(rng.choice(("hats", "hats", "hats_local", "otsu", "kapur", "kittler", "sezan", "li", "yen", "fixed")))
    level = int(rng.integers(0, 256)) if method == "fixed" else None
    masks = ((0.0, 0.0, float(rng.uniform(1, 200)), 20.0),) if rng.random() < 0.2 else ()
    return Settings(method, level, int(rng.integers(1, 5)), str(rng.choice(("grey", "binary"))), masks)


def extreme_numbers(rng: np.random.Generator) -> Iterator[float]:
    """Numbers without end: plausible ones, and now and then one that no one would measure."""
    wildness = rng.choice((0.0, 0.05, 0.3))
    while True:
        if rng.random() < wildness:
            yield float(rng.choice(_EXTREMES))
        else:
            yield float(10 ** rng.uniform(-3, 3))
