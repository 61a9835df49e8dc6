"""Results that we wrote, read back as docks over time: JSON lines, CSV, MCAP, and a session's folder."""

import contextlib
import csv
import datetime
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np
from dockpose import Camera, Dock
from dockpose.app.experiment import read_session
from dockpose.app.experiment.record import is_session
from dockpose.files import FileError
from dockpose.pose.circle import rotation_from_angles
from dockpose.sources import Kind, SourceError, kind_of, open_frames
from dockpose.sources.bags.decoding import CAMERA_INFO, fields_of
from dockpose.sources.bags.messages import camera_in
from dockpose.sources.bags.opening import opened_files
from dockpose.text import kind_in_words
from dockpose.truth import DockTrack
from dockpose.truth.trajectory import five_of

_CSV = b"source,frame,"
_POSES = {"/dock/pose_a": 0, "/dock/pose_b": 1, "/dock/pose": 2}
_Number = Annotated[float, msgspec.Meta(ge=-1e12, le=1e12)]
_Three = tuple[_Number, _Number, _Number]


class _Pose(msgspec.Struct):
    """A candidate of a line; covariances in ROS's order, or of a table's row the five standard errors."""

    position_m: _Three
    normal: _Three
    covariance_m_rad: Any = None
    covariance_total_m_rad: Any = None


class _Line(msgspec.Struct):
    """What a comparison needs of a line of schema 1."""

    candidates: list[_Pose] = []
    selected: int | None = None
    source: str | None = None
    frame: _Number | None = None
    time_s: _Number | None = None
    time_unix_s: _Number | None = None
    camera: Camera | None = None
    dock: Dock | None = None


@dataclass(frozen=True)
class Results:
    """Docks over time; ``whole`` reads of a row its picture and its line of schema 1, where there is one."""

    track: DockTrack
    clock: str  # which of the results' times theirs are
    notes: tuple[str, ...]
    films: list[tuple[str, int | None]]  # of each row the name of its source, and which frame of that it is
    whole: Callable[[int], tuple[np.ndarray, dict[str, Any] | None]]


def read_results(path: Path) -> Results:
    """Read results; FileError names what cannot be read, and the note what was left out."""
    notes, places, lines = list[str](), list[tuple[Any, str, int | None]](), list[tuple[float, float, np.ndarray]]()
    source, first = _source(path, notes), _Line()
    for place, line in source:
        first = line if line.camera is not None and first.camera is None else first
        places.append((place, Path(line.source or "").name, None if line.frame is None else int(line.frame)))
        lines.append((_or_nan(line.time_unix_s), _or_nan(line.time_s), _numbers(line)))
    unix_s, own_s = np.array([line[:2] for line in lines]).reshape(-1, 2).T
    clock = "time_unix_s" if np.isfinite(unix_s[:1]).all() else "time_s"
    times_s = unix_s if clock == "time_unix_s" else own_s
    known = np.flatnonzero(np.isfinite(times_s))
    rows = known[np.unique(times_s[known], return_index=True)[1]]
    if len(rows) < len(lines):
        what = "without a time, or with that of another, are left out; --rate HZ of estimate gives pictures times"
        notes.append(f"{path.name}: {len(lines) - len(rows)} of {len(lines)} frames {what}")
    if not len(rows):
        raise FileError("; ".join([f"{path}: has no frames with a time", *notes]))
    values = np.stack([lines[row][2] for row in rows])
    chosen, other, spread = values[:, :6], values[:, 6:12], values[:, 12:].reshape(-1, 2, 6, 6)
    own, total = (five_of(spread[:, one], chosen[:, 3:]) for one in (0, 1))
    own = np.where(np.isfinite(own), own, total)
    numbers = times_s[rows], chosen[:, :3], chosen[:, 3:], own, np.where(np.isfinite(total), total, own)
    track = DockTrack(*numbers, other[:, :3], other[:, 3:], first.camera, first.dock)
    films = [places[row][1:] for row in rows]
    return Results(track, clock, tuple(notes), films, lambda row: _whole(path, places[rows[row]][0]))


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value


