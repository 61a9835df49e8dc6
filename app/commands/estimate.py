"""``dockpose estimate``: pictures, videos and live streams in; JSON lines, a table and annotated pictures out."""

from __future__ import annotations

import argparse
import contextlib
import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.commands.arguments import (
    Commands,
    add_camera_and_dock,
    add_masks,
    add_method,
    add_rotate,
    add_sources,
    add_topic,
    add_wishes,
    camera_of,
    check_least,
    check_recording,
    dock_of,
    settings_of,
    wishes_of,
)
from dockpose.app.commands.console import (
    EXIT_ALL_READ,
    EXIT_SOME_UNREADABLE,
    EXIT_STOPPED,
    EXIT_TERMINATED,
    Interrupts,
    Terminated,
    say,
    stop_in,
)
from dockpose.app.commands.estimate_sequence import How, estimate_sequence
from dockpose.app.commands.output import Destinations, Recordings, ResultWriter
from dockpose.app.commands.replay import add_session_argument, run_session
from dockpose.app.drawing.annotated import annotate
from dockpose.app.drawing.numbers import count
from dockpose.app.errors import UserError
from dockpose.app.export.recordings.mcap_file import ENDING as MCAP_ENDING
from dockpose.app.export.recordings.messages import Seen
from dockpose.app.export.recordings.rerun_file import ENDING as RERUN_ENDING
from dockpose.app.inputs.pictures import Batch, Picture
from dockpose.app.inputs.resolve import resolve
from dockpose.app.inputs.sequences import FrameSource
from dockpose.app.processing.analysis import headline_of, trust_of
from dockpose.app.processing.auto_masks import AutoMasks
from dockpose.app.processing.parallel import PictureWork, split, workers
from dockpose.checks import as_text
from dockpose.tracking import NO_TRACK


