"""``dockpose estimate``: pictures, videos and live streams in, or a session again; lines, a table and pictures out."""

import argparse
import contextlib
import dataclasses
import hashlib
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import msgspec
import numpy as np
from dockpose import Estimate, Settings
from dockpose.app.commands import arguments as given
from dockpose.app.commands import console
from dockpose.app.commands.output import ResultWriter
from dockpose.app.drawing.numbers import count
from dockpose.app.errors import UserError, blaming, check_place
from dockpose.app.experiment.record import is_session
from dockpose.app.export.recordings.ros import ENDING as MCAP_ENDING
from dockpose.app.export.recordings.ros import Seen
from dockpose.app.inputs.pictures import Batch, Picture, UnknownError, take_labels
from dockpose.app.inputs.received import safe_name
from dockpose.app.inputs.sequences import FrameSource, resolve
from dockpose.app.processing.masks import AutoMasks
from dockpose.app.resources import versions
from dockpose.app.state.trust import trust_of
from dockpose.camera.image import decode, read_picture_file
from dockpose.labels import is_labels
from dockpose.lights.by_hand import ByHand
from dockpose.sidecar import load_lights
from dockpose.text import as_text
from dockpose.thresholds import METHODS
from dockpose.tracking import NO_TRACK

if TYPE_CHECKING:
    from dockpose.app.experiment import Row, SessionRecord

KNOWN = {"method": {"choices": METHODS}, "words": {"least_px": Settings().min_area_px}}