def _numbers(line: _Line) -> np.ndarray:
    """Of the chosen candidate place and normal, of the other both, and two covariances (84,)."""
    values = np.full(84, np.nan)
    if line.selected is None or not 0 <= line.selected < len(line.candidates):
        return values
    pose = line.candidates[line.selected]
    values[:6] = (*pose.position_m, *pose.normal)
    if len(line.candidates) == 2:
        other = line.candidates[1 - line.selected]
        values[6:12] = (*other.position_m, *other.normal)
    for at, spread in ((12, pose.covariance_m_rad), (48, pose.covariance_total_m_rad)):
        if spread is not None:
            values[at : at + 36] = np.asarray(spread, float).ravel()
    return values


def _source(path: Path, notes: list[str]) -> Iterator[tuple[Any, _Line]]:
    """Where each frame stands, and its line."""
    if is_session(path):
        return _of_session(path)
    if kind_of(str(path)) is Kind.BAG:
        return _of_bag(path)
    try:
        with path.open("rb") as file:
            head = file.read(64).removeprefix(b"\xef\xbb\xbf")
    except OSError as error:
        raise FileError(f"{path}: cannot be read ({error.strerror or error})") from error
    if head.startswith(b"{"):
        return _of_lines(path, notes)
    if head.startswith(_CSV):
        return _of_table(path)
    what = kind_in_words(head) or "no results of ours: JSON lines, CSV, MCAP or a session's folder"
    raise FileError(f"{path}: is {what}")


def _of_lines(path: Path, notes: list[str]) -> Iterator[tuple[int, _Line]]:
    decoder, at = msgspec.json.Decoder(_Line), 0
    with path.open("rb") as file:
        for number, piece in enumerate(file, 1):
            try:
                line = decoder.decode(piece) if piece.strip() else None
            except (ValueError, RecursionError) as error:
                if number == 1 or piece.endswith(b"\n"):
                    raise FileError(f"{path}: line {number} is none of our results ({error})") from error
                notes.append(f"{path.name}: line {number}, the last, is cut short and left out")
                return
            if line is not None:
                yield at, line
            at += len(piece)


def _of_table(path: Path) -> Iterator[tuple[None, _Line]]:
    """Rows of ``estimate --csv``, which has neither camera nor dock, and standard errors in place of covariances."""
    with path.open(encoding="utf-8-sig", errors="replace", newline="") as file:
        rows = csv.DictReader(file)
        try:
            for row in rows:
                found = {name: float(text) for name, text in row.items() if name in _READ and text}
                candidates = [_of_row(found, name) for name in "ab" if f"{name}_z_m" in found]
                selected = "AB".index(row["selected"]) if row.get("selected") else None
                frame, own_s, unix_s = map(found.get, ("frame", "time_s", "time_unix_s"))
                yield None, _Line(candidates, selected, row["source"], frame, own_s, unix_s)
        except (ValueError, KeyError, csv.Error) as error:
            raise FileError(f"{path}: line {rows.line_num} is no row of estimate --csv ({error})") from error


_FIVE = ("x_m", "y_m", "z_m", "theta_x_deg", "theta_y_deg")
_SIGMAS = ("chosen_sigma_", "chosen_sigma_total_")
_READ = {f"{name}{column}" for name in ("a_", "b_", *_SIGMAS) for column in _FIVE}
_READ |= {"frame", "time_s", "time_unix_s"}


