"""What was found in a frame as the fields of ROS 2 messages, and a pose in YAML that ``ros2 topic pub`` takes."""

import math
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
import yaml
from dockpose import Estimate, Vehicle
from dockpose.app.state.trust import Trust
from dockpose.guidance import entrance_of
from dockpose.pose.circle import UNKNOWN_ANGLE_RAD2, UNKNOWN_LENGTH_M2, CirclePose
from dockpose.tracking import Track
from dockpose.vehicle import BodyPose

FRAME_ID, DOCK_FRAME_ID, ENTRANCE_FRAME_ID = "camera_optical_frame", "dock", "dock_entrance"
BODY_FRAME_ID = "base_link"  # x ahead, y left, z up, whatever the vehicle file's frame (REP 103)
_POSE, _TF = "geometry_msgs/msg/PoseWithCovarianceStamped", "tf2_msgs/msg/TFMessage"
_PICTURE, _DIAGNOSTICS = "sensor_msgs/msg/CompressedImage", "diagnostic_msgs/msg/DiagnosticArray"
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
    "/dock/image/compressed": _PICTURE,
}
_LEVELS = {"green": 0, "amber": 1, "red": 2}  # OK, WARN, ERROR of diagnostic_msgs/DiagnosticStatus
_JPEG_QUALITY = 90

Message = tuple[str, dict[str, Any]]


@dataclass(frozen=True)
class Seen:
    """A frame and what was found in it."""

    source: str  # name of the source
    frame: int  # number of the frame
    found: Estimate  # with the pose selected that was chosen in the end
    trust: Trust  # how far to trust it
    track: Track | None = None  # state of the track
    picture: np.ndarray | None = None  # (H, W, 3): the annotated picture
    original: np.ndarray | None = None  # (H, W): the picture itself
    clock: str = "time of day"  # what the time stamps are
    vehicle: Vehicle | None = None  # what carries the camera


def messages_of(seen: Seen, time_s: float, frame_id: str = FRAME_ID) -> list[Message]:
    """Return all messages about a frame, each with its topic, which is one of ``TOPICS``."""
    messages: list[Message] = [("/diagnostics", diagnostics_message(seen, time_s, frame_id))]
    if seen.found.status == "ok":
        for topic, pose in zip(("/dock/pose_a", "/dock/pose_b"), seen.found.candidates, strict=False):
            messages.append((topic, pose_message(pose, time_s, frame_id)))
    chosen = seen.found.selected if seen.track is None or not seen.track.predicted else None
    if chosen is not None:
        message = pose_message(chosen, time_s, frame_id)
        messages.append(("/dock/pose", message))
        messages.append(("/detected_dock_pose", message | {"pose": message["pose"]["pose"]}))
        messages += _placed_messages(chosen, seen, time_s, frame_id)
    if seen.picture is not None and chosen is not None:
        compressed = {"header": header(time_s, frame_id), "format": "jpeg", "data": jpeg(seen.picture)}
        messages.append(("/dock/image/compressed", compressed))
    return messages


def _placed_messages(chosen: CirclePose, seen: Seen, time_s: float, frame_id: str) -> list[Message]:
    """Return where the entrance is, and the dock in the vehicle's frame, with the transforms between all of them."""
    found, messages = seen.found, []
    children: list[tuple[str, str, CirclePose | BodyPose]] = [(frame_id, DOCK_FRAME_ID, chosen)]
    entrance = entrance_of(chosen, found.dock, found.camera)
    if entrance is not None:
        messages.append(("/dock/entrance", pose_message(entrance, time_s, frame_id)))
        children.append((frame_id, ENTRANCE_FRAME_ID, entrance))
    vehicle = None if seen.vehicle is None else seen.vehicle.in_frame("flu")
    if vehicle is not None:
        messages.append(("/dock/pose_body", pose_message(vehicle.pose(chosen), time_s, BODY_FRAME_ID)))
        children.append((BODY_FRAME_ID, frame_id, vehicle.camera))
    transforms = [
        {
            "header": header(time_s, parent),
            "child_frame_id": child,
            "transform": {"translation": place, "rotation": turn},
        }
        for parent, child, (place, turn) in [(parent, child, _place(pose)) for parent, child, pose in children]
    ]
    return [*messages, ("/tf", {"transforms": transforms})]


def _place(pose: CirclePose | BodyPose) -> tuple[dict[str, float], dict[str, float]]:
    """A pose's position and quaternion as fields."""
    return (
        dict(zip("xyz", pose.position_m.tolist(), strict=True)),
        dict(zip("xyzw", pose.quaternion_xyzw, strict=True)),
    )


def pose_message(pose: CirclePose | BodyPose, time_s: float, frame_id: str = FRAME_ID) -> dict[str, Any]:
    """Return a pose as fields, without roll, as its rotation is; a roll not seen varies by a full turn."""
    place, turn = _place(pose)
    return {
        "header": header(time_s, frame_id),
        "pose": {
            "pose": {"position": place, "orientation": turn},
            "covariance": covariance(pose).ravel().tolist(),
        },
    }


def diagnostics_message(seen: Seen, time_s: float, frame_id: str = FRAME_ID) -> dict[str, Any]:
    """Return how a frame was judged: OK, WARN or ERROR as the traffic light says, a sentence, and the numbers."""
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
        "sigma_z_m": None if alone is None else alone[2],  # of this picture by itself
        "sigma_total_z_m": None if total is None else total[2],  # and with what all pictures share
        "lights_on_ring": found.lights_on_ring,
        "level": None if found.threshold is None else found.threshold.level,
    }
    if track is not None:
        values |= {f"track_{name}": getattr(track, name) for name in ("probability", "age", "predicted", "lost")}
    status = {
        "level": _LEVELS[trust.colour],
        "name": "dockpose: dock",
        "message": f"{found.message} {trust.sentence}",
        "hardware_id": seen.source,
        "values": [{"key": key, "value": _as_text(value)} for key, value in values.items()],
    }
    return {"header": header(time_s, frame_id), "status": [status]}


def jpeg(picture: np.ndarray) -> bytes:
    """A picture (H, W, 3), BGR of 8 bits, as a JPEG file."""
    return cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, _JPEG_QUALITY])[1].tobytes()


def _as_text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) and math.isfinite(value) else str(value)


def header(time_s: float, frame_id: str = FRAME_ID) -> dict[str, Any]:
    """Return a message's header; ``time_s`` is in seconds since 1970."""
    nanoseconds = round(1e9 * time_s)
    return {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}, "frame_id": frame_id}


def pose_yaml(found: Estimate, time_s: float | None, frame_id: str = FRAME_ID) -> str | None:
    """Return the chosen pose's message as YAML, None without one; without a ``time_s`` since 1970 the stamp is 0."""
    if found.selected is None:
        return None
    message = pose_message(found.selected, 0.0 if time_s is None else time_s, frame_id)
    unknown = "# When the picture was taken is not known: the stamp is 0.\n" if time_s is None else ""
    return unknown + yaml.safe_dump(message, sort_keys=False, default_flow_style=None)


def covariance(pose: CirclePose | BodyPose) -> np.ndarray:
    """Return the total covariance (6, 6) in m² and rad²; where it is unknown, that of knowing nothing."""
    found = pose.covariance_total
    if found is not None:
        return found
    return np.diag([UNKNOWN_LENGTH_M2] * 3 + [UNKNOWN_ANGLE_RAD2] * 3)
