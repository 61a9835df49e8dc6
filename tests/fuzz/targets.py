"""What is attacked: each target takes bytes, and may refuse them with a ValueError whose text is one short sentence."""

import functools
import json
import math
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.experiment.record import read_session
from dockpose.app.export.bundle import read_lines
from dockpose.app.export.data import to_csv
from dockpose.app.export.report import sequence_report
from dockpose.app.state.preferences import Memory, with_settings_file
from dockpose.app.state.tank import Tank, Tanks
from dockpose.app.state.view import open_source
from dockpose.camera.files import load_camera
from dockpose.camera.image import decode
from dockpose.camera.port import FlatPort
from dockpose.lights.ellipse import fit_ellipse
from dockpose.pose.solve import find_poses
from dockpose.sidecar import load_dock, read_sidecar
from dockpose.simulate import render
from dockpose.simulate.files import load_sequence
from dockpose.sources import open_frames
from dockpose.sources.bags.decoding import fields_of, frame_of, stamp_ns
from dockpose.sources.bags.messages import camera_in, picture_in
from dockpose.truth import read_trajectory

from tests.fuzz import seeds

_MOST_PIXELS = 300_000  # of a picture that is searched too: larger ones are for the benchmarks
CAMERA, DOCK = Camera(fx=90, fy=90, cx=47.5, cy=35.5, width=96, height=72), Dock(0.30, 8)


class LieError(AssertionError):
    """A result that lies: a number that is not finite, or a text that runs over several lines."""


@dataclass(frozen=True)
class Target:
    """What takes inputs.

    Attributes
    ----------
    take : callable
        Takes the bytes of one input; raises ValueError to refuse it.
    seeds : callable
        Returns good inputs to begin from.
    share : float
        Of all inputs that are drawn.
    """

    take: Callable[[bytes], object]
    seeds: Callable[[], list[bytes]]
    share: float


def check(found: Estimate) -> None:
    """Raise :class:`LieError` unless all numbers of an estimate are finite, and its message is one line."""
    try:
        json.dumps(found.to_dict(), allow_nan=False)
    except ValueError as error:
        raise LieError(f"a number of the result is not finite ({error})") from error
    if "\n" in found.message or len(found.message) > 600:
        raise LieError("the message is no short line")
    if not found.elapsed_ms >= 0:
        raise LieError("elapsed_ms is negative")


def _camera_for(image: np.ndarray) -> Camera:
    height, width = image.shape[:2]
    return Camera(width, width, (width - 1) / 2, (height - 1) / 2, width, height)


def picture(data: bytes) -> None:
    """Decode a picture file, and search it for a dock."""
    image = decode(data, "fuzz")
    if image.shape[0] * image.shape[1] <= _MOST_PIXELS:
        check(estimate(image, _camera_for(image), DOCK))


def _in_file(read: Callable[[Path], object], name: str) -> Callable[[bytes], object]:
    """A target that reads a file with these bytes."""

    @functools.cache
    def path() -> Path:
        folder = tempfile.TemporaryDirectory(prefix="dockpose-fuzz-")
        _FOLDERS.append(folder)
        return Path(folder.name) / name

    def take(data: bytes) -> object:
        path().write_bytes(data)
        return read(path())

    return take


_FOLDERS: list[tempfile.TemporaryDirectory[str]] = []


def _camera(path: Path, size: tuple[int, int] | None = None) -> None:
    camera = load_camera(path, size=size)
    with np.errstate(over="raise", divide="raise", invalid="raise"):
        points = np.array([[0.0, 0.0], [camera.cx, camera.cy], [camera.width - 1.0, camera.height - 1.0]])
        camera.undistort(points)
        camera.rays(points)
        camera.project([[0.1, 0.1, 2.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0]])
    if not all(math.isfinite(angle) for angle in camera.field_of_view_rad):
        raise LieError("the field of view is not finite")
    found = estimate(seeds.ring_picture(), camera, DOCK) if (camera.width, camera.height) == (96, 72) else None
    if found is not None:
        check(found)


def _scene(path: Path) -> None:
    plan = load_sequence(path)
    camera = plan.scene.camera
    if camera.width * camera.height <= 20_000:
        image, _ = render(plan.scene)
        check(estimate(image, camera, plan.scene.dock))