def add_parser(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add the command ``estimate``."""
    parser = commands.add_parser("estimate", help="estimate the dock's pose in pictures, videos and live streams")
    add_sources(
        parser,
        "*",
        "a picture, a folder of pictures, a glob, a video, a bag of ROS, a camera (0, /dev/video0), the address of a "
        "stream (http://, rtsp://), or a scene file to simulate",
    )
    group = parser.add_argument_group("camera and dock")
    add_camera_and_dock(group)
    add_rotate(group)
    _add_detection(parser.add_argument_group("detection"))
    _add_outputs(parser.add_argument_group("output"))
    _add_sequences(parser.add_argument_group("sequences and bags"))
    add_wishes(parser.add_argument_group("live cameras"))
    add_session_argument(parser.add_argument_group("experiment log"))


def _add_detection(group: argparse._ArgumentGroup) -> None:
    add_method(group)
    group.add_argument("--level", type=int, help="threshold at this grey level, 0 to 255, instead of by a method")
    group.add_argument(
        "--min-area",
        type=int,
        metavar="PX",
        help=f"ignore groups of fewer bright pixels (default: {Settings().min_area_px})",
    )
    add_masks(group)


def _add_outputs(group: argparse._ArgumentGroup) -> None:
    group.add_argument("--json", metavar="FILE", help="write one JSON object a line; - for standard output")
    group.add_argument("--csv", metavar="FILE", help="write a table, one row a frame")
    group.add_argument(
        "--annotate",
        metavar="DIR",
        type=Path,
        help="write annotated pictures into this folder, or one annotated MP4 for a sequence",
    )
    group.add_argument(
        "--out",
        metavar="FILE.mcap",
        type=Path,
        help="write ROS 2 messages, for Foxglove: poses with covariances, /tf, annotated pictures, diagnostics",
    )
    group.add_argument("--rerun", metavar="FILE.rrd", type=Path, help="write a recording for the Rerun viewer")
    group.add_argument(
        "--record",
        metavar="FILE.mkv",
        type=Path,
        help="keep every frame of a camera or stream, as it was sent or losslessly compressed",
    )


def _add_sequences(group: argparse._ArgumentGroup) -> None:
    group.add_argument(
        "--rate",
        type=float,
        metavar="HZ",
        help="treat the pictures, in their order, as a sequence at this frame rate; for raw videos, theirs",
    )
    group.add_argument(
        "--smooth",
        action="store_true",
        help="smooth the poses of a sequence over all its frames; JSON lines and rows are written at its end, or when "
        "Ctrl+C stops it",
    )
    add_topic(group)
    group.add_argument("--jobs", type=int, default=1, metavar="N", help="worker processes (default: 1)")
    group.add_argument(
        "--scheduler", metavar="ADDRESS", help="work on the Dask cluster at this address, as tcp://host:8786"
    )


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose estimate``; returns the exit status."""
    if arguments.session is not None:
        return run_session(arguments)
    if not arguments.sources:
        arguments.parser.error("give a SOURCE, or --session FOLDER")
    camera, dock, settings = camera_of(arguments), dock_of(arguments), settings_of(arguments)
    rate_hz = arguments.rate
    check_least(arguments, jobs=1)
    if rate_hz is not None and not 0 < rate_hz < 1e6:
        raise UserError(f"--rate is {rate_hz:g}; it must be above 0 and below a million")
    to = Destinations(
        arguments.json, arguments.csv, arguments.annotate, arguments.out, arguments.rerun, arguments.protected
    )
    for option, path, ending in (("--out", to.out, MCAP_ENDING), ("--rerun", to.rerun, RERUN_ENDING)):
        if path is not None and path.suffix.lower() != ending:
            raise UserError(f"{option} {path}: must be NAME{ending}")
    if arguments.record is not None:
        check_recording(arguments.record, arguments.sources)
    if arguments.smooth and arguments.json is None and arguments.csv is None:
        raise UserError("--smooth needs --json FILE or --csv FILE, which is where smoothed poses go")
    wishes = wishes_of(arguments, arguments.sources)
    how = How(
        rate_hz,
        arguments.topic,
        arguments.jobs,
        arguments.scheduler,
        wishes,
        arguments.record,
        arguments.smooth,
        arguments.rotate,
    )
    return estimate_sources(arguments.sources, camera, dock, settings, to, how)


def estimate_sources(
    sources: Sequence[str],
    camera: Camera | None,
    dock: Dock | None,
    settings: Settings,
    to: Destinations,
    how: How | None = None,
) -> int:
    """Estimate every picture and sequence, and write what was asked for, frame by frame."""
    how = how or How()
    found = resolve(sources, camera, dock, say, how.rate_hz, how.topic, how.rotate_deg)
    parts = [dataclasses.replace(part, wishes=how.wishes) if isinstance(part, FrameSource) else part for part in found]
    if to.is_video and (len(parts) != 1 or isinstance(parts[0], Batch)):
        raise UserError(f"--annotate {to.annotate}: a video is made of one sequence; give a folder instead")
    if to.recordings and len(parts) != 1:
        raise UserError(f"{to.recordings[0]}: takes one source, since its times are those of one")
    all_read = True
    with contextlib.ExitStack() as files:
        interrupts = files.enter_context(Interrupts())
        results = ResultWriter(to, files, interrupts.check)
        try:
            for number, part in enumerate(parts, 1):
                if isinstance(part, Batch):
                    _estimate_pictures(part, settings, how, results, files)
                    all_read &= part.all_read
                elif part is None:
                    all_read = False
                else:
                    all_read &= _try_sequence(part, settings, how, results, number if len(parts) > 1 else None)
        except (KeyboardInterrupt, SystemError) as error:
            stopped = stop_in(error)
            frames = "1 frame" if results.frames == 1 else f"{results.frames} frames"
            say(f"stopped after {frames}, whose results are kept")
            return EXIT_TERMINATED if isinstance(stopped, Terminated) else EXIT_STOPPED
    if results.failures:
        say(f"on {count(len(results.failures), 'frame')} the threshold method failed; first: {results.failures[0]}")
    return EXIT_ALL_READ if all_read and not results.failures else EXIT_SOME_UNREADABLE


def _try_sequence(source: FrameSource, settings: Settings, how: How, results: ResultWriter, number: int | None) -> bool:
    """Estimate a sequence; its annotated pictures go to a folder of their own where it is one of several sources."""
    folder = results.to.annotate
    if folder is not None and number is not None:
        folder = folder / f"{number}_{Path(source.source).stem}"
    try:
        return estimate_sequence(source, settings, how, results, folder)
    except UserError:
        raise
    except ValueError as error:
        say(str(error) if source.source in str(error) else f"{source.source}: {error}")
        return False


def _estimate_pictures(
    batch: Batch, settings: Settings, how: How, results: ResultWriter, files: contextlib.ExitStack
) -> None:
    to = results.to.annotate
    recordings = Recordings(results.to, as_text(str(batch.files[0].path)) if batch.files else "", files, say)
    folder = None if to is None else results.folder(to)
    auto_masks = AutoMasks(settings, say)

    def write(
        path: Path, sha256: str | None, taken_s: float | None, found: Estimate, read: Callable[[], np.ndarray]
    ) -> None:
        trust = trust_of(found)

        def draw() -> None:
            if folder is not None:
                folder.write(path.stem, annotate(read(), found, headline=headline_of(trust)))

        line = found.to_dict(as_text(str(path)), 0, None, sha256, taken_s) | NO_TRACK | how.turned
        results.write(line, str(path), trust, draw)
        seen = Seen(as_text(str(path)), results.frames - 1, found, trust)
        recordings.write(seen, (None, taken_s), read, lambda: annotate(read(), found, headline=headline_of(trust)))

    if how.is_split:
        with workers(how.jobs, how.scheduler) as (executor, at_once):
            for one in split(PictureWork(batch.files), executor, at_once, auto_masks, settings):
                if one.estimate is None:
                    batch.skip(one.told)
                else:
                    batch.tell_orientation(one.tag, batch.files[one.index].path)
                    file = batch.files[one.index]
                    write(file.path, one.sha256, one.time_unix_s, one.estimate, lambda file=file: file.read().image)
        return

    def work(picture: Picture) -> Estimate:
        wanted = auto_masks.settings_for(picture.image.shape, picture.camera, picture.dock)
        found = estimate(picture.image, picture.camera, picture.dock, wanted)
        auto_masks.see(found, str(picture.path))
        return found

    for picture, found in batch.run(work):
        write(picture.path, picture.sha256, picture.time_unix_s, found, lambda picture=picture: picture.image)
