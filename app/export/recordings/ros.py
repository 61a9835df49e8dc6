"""What was found in a frame as ROS 2 messages, also in an MCAP file."""

import contextlib
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, BinaryIO, cast

import numpy as np
from dockpose import Camera, Estimate, Vehicle, __version__
from dockpose.app.errors import UserError, unwritable, writing
from dockpose.app.export.data import to_png
from dockpose.app.export.recordings.annotations import ANNOTATIONS, DEFINITION, annotations_of
from dockpose.app.resources import static_path
from dockpose.app.state.trust import Trust, headline_of, trust_of
from dockpose.camera.files import ros_content
from dockpose.camera.image import as_picture
from dockpose.files import GrowingFile
from dockpose.guidance import entrance_of
from dockpose.pose.circle import CirclePose
from dockpose.pose.uncertainty import UNKNOWN_ANGLE_RAD2, UNKNOWN_LENGTH_M2
from dockpose.sources.bags.decoding import CAMERA_INFO
from dockpose.tracking import Track
from dockpose.vehicle import BodyPose

FRAME_ID, DOCK_FRAME_ID, ENTRANCE_FRAME_ID = "camera_optical_frame", "dock", "dock_entrance"
BODY_FRAME_ID = "base_link"  # x ahead, y left, z up, whatever the vehicle file's frame (REP 103)
_POSE, _TF = "geometry_msgs/msg/PoseWithCovarianceStamped", "tf2_msgs/msg/TFMessage"
_PICTURE, _DIAGNOSTICS = "sensor_msgs/msg/CompressedImage", "diagnostic_msgs/msg/DiagnosticArray"
PICTURES = "/dock/image"  # in files alone
AS_THEY_CAME = (b"\x89PNG", b"\xff\xd8")  # how pictures begin that go into files as they are: PNG and JPEG
# The type of what is on each topic.
TOPICS = {
    "/diagnostics": _DIAGNOSTICS,
    "/dock/pose_a": _POSE,
    "/dock/pose_b": _POSE,
    "/dock/pose": _POSE,
    "/dock/pose_body": _POSE,
    "/detected_dock_pose": "geometry_msgs/msg/PoseStamped",
    "/dock/entrance": _POSE,
    "/tf": _TF,
    PICTURES: _PICTURE,
    "/dock/annotations": ANNOTATIONS,
    "/dock/camera_info": CAMERA_INFO,
}
TOPICS_OF_NODE = {topic: kind for topic, kind in TOPICS.items() if topic != PICTURES}
_LEVELS = {"green": 0, "amber": 1, "red": 2}  # OK, WARN, ERROR of diagnostic_msgs/DiagnosticStatus
ENDING = ".mcap"
# So little is kept back that a frame with its picture is on the disk at once.
_CHUNK_BYTES = 16 * 1024
_PERIOD_S = 0.1  # between frames of which no time is known
_APART_S = 2.0  # between pictures by themselves, so that none is followed from the one before when they are read again
_ROUNDED_NS = 1000  # a time of day in seconds has no more digits
_FIRST_S = 1.0  # stamp of the first frame where the time of day is not known; a stamp of 0 stands for none
_WITHOUT_DAY = "seconds since the first frame, plus 1; the source does not know the time of day"

Message = tuple[str, dict[str, Any]]


@dataclass(frozen=True)
class Seen:
    """A frame and what was found in it."""

    source: str  # name of the source
    frame: int  # number of the frame
    found: Estimate  # with the pose selected that was chosen in the end
    trust: Trust  # how far to trust it
    track: Track | None = None  # state of the track
    picture: bytes | None = None  # the picture that was searched, as a PNG or JPEG file
    clock: str = "time of day"  # what the time stamps are
    vehicle: Vehicle | None = None  # what carries the camera


def messages_of(seen: Seen, time_ns: int, frame_id: str = FRAME_ID) -> list[Message]:
    """Return all messages about a frame, each with its topic, which is one of ``TOPICS``."""
    head = header(time_ns, frame_id)
    drawn = annotations_of(seen.found, headline_of(seen.trust), head["stamp"])
    messages: list[Message] = [("/diagnostics", {"header": head} | _diagnostics(seen)), ("/dock/annotations", drawn)]
    if seen.picture is not None:
        kind = "png" if seen.picture.startswith(AS_THEY_CAME[0]) else "jpeg"
        messages.append((PICTURES, {"header": head, "format": kind, "data": seen.picture}))
    if seen.found.camera.port is None:
        messages.append(("/dock/camera_info", camera_message(seen.found.camera, head)))
    if seen.found.status == "ok":
        for topic, pose in zip(("/dock/pose_a", "/dock/pose_b"), seen.found.candidates, strict=False):
            messages.append((topic, pose_message(pose, head)))
    chosen = seen.found.selected if seen.track is None or not seen.track.predicted else None
    if chosen is None:
        return messages
    message = pose_message(chosen, head)
    messages += [("/dock/pose", message), ("/detected_dock_pose", message | {"pose": message["pose"]["pose"]})]
    return messages + _placed_messages(chosen, seen, head)