def _settings(data: bytes) -> None:
    with_settings_file(_view(), data, "settings.yaml")


@functools.cache
def _view():
    return open_source(None, None, None, Tank())


def _beside(path: Path) -> None:
    read_sidecar(path.with_suffix(".png"))


def _own_files(path: Path) -> None:
    """What the page reads at its start must never keep it from starting."""
    for name in ("last.yaml", "tanks.yaml"):
        path.with_name(name).write_bytes(path.read_bytes())
    Memory(path.parent).last_view(Tank())
    Tanks(path.parent)


def session(data: bytes) -> None:
    """Read a session's folder: its YAML, its table and one JSON object, in one input apart by a line of dashes."""
    about, _, rest = data.partition(b"\n=====\n")
    table, _, line = rest.partition(b"\n=====\n")
    folder = _session_folder()
    (folder / "session.yaml").write_bytes(about)
    (folder / "results.csv").write_bytes(table)
    record = read_session(folder)
    for row in record.rows:
        path = (folder / row.file).with_suffix(".json")
        if path.parent == folder:
            path.write_bytes(line)
            record.line(row)


@functools.cache
def _session_folder() -> Path:
    _FOLDERS.append(tempfile.TemporaryDirectory(prefix="dockpose-fuzz-"))
    return Path(_FOLDERS[-1].name)


def _lines(path: Path) -> None:
    lines = read_lines(path)
    to_csv(lines)
    if len(path.read_bytes()) % 100 == 0:  # drawing its plots takes a hundred times as long
        sequence_report(path, lines)


def _frames(path: Path) -> None:
    with open_frames(str(path), lambda text: None) as frames:
        for number, frame in enumerate(frames):
            if frame.image.shape[0] * frame.image.shape[1] <= 20_000:
                check(estimate(frame.image, _camera_for(frame.image), DOCK))
            if number >= 5:
                break


def bag_message(data: bytes) -> None:
    """Read a message of Foxglove's, and the picture or the camera in it."""
    topic = seeds.TOPICS[data[0] % len(seeds.TOPICS)] if data else seeds.TOPICS[0]
    stamp_ns(topic, data[1:])
    message = fields_of(topic, data[1:])
    frame_of(message)
    if "Calibration" in topic.kind:
        camera_in(message, (8, 6), lambda note: None)
    else:
        picture_in(message, "fuzz")


def _killed(path: Path) -> None:
    database, _, log = path.read_bytes().partition(b"\n=====\n")
    path.write_bytes(database)
    for end in ("-wal", "-journal"):
        path.with_name(path.name + end).write_bytes(log)
    _frames(path)


def trajectory(data: bytes) -> None:
    """Read a measured trajectory with columns and body, apart by lines of dashes."""
    columns, _, rest = data.partition(b"\n=====\n")
    body, _, text = rest.partition(b"\n=====\n")
    path = _session_folder() / "truth.txt"
    path.write_bytes(text)
    name = body.decode(errors="replace").replace("\0", "")
    found = read_trajectory(f"{path}#{name}" if name else path, columns=columns.decode(errors="replace") or None)
    if not (np.isfinite(found.times_s).all() and (np.diff(found.times_s) > 0).all()):
        raise LieError("the times are not finite, or do not grow")
    if not np.isfinite(found.positions_m).all():
        raise LieError("a place is not finite")
    if found.quaternions_xyzw is not None:
        np.testing.assert_allclose(np.linalg.norm(found.quaternions_xyzw, axis=1), 1, atol=0.03)
    if any("\n" in note or len(note) > 600 for note in found.notes):
        raise LieError("a note is no short line")


def array(data: bytes) -> None:
    """Search an array of any kind, shape, stride and values for a dock."""
    rng = np.random.default_rng(list(data[:16]))
    image = seeds.random_array(rng)
    height, width = (*image.shape, 1, 1)[:2]
    try:
        camera = _camera_for(image) if image.ndim >= 2 and min(height, width) > 0 else CAMERA
    except ValueError:
        camera = CAMERA
    before = image.copy() if image.dtype != object else None
    settings = seeds.random_settings(rng)
    found = estimate(image, camera, Dock(0.3, int(rng.integers(3, 25)) if rng.random() < 0.7 else None), settings)
    check(found)
    if before is not None and not np.array_equal(before, image, equal_nan=image.dtype.kind in "fc"):
        raise LieError("the picture was changed")


