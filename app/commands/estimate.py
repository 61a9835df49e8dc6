"""``dockpose estimate``: pictures, videos and live streams in; JSON lines, a table and annotated pictures out."""

import argparse
import contextlib
import dataclasses
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from dockpose import Estimate, Settings, estimate
from dockpose.app.commands import arguments as given
from dockpose.app.commands import console
from dockpose.app.commands.estimate_sequence import estimate_sequence, is_split
from dockpose.app.commands.output import ResultWriter
from dockpose.app.commands.replay import run_session
from dockpose.app.drawing.numbers import count
from dockpose.app.errors import UserError
from dockpose.app.export.recordings.mcap_file import ENDING as MCAP_ENDING
from dockpose.app.export.recordings.messages import Seen
from dockpose.app.export.recordings.rerun_file import ENDING as RERUN_ENDING
from dockpose.app.export.video import is_video_file
from dockpose.app.inputs.pictures import Batch, Picture
from dockpose.app.inputs.sequences import FrameSource, resolve
from dockpose.app.processing.analysis import trust_of
from dockpose.app.processing.following import AutoMasks
from dockpose.app.processing.parallel import PictureWork, split, workers
from dockpose.checks import as_text
from dockpose.tracking import NO_TRACK


def add_parser(commands: given.Commands) -> None:
    """Add the command ``estimate``."""
    parser = commands.add_parser("estimate", help="estimate the dock's pose in pictures, videos and live streams")
    given.add_options(parser, "estimate")
    given.add_options(parser.add_argument_group("camera and dock"), "camera_and_dock", "rotate")
    detection, least_px = ("method", "estimate_detection", "masks"), Settings().min_area_px
    given.add_options(
        parser.add_argument_group("detection"), *detection, words={"least_px": least_px}, method=given.METHOD
    )
    given.add_options(parser.add_argument_group("output"), "json", "estimate_output")
    sequences = ("estimate_sequences", "topic", "estimate_workers")
    given.add_options(parser.add_argument_group("sequences and bags"), *sequences)
    given.add_options(parser.add_argument_group("live cameras"), "wishes")
    given.add_options(parser.add_argument_group("autopilot"), "mavlink")
    given.add_options(parser.add_argument_group("experiment log"), "estimate_session")


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose estimate``; returns the exit status."""
    if arguments.session is not None:
        return run_session(arguments)
    if not arguments.sources:
        arguments.parser.error("give a SOURCE, or --session FOLDER")
    camera, dock, settings = given.camera_of(arguments), given.dock_of(arguments), given.settings_of(arguments)
    _check(arguments)
    wishes = given.wishes_of(arguments, arguments.sources)
    found = resolve(arguments.sources, camera, dock, console.say, arguments.rate, arguments.topic, arguments.rotate)
    parts = [dataclasses.replace(part, wishes=wishes) if isinstance(part, FrameSource) else part for part in found]
    is_video = arguments.annotate is not None and is_video_file(arguments.annotate)
    if is_video and (len(parts) != 1 or isinstance(parts[0], Batch)):
        raise UserError(f"--annotate {arguments.annotate}: a video is made of one sequence; give a folder instead")
    recording = arguments.out or arguments.rerun
    if recording is not None and len(parts) != 1:
        raise UserError(f"{recording}: takes one source, since its times are those of one")
    return _estimate(parts, settings, arguments)


def _check(arguments: argparse.Namespace) -> None:
    """Raise UserError for what the options cannot be, whatever the sources are."""
    rate_hz = arguments.rate
    given.check_least(arguments, jobs=1)
    if rate_hz is not None and not 0 < rate_hz < 1e6:
        raise UserError(f"--rate is {rate_hz:g}; it must be above 0 and below a million")
    for option, path, ending in (("--out", arguments.out, MCAP_ENDING), ("--rerun", arguments.rerun, RERUN_ENDING)):
        if path is not None and path.suffix.lower() != ending:
            raise UserError(f"{option} {path}: must be NAME{ending}")
    if arguments.record is not None:
        given.check_recording(arguments.record, arguments.sources)
    if arguments.smooth and arguments.json is None and arguments.csv is None:
        raise UserError("--smooth needs --json FILE or --csv FILE, which is where smoothed poses go")


def _estimate(parts: Sequence[Batch | FrameSource | None], settings: Settings, how: argparse.Namespace) -> int:
    """Estimate every picture and sequence, and write what was asked for, frame by frame."""
    all_read = True
    with contextlib.ExitStack() as files:
        results = ResultWriter(how, files)
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
            stopped = console.stop_in(error)
            console.say(f"stopped after {count(results.frames, 'frame')}, whose results are kept")
            return console.EXIT_TERMINATED if isinstance(stopped, console.Terminated) else console.EXIT_STOPPED
    if results.failures:
        console.say(
            f"on {count(len(results.failures), 'frame')} the threshold method failed; first: {results.failures[0]}"
        )
    return console.EXIT_ALL_READ if all_read and not results.failures else console.EXIT_SOME_UNREADABLE


def _try_sequence(
    source: FrameSource, settings: Settings, how: argparse.Namespace, results: ResultWriter, number: int | None
) -> bool:
    """Estimate a sequence; its annotated pictures go to a folder of their own where it is one of several sources."""
    folder = how.annotate
    if folder is not None and number is not None:
        folder = folder / f"{number}_{Path(source.source).stem}"
    try:
        return estimate_sequence(source, settings, how, results, folder)
    except UserError:
        raise
    except ValueError as error:
        console.say(str(error) if source.source in str(error) else f"{source.source}: {error}")
        return False


def _estimate_pictures(
    batch: Batch, settings: Settings, how: argparse.Namespace, results: ResultWriter, files: contextlib.ExitStack
) -> None:
    source = as_text(str(batch.files[0].path)) if batch.files else ""
    recordings = results.recordings(source, files, console.say)
    folder = None if how.annotate is None else results.folder(how.annotate)
    auto_masks = AutoMasks(settings, console.say)

    def write(
        path: Path, sha256: str | None, taken_s: float | None, found: Estimate, read: Callable[[], np.ndarray]
    ) -> None:
        def keep(picture: np.ndarray) -> None:
            if folder is not None:
                folder.write(path.stem, picture)

        name = as_text(str(path))
        line = found.to_dict(name, 0, None, sha256, taken_s) | NO_TRACK | given.turned(how)
        seen = Seen(name, results.frames, found, trust_of(found))
        results.write(line, str(path), seen, read, keep, recordings)

    if is_split(how):
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