def _placed_messages(chosen: CirclePose, seen: Seen, head: dict[str, Any]) -> list[Message]:
    """Where the entrance is, and the dock in the vehicle's frame, with the transforms between all of them."""
    found, messages, in_body = seen.found, [], head | {"frame_id": BODY_FRAME_ID}
    children: list[tuple[dict[str, Any], str, CirclePose | BodyPose]] = [(head, DOCK_FRAME_ID, chosen)]
    entrance = entrance_of(chosen, found.dock, found.camera)
    if entrance is not None:
        messages.append(("/dock/entrance", pose_message(entrance, head)))
        children.append((head, ENTRANCE_FRAME_ID, entrance))
    vehicle = None if seen.vehicle is None else seen.vehicle.in_frame("flu")
    if vehicle is not None:
        messages.append(("/dock/pose_body", pose_message(vehicle.pose(chosen), in_body)))
        children.append((in_body, head["frame_id"], vehicle.camera))
    transforms = []
    for parent, child, pose in children:
        place, turn = _place(pose)
        transform = {"translation": place, "rotation": turn}
        transforms.append({"header": parent, "child_frame_id": child, "transform": transform})
    return [*messages, ("/tf", {"transforms": transforms})]


def pose_message(pose: CirclePose | BodyPose, head: dict[str, Any]) -> dict[str, Any]:
    """Return a pose as fields, without roll, as its rotation is; a roll not seen varies by a full turn."""
    position, rotation = _place(pose)
    placed = {"pose": {"position": position, "orientation": rotation}, "covariance": covariance(pose).ravel().tolist()}
    return {"header": head, "pose": placed}


def _place(pose: CirclePose | BodyPose) -> tuple[dict[str, float], dict[str, float]]:
    """A pose's position and quaternion as fields."""
    turn = zip("xyzw", pose.quaternion_xyzw, strict=True)
    return dict(zip("xyz", pose.position_m.tolist(), strict=True)), dict(turn)


def camera_message(camera: Camera, head: dict[str, Any]) -> dict[str, Any]:
    """Return a camera without port as fields of ``sensor_msgs/CameraInfo``."""
    about = ros_content(camera)
    names = {
        "d": "distortion_coefficients",
        "k": "camera_matrix",
        "r": "rectification_matrix",
        "p": "projection_matrix",
    }
    region = dict.fromkeys(("x_offset", "y_offset", "height", "width"), 0) | {"do_rectify": False}
    return {
        **{"header": head, "height": camera.height, "width": camera.width},
        **{"distortion_model": about["distortion_model"], **{key: about[name]["data"] for key, name in names.items()}},
        **{"binning_x": 0, "binning_y": 0, "roi": region},
    }


def _diagnostics(seen: Seen) -> dict[str, Any]:
    """How a frame was judged: OK, WARN or ERROR as the traffic light says, a sentence, and the numbers."""
    found, track, trust = seen.found, seen.track, seen.trust
    pose = found.selected
    alone, total = (None, None) if pose is None else (pose.sigma_position_m, pose.sigma_total_position_m)
    values: dict[str, Any] = {
        "status": found.status,
        "trust": trust.colour,
        "frame": seen.frame,
        "stamps": seen.clock,
        "pose": None if found.choice is None else "AB"[found.choice.selected],
        "selected_by": None if found.choice is None else found.choice.selected_by,
        "probability": None if pose is None else pose.probability,
        "detection": found.detection,
        "found_by": found.found_by,
        "sigma_z_m": None if alone is None else alone[2],  # of this picture by itself
        "sigma_total_z_m": None if total is None else total[2],  # and with what all pictures share
        "lights_on_ring": found.lights_on_ring,
        "level": None if found.threshold is None else found.threshold.level,
    }
    if track is not None:
        values |= {f"track_{name}": value for name, value in asdict(track).items()}
    texts = [{"key": key, "value": _as_text(value)} for key, value in values.items()]
    return status_of(_LEVELS[trust.colour], f"{found.message} {trust.sentence}", seen.source, texts)


def status_of(level: int, message: str, source: str, values: Sequence[dict[str, str]] = ()) -> dict[str, Any]:
    """The one status of a DiagnosticArray, without its header."""
    status = {"level": level, "name": "dockpose: dock", "message": message}
    return {"status": [status | {"hardware_id": source, "values": list(values)}]}


def _as_text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) and math.isfinite(value) else str(value)