# What does not go with --session.
_OWN = ("camera", "dock_diameter", "lights", "method", "level", "min_area", "mask", "rate", "rotate", "dock", "vehicle")
_OWN += ("camera_size", "lights_at", "snap", "at_frame")
_UNSET = ("rotate", 0), ("at_frame", 0)
_WRITTEN = ("json", "csv", "tum", "annotate", "out", "record")


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose estimate``; returns the exit status."""
    if arguments.session is not None:
        return run_session(arguments)
    for source in arguments.sources:
        if is_session(Path(source)):
            raise UserError(f"{source}: is a session; estimate --session {source} does its frames again")
    if not arguments.sources:
        arguments.parser.error("give a SOURCE, or --session FOLDER")
    camera, dock, settings = given.camera_of(arguments), given.dock_of(arguments), given.settings_of(arguments)
    arguments.carrier = given.vehicle_of(arguments)
    _check(arguments)
    capture = given.capture_of(arguments, arguments.sources)
    found = resolve(arguments.sources, camera, dock, console.say, arguments.rate, arguments.topic, arguments.rotate)
    parts = [dataclasses.replace(part, capture=capture) if isinstance(part, FrameSource) else part for part in found]
    arguments.by_hand = _lights_of(arguments, parts)
    if arguments.annotate is not None and (len(parts) != 1 or isinstance(parts[0], Batch)):
        from dockpose.app.export.video import is_video_file

        if is_video_file(arguments.annotate):
            raise UserError(f"--annotate {arguments.annotate}: a video is made of one sequence; give a folder instead")
    for option, path in (("--out", arguments.out), ("--tum", arguments.tum)):
        if path is not None and len(parts) != 1:
            raise UserError(f"{option} {path}: takes one source, since its times are those of one")
    return _estimate(parts, settings, arguments)


def _lights_of(arguments: argparse.Namespace, parts: list[Batch | FrameSource | None]) -> ByHand | None:
    """The lights of ``--lights-at``, which a picture keeps. Raises UserError where they can be of none."""
    path = arguments.lights_at
    if path is None:
        if arguments.snap or arguments.at_frame:
            raise UserError("--snap and --at-frame go with --lights-at FILE")
        return None
    with blaming("--lights-at "):
        if is_labels(path) and not arguments.at_frame:
            take_labels(parts, path, console.say, snap=arguments.snap)
            return None
        lights = load_lights(path)
    if arguments.snap:
        lights = msgspec.structs.replace(lights, snap=True)
    part = parts[0] if len(parts) == 1 else None
    if isinstance(part, Batch) and len(part.files) == 1 and not arguments.at_frame:
        part.files = (part.files[0].with_lights(lights),)
    elif not isinstance(part, FrameSource):
        raise UserError(
            f"--lights-at {path}: these are lights of one picture, or of a frame of one film; give one SOURCE"
        )
    return lights


def _check(arguments: argparse.Namespace) -> None:
    """Raise UserError for what the options cannot be, whatever the sources are."""
    rate_hz = arguments.rate
    given.check_least(arguments, jobs=1, at_frame=0)
    if rate_hz is not None and not 0 < rate_hz < 1e6:
        raise UserError(f"--rate is {rate_hz:g}; it must be above 0 and below a million")
    if arguments.out is not None and arguments.out.suffix.lower() != MCAP_ENDING:
        raise UserError(f"--out {arguments.out}: must be NAME{MCAP_ENDING}")
    if arguments.out is not None:
        check_place(arguments.out, "--out", in_place=True)
    if arguments.record is not None:
        given.check_recording(arguments.record, arguments.sources)


def _estimate(parts: Sequence[Batch | FrameSource | None], settings: Settings, how: argparse.Namespace) -> int:
    """Estimate every picture and sequence, and write what was asked for, frame by frame."""
    all_read = True
    with contextlib.ExitStack() as files:
        results = ResultWriter(how, files)
        try:
            for number, part in enumerate(parts, 1):
                if isinstance(part, Batch):
                    _estimate_pictures(part, settings, how, results, files)
                    results.left_out += part.left_out
                    all_read &= part.left_out == 0
                elif part is None:
                    results.left_out += 1
                    all_read = False
                else:
                    all_read &= _try_sequence(part, settings, how, results, number if len(parts) > 1 else None)
        except (KeyboardInterrupt, SystemError) as error:
            stopped = console.stop_in(error)
            console.say(f"stopped after {count(results.frames, 'frame')}, whose results are kept")
            results.put_sum("frames")
            return console.status_of(stopped)
    results.put_sum("frames" if any(isinstance(part, FrameSource) for part in parts) else "pictures")
    untimed = 0 if results.tum is None else results.tum.without_time
    if untimed:
        console.say(
            f"--tum {how.tum}: {count(untimed, 'pose')} without a time left out; --rate HZ gives pictures times"
        )
    if results.failures:
        console.say(
            f"on {count(len(results.failures), 'frame')} the threshold method failed; first: {results.failures[0]}"
        )
    is_whole = all_read and not results.failures and not untimed
    return console.EXIT_ALL_READ if is_whole else console.EXIT_SOME_UNREADABLE


def _try_sequence(
    source: FrameSource, settings: Settings, how: argparse.Namespace, results: ResultWriter, number: int | None
) -> bool:
    """Estimate a sequence; its annotated pictures go to a folder of their own where it is one of several sources."""
    from dockpose.app.commands.estimate_sequence import estimate_sequence

    folder = how.annotate
    if folder is not None and number is not None:
        folder = folder / f"{number}_{safe_name(Path(source.name).resolve().stem)}"
    try:
        return estimate_sequence(source, settings, how, results, folder)
    except UnknownError as error:
        if number is None:
            raise
        console.say(str(error))
        return False
    except UserError:
        raise
    except ValueError as error:
        console.say(str(error) if source.name in str(error) else f"{source.name}: {error}")
        return False


def _estimate_pictures(
    batch: Batch, settings: Settings, how: argparse.Namespace, results: ResultWriter, files: contextlib.ExitStack
) -> None:
    source = as_text(str(batch.files[0].path)) if batch.files else ""
    bag = results.bag(source, files, console.say)
    folder = None if how.annotate is None else results.folder(how.annotate)
    auto_masks = AutoMasks(settings, console.say)

    def write(
        path: Path, sha256: str | None, taken_s: float | None, found: Estimate, read: Callable[[], Picture]
    ) -> None:
        def keep(picture: np.ndarray) -> None:
            if folder is not None:
                folder.write(path.stem, picture)

        name = as_text(str(path))
        line = found.to_dict(name, 0, None, sha256, taken_s, how.carrier) | NO_TRACK | given.turned(how)
        seen = Seen(name, results.frames, found, trust_of(found), vehicle=how.carrier)
        results.write(line, str(path), seen, lambda: read().frame(), keep, bag)

    if given.is_split(how):
        from dockpose.app.processing.parallel import PictureWork, split, workers

        with workers(how.jobs) as (executor, at_once):
            for one in split(PictureWork(batch.files), executor, at_once, auto_masks, settings):
                if one.estimate is None:
                    batch.skip(one.message)
                else:
                    batch.tell_orientation(one.tag, batch.files[one.index].path)
                    file = batch.files[one.index]
                    write(file.path, one.sha256, one.time_unix_s, one.estimate, file.read)
        return

    def work(picture: Picture) -> Estimate:
        wanted = auto_masks.settings_for(picture.image.shape, picture.camera, picture.dock)
        found = picture.estimate(wanted)
        auto_masks.see(found, str(picture.path))
        return found

    for picture, found in batch.run(work):
        write(picture.path, picture.sha256, picture.time_unix_s, found, lambda picture=picture: picture)


def run_session(arguments: argparse.Namespace) -> int:
    """Run ``dockpose estimate --session``; returns the exit status. Raises UserError for what does not go with it."""
    if arguments.sources:
        raise UserError(f"--session {arguments.session} takes the place of SOURCE ({arguments.sources[0]}); give one")
    for name in (*_OWN, *_WRITTEN):
        value = getattr(arguments, name, None)
        if value not in (None, []) and value is not False and (name, value) not in _UNSET:
            option = name.replace("_", "-")
            raise UserError(f"--{option} does not go with --session, which has each frame's own and writes nothing")
    return replay_session(arguments.session)


def replay_session(folder: Path) -> int:
    """Estimate every frame of a session with its own camera, dock and settings, and print what differs."""
    from dockpose.app.experiment import read_session
    from dockpose.app.experiment.record import unlisted

    with blaming("--session "):
        record = read_session(folder)
    changed = unreadable = followed = 0
    lacking = list(unlisted(record))
    for text in lacking:
        console.say(text)
    for row in record.rows:
        if row.found_by == "following":  # from a frame that the session need not have
            followed += 1
            continue
        try:
            sentence = _replayed(record, row)
        except ValueError as error:
            unreadable += 1
            console.say(f"row {row.number}: {error}")
            continue
        if sentence:
            changed += 1
            console.put(f"row {row.number}: {sentence}")
    same = len(record.rows) - changed - unreadable - followed
    rest = f", {changed} differ{'s' if changed == 1 else ''}" if changed else ""
    rest += f", {unreadable} cannot be read" if unreadable else ""
    rest += f", {followed} followed from frames before, not searched again" if followed else ""
    console.put(f"{folder}: {same} of {len(record.rows)} rows give the same numbers{rest}.")
    return console.EXIT_SOME_UNREADABLE if changed or unreadable or lacking else console.EXIT_ALL_READ


def _replayed(record: "SessionRecord", row: "Row") -> str:
    """Which numbers of a row differ and why; empty where none does."""
    from dockpose.app.processing.analysis import differences, estimate_again

    line, path = record.line(row), record.folder / row.file
    data = read_picture_file(path)
    try:
        found = differences(line, estimate_again(decode(data, str(path)), line))
    except ValueError as error:
        raise ValueError(str(error) if str(path) in str(error) else f"{path.with_suffix('.json')}: {error}") from error
    if not found:
        return ""
    now, before = versions(), line.get("program")
    before = before if isinstance(before, dict) else {}
    reasons = ["the picture's file was changed"] if hashlib.sha256(data).hexdigest() != row.sha256 else []
    reasons += [f"{one} was {before.get(one, 'unknown')}, is {now[one]}" for one in now if before.get(one) != now[one]]
    name, stored, new = found[0]
    more = f", and {len(found) - 1} more" if len(found) > 1 else ""
    why = "; ".join(reasons) or "program, libraries and picture are the same"
    return f"{name} {_short(stored)} is now {_short(new)}{more} ({why})"


def _short(value: Any) -> str:
    return repr(value) if isinstance(value, (int, float, str)) else "nothing" if value is None else "something else"