def _of_row(found: dict[str, float], name: str) -> _Pose:
    """A candidate of a row; its normal's errors along theta_x and theta_y stand for two turns of the camera's axes."""
    x, y, z, *angles = (found[f"{name}_{column}"] for column in _FIVE)
    theta_x, theta_y = np.radians(angles)
    rotation = rotation_from_angles(theta_x, theta_y)
    turns = np.column_stack([rotation[:, 0], [0.0, 1.0, 0.0]])  # of theta_x about the dock's x, of theta_y about y
    spreads = []
    for sigma in _SIGMAS:
        values = np.array([found.get(f"{sigma}{column}", np.nan) for column in _FIVE])
        spread = np.zeros((6, 6))
        spread[:3, :3] = np.diag(values[:3] ** 2)
        spread[3:, 3:] = turns @ np.diag(np.radians(values[3:]) ** 2) @ turns.T
        spreads.append(spread)
    return _Pose((x, y, z), tuple(-rotation[:, 2]), *spreads)


def _of_bag(path: Path) -> Iterator[tuple[int, _Line]]:
    """Frames of our own recordings by their stamps, as far as poses and pictures are there."""
    storages, _, stack = opened_files(str(path))
    frames, camera = dict[int, dict[int, _Pose]](), None
    with stack:
        for message in (message for file in storages for message in file.messages()):
            name, topic = message.topic.name, message.topic
            if name == "/dock/camera_info" and topic.kind == CAMERA_INFO and camera is None:
                said = fields_of(topic, message.data)
                with contextlib.suppress(ValueError):
                    camera = camera_in(said, (said.width, said.height), lambda text: None)
            if name in ("/diagnostics", *_POSES):
                fields = fields_of(topic, message.data)
                stamp = fields.header.stamp
                frame = frames.setdefault(stamp.sec * 10**9 + stamp.nanosec, {})
                if name in _POSES:
                    frame[_POSES[name]] = _of_message(fields.pose)
    if not any(frames.values()):
        raise FileError(f"{path}: has no topics of ours ({', '.join(_POSES)}), as estimate --out FILE.mcap writes them")
    for number, (stamp_ns, found) in enumerate(frames.items()):
        candidates = [found[index] for index in (0, 1) if index in found]
        places = [one.position_m for one in candidates]
        selected = places.index(found[2].position_m) if 2 in found and found[2].position_m in places else None
        yield number, _Line(candidates, selected, time_s=stamp_ns / 1e9, camera=camera)


def _of_message(message: Any) -> _Pose:
    place, turn = message.pose.position, message.pose.orientation
    x, y, z, w = turn.x, turn.y, turn.z, turn.w
    normal = (-2 * (x * z + y * w), -2 * (y * z - x * w), 2 * (x * x + y * y) - 1)
    return _Pose((place.x, place.y, place.z), normal, covariance_total_m_rad=message.covariance)


def _of_session(path: Path) -> Iterator[tuple[int, _Line]]:
    record = read_session(path)
    for number, row in enumerate(record.rows):
        try:
            line = msgspec.convert(record.line(row), _Line)
            line.time_s, line.time_unix_s = None, datetime.datetime.fromisoformat(row.time).timestamp()
        except ValueError as error:
            raise FileError(f"{path}: row {row.number}: {error}") from error
        yield number, line


def _whole(path: Path, place: int | None) -> tuple[np.ndarray, dict[str, Any] | None]:
    """The picture of a row, and its line; ValueError where its source cannot be opened."""
    if place is None:
        raise FileError(f"{path}: says not where its pictures are")
    if is_session(path):
        record = read_session(path)
        return record.picture(record.rows[place]), record.line(record.rows[place])
    if kind_of(str(path)) is Kind.BAG:
        with open_frames(path, topic="/dock/image") as frames:
            return frames.at(place).image, None
    with path.open("rb") as file:
        file.seek(place)
        line = msgspec.json.decode(file.readline())
    source = next((one for one in (path.parent / line["source"], Path(line["source"])) if one.exists()), None)
    if source is None:
        raise SourceError(f"{line['source']}: is not there; open it to look at frame {line['frame']}")
    with open_frames(source, rotate=line.get("rotate_deg") or 0) as frames:
        return frames.at(0 if line.get("sha256") else line["frame"]).image, line