def header(time_ns: int, frame_id: str) -> dict[str, Any]:
    """Return a message's header; ``time_ns`` is in nanoseconds since 1970."""
    return {"stamp": {"sec": time_ns // 10**9, "nanosec": time_ns % 10**9}, "frame_id": frame_id}


def covariance(pose: CirclePose | BodyPose) -> np.ndarray:
    """Return the total covariance (6, 6) in m² and rad²; where it is unknown, that of knowing nothing."""
    found, unknown = pose.covariance_total, [UNKNOWN_LENGTH_M2] * 3 + [UNKNOWN_ANGLE_RAD2] * 3
    return np.diag(unknown) if found is None else found


def write_bag(
    path: str | Path,
    frames: Iterable[tuple[np.ndarray, float | None, Estimate]],
    *,
    source: str = "dockpose",
    tell: Callable[[str], None] = print,
) -> None:
    """Write pictures, their times in seconds or None, and what was found in them as ``estimate --out`` does."""
    with contextlib.closing(PoseFile(Path(path), source, tell)) as file:
        for number, (image, time_s, found) in enumerate(frames):
            file.write(Seen(source, number, found, trust_of(found), picture=to_png(as_picture(image))), time_s, None)


class PoseFile:
    """An MCAP file with the poses of each frame; killed, it leaves what readers without an index read."""

    def __init__(self, path: Path, source: str, tell: Callable[[str], None], *, has_pictures: bool = True) -> None:
        try:
            from mcap.writer import Writer
            from rosbags.typesys import Stores, get_types_from_msg, get_typestore
        except ImportError as error:
            raise UserError(f"--out {path}: needs the packages that write bags: pip install 'dockpose[ros]'") from error
        self._path, self._source, self._tell = path, source, tell
        with writing(path):
            self._file = GrowingFile(path)
        self._store = get_typestore(Stores.ROS2_HUMBLE)
        self._store.register(get_types_from_msg(static_path(DEFINITION).read_text(encoding="utf-8"), ANNOTATIONS))
        # What is called here as a file needs no more than a file's write, tell and flush.
        self._writer = Writer(cast("BinaryIO", self._file), chunk_size=_CHUNK_BYTES)
        with self._writing():
            self._writer.start(profile="ros2", library=f"dockpose {__version__}")
        self._channels: dict[str, int] = {}
        for topic, kind in TOPICS.items() if has_pictures else TOPICS_OF_NODE.items():
            definition = self._store.generate_msgdef(kind, ros_version=2)[0].encode()
            schema = self._writer.register_schema(kind, "ros2msg", definition)
            self._channels[topic] = self._writer.register_channel(topic, "cdr", schema)
        self._is_open = True
        self._begin_ns: int | None = None  # of the clock of the stamps, at the frames' time 0
        self._clock = ""
        self._count = 0

    def write(self, seen: Seen, time_s: float | None, time_unix_s: float | None) -> None:
        """Add a frame."""
        if time_s is None:
            time_s = self._count * (_APART_S if seen.track is None else _PERIOD_S)
        if self._count == 0:
            self._tell_what_is_missing(seen.found.camera)
        time_ns = self._stamp_ns(time_s, time_unix_s)
        with self._writing():
            for topic, fields in messages_of(replace(seen, clock=self._clock), time_ns):
                data = bytes(self._store.serialize_cdr(built(fields), TOPICS[topic]))
                self._writer.add_message(self._channels[topic], time_ns, data, time_ns, self._count)
            self._file.mark()
        self._count += 1

    def close(self) -> None:
        """Finish the file."""
        if self._is_open:
            with self._writing():
                self._writer.finish()
                self._file.close()
            self._is_open = False

    @contextlib.contextmanager
    def _writing(self) -> Iterator[None]:
        """Raise UserError where the file cannot be written, of which the frames until then stay."""
        try:
            yield
        except OSError as error:
            self._is_open = False
            raise unwritable(self._path, error, kept=self._file.cut()) from error

    def _tell_what_is_missing(self, camera: Camera) -> None:
        """Tell what of a camera no message holds, without which other poses are found when the file is read again."""
        missing = "camera, which is behind a flat port" if camera.port is not None else f"tone curve {camera.tone}"
        if camera.port is not None or camera.tone != "linear":
            self._tell(f"{self._path}: ROS has no message for the {missing}: give --camera when it is read again")

    def _stamp_ns(self, time_s: float, time_unix_s: float | None) -> int:
        """Time of a frame by one clock for all of them, in nanoseconds."""
        since_ns = round(1e9 * time_s)
        if self._begin_ns is None:
            self._begin_ns = round(1e9 * (_FIRST_S if time_unix_s is None else time_unix_s)) - since_ns
            self._clock = _WITHOUT_DAY if time_unix_s is None else "time of day"
            if time_unix_s is None:
                self._tell(f"{self._source}: time stamps in {self._path} are {_WITHOUT_DAY}")
            self._writer.add_metadata("dockpose", {"source": self._source, "stamps": self._clock})
        stamp_ns = self._begin_ns + since_ns
        if time_unix_s is None or self._clock == _WITHOUT_DAY or abs(stamp_ns - 1e9 * time_unix_s) < _ROUNDED_NS:
            return stamp_ns
        return round(1e9 * time_unix_s)


def built(value: Any) -> Any:
    """A message of fields as rosbags takes it: with attributes, and numbers in arrays."""
    if isinstance(value, dict):
        return SimpleNamespace(**{name: built(one) for name, one in value.items()})
    if isinstance(value, list):
        return list(map(built, value)) if value and isinstance(value[0], dict) else np.array(value, float)
    return np.frombuffer(value, np.uint8) if isinstance(value, bytes) else value
