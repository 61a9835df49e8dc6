"""Poses in bags: which topics have them, and of which bodies."""

from collections import defaultdict
from collections.abc import Iterator
from operator import attrgetter
from pathlib import Path

from dockpose.sources.bags.decoding import fields_of, is_read
from dockpose.sources.bags.opening import opened_files
from dockpose.sources.bags.storage import Message
from dockpose.sources.frames import SourceError

# Of each type of message, or of the transforms in it, where the pose stands, and what names the body.
_KINDS = {
    "geometry_msgs/msg/PoseStamped": ("pose.position", "pose.orientation", "header.frame_id"),
    **dict.fromkeys(
        ("geometry_msgs/msg/TransformStamped", "tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"),
        ("transform.translation", "transform.rotation", "child_frame_id"),
    ),
    "geometry_msgs/msg/PoseWithCovarianceStamped": ("pose.pose.position", "pose.pose.orientation", "header.frame_id"),
    "nav_msgs/msg/Odometry": ("pose.pose.position", "pose.pose.orientation", "child_frame_id"),
}
Rows = list[tuple[float, ...]]  # each of time in s, place in m, quaternion (x, y, z, w)


def bodies_in(path: Path, topic: str | None) -> tuple[dict[str, Rows], list[str]]:
    """The poses of each body on a topic, or on the only one with poses, and sentences on what is amiss."""
    storages, _, stack = opened_files(str(path))
    found, names, notes = defaultdict[str, dict[str, Rows]](dict), set[str](), list[str]()
    damaged = unstamped = 0
    with stack:
        for file in storages:
            for message in file.messages():
                name = message.topic.name
                names.add(name)
                if message.topic.kind not in _KINDS or not is_read(message.topic):
                    continue
                rows = found[name]
                if topic is not None and name.lstrip("/") != topic.lstrip("/"):
                    continue
                try:
                    for body, row in _poses(message):
                        rows.setdefault(body, []).append((row[0] or message.time_ns / 1e9, *row[1:]))
                        unstamped += not row[0]
                except SourceError:
                    damaged += 1
            notes += file.faults
    wanted = [name for name in found if topic is None or name.lstrip("/") == topic.lstrip("/")]
    if len(wanted) != 1:
        have = f"those with poses are {', '.join(sorted(found)) or 'none'} of {', '.join(sorted(names)) or 'none'}"
        raise ValueError(f"which topic? {have}; say --topic" if topic is None else f"has no poses on {topic}; {have}")
    notes += [f"{damaged} messages are damaged and left out"] * bool(damaged)
    notes += [f"{unstamped} poses have no time stamps; the times of the recording are taken"] * bool(unstamped)
    return found[wanted[0]], notes


def _poses(message: Message) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Of each pose in a message its body and its numbers; a time of 0 where it has none."""
    place_of, turn_of, body_of = map(attrgetter, _KINDS[message.topic.kind])
    fields = fields_of(message.topic, message.data)
    for one in getattr(fields, "transforms", [fields]):
        place, turn, stamp = place_of(one), turn_of(one), one.header.stamp
        yield body_of(one), (stamp.sec + stamp.nanosec / 1e9, place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w)