def _drawn_camera(rng: np.random.Generator, some: Iterator[float]) -> Camera:
    port = FlatPort(next(some), next(some), 1 + next(some), 1 + next(some)) if rng.random() < 0.3 else None
    distortion = tuple(next(some) / 100 for _ in range(int(rng.choice((0, 0, 4, 5, 8, 12, 14)))))
    width, height = rng.integers(1, 5000, 2).tolist()
    return Camera(next(some), next(some), next(some), next(some), width, height, distortion, port)


def numbers(data: bytes) -> None:
    """Construct cameras, ports and docks of extreme numbers, and look for poses of extreme points."""
    rng = np.random.default_rng(list(data[:16]))
    some = seeds.extreme_numbers(rng)
    camera = CAMERA if rng.random() < 0.5 else _drawn_camera(rng, some)
    dock = Dock(next(some), int(rng.integers(3, 30)))
    angles = dock.light_angles_rad()[: int(rng.integers(3, 30))]
    with np.errstate(all="ignore"):
        points = np.column_stack([np.cos(angles), np.sin(angles)]) * [next(some), next(some)] + [next(some), next(some)]
    if rng.random() < 0.3:
        points[0] = next(some)
    fit_ellipse(points)
    _, choice = find_poses(points, camera, dock)
    for pose in choice.candidates:
        if not np.isfinite([*pose.position_m, *pose.normal, *pose.centre_px]).all():
            raise LieError(f"a pose is not finite: {pose}")


def settings_objects(data: bytes) -> None:
    """Construct settings of extreme numbers."""
    rng = np.random.default_rng(list(data[:16]))
    some = seeds.extreme_numbers(rng)
    masks = tuple((next(some), next(some), next(some), next(some)) for _ in range(int(rng.integers(0, 3))))
    settings = Settings(min_area_px=int(rng.integers(-1, 5)), masks=masks, lost_after_s=next(some))
    check(estimate(seeds.ring_picture(), CAMERA, DOCK, settings))


def _any_bytes() -> list[bytes]:
    return [bytes(range(16))]


TARGETS: dict[str, Target] = {
    "picture": Target(picture, seeds.pictures, 0.06),
    "camera": Target(_in_file(_camera, "camera.yaml"), seeds.cameras, 0.1),
    "camera forms": Target(
        _in_file(functools.partial(_camera, size=(640, 480)), "camera.file"), seeds.camera_forms, 0.1
    ),
    "dock": Target(_in_file(load_dock, "dock.yaml"), seeds.docks, 0.15),
    "scene": Target(_in_file(_scene, "scene.yaml"), seeds.scenes, 0.015),
    "sidecar": Target(_in_file(_beside, "beside.yaml"), seeds.scenes, 0.015),
    "settings": Target(_settings, seeds.settings_files, 0.12),
    "own files": Target(_in_file(_own_files, "given.yaml"), seeds.own_files, 0.001),
    "session": Target(session, seeds.sessions, 0.15),
    "json lines": Target(_in_file(_lines, "lines.jsonl"), seeds.json_lines, 0.15),
    "video": Target(_in_file(_frames, "video.mp4"), functools.partial(seeds.videos, "mp4"), 0.004),
    "matroska": Target(_in_file(_frames, "video.mkv"), functools.partial(seeds.videos, "mkv"), 0.003),
    "bag": Target(_in_file(_frames, "bag.mcap"), seeds.bags, 0.01),
    "bag of foxglove": Target(_in_file(_frames, "bag.mcap"), seeds.foxglove_bags, 0.01),
    "bag message": Target(bag_message, seeds.bag_messages, 0.1),
    "killed database": Target(_in_file(_killed, "bag.db3"), seeds.killed_databases, 0.01),
    "trajectory": Target(trajectory, seeds.trajectories, 0.1),
    "array": Target(array, _any_bytes, 0.02),
    "numbers": Target(numbers, _any_bytes, 0.1),
    "search settings": Target(settings_objects, _any_bytes, 0.02),
}


def in_order(total: int) -> Iterator[tuple[str, int]]:
    """Name of each target, and how many of so many inputs in all are its."""
    for name, target in TARGETS.items():
        yield name, max(1, math.ceil(target.share * total))


cv2.setNumThreads(1)
