"""``dockpose estimate``: pictures, videos and live streams in; JSON lines, a table and annotated pictures out."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from dockpose import Camera, Dock, Estimate, Settings, estimate
from dockpose.app.commands.arguments import add_camera_and_dock, add_masks, camera_of, dock_of, settings_of
from dockpose.app.commands.estimate_sequence import How, SequenceSource, estimate_sequence, known
from dockpose.app.commands.interrupts import Interrupts
from dockpose.app.commands.output import PictureFolder
from dockpose.app.drawing.annotated import annotate
from dockpose.app.errors import UserError
from dockpose.app.export.rows import CSV_COLUMNS, Outputs, Results, to_row
from dockpose.app.inputs.expand import expand
from dockpose.app.inputs.pictures import EXIT_ALL_READ, EXIT_SOME_UNREADABLE, Batch, Picture, read_job, say
from dockpose.app.processing.auto_masks import AutoMasks
from dockpose.app.processing.parallel import PictureWork, split, workers
from dockpose.camera.files import FileError
from dockpose.sources import Kind, kind_of
from dockpose.thresholds import METHODS

__all__ = ["CSV_COLUMNS", "Outputs", "add_estimate_arguments", "estimate_sources", "run_estimate", "to_row"]

EXIT_STOPPED = 130
_OF_PICTURES = (Kind.PICTURE, Kind.FOLDER, Kind.GLOB)


def add_estimate_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of ``dockpose estimate``."""
    parser.add_argument(
        "sources",
        nargs="*",
        metavar="SOURCE",
        help="a picture, a folder of pictures, a glob, a video, a camera's number, the address of a stream "
        "(http://, rtsp://), or a scene file to simulate",
    )
    add_camera_and_dock(parser)
    parser.add_argument("--method", choices=[*METHODS], help="threshold (default: hats)")
    parser.add_argument("--level", type=int, help="a fixed level, 0..255, in place of a method")
    parser.add_argument("--json", metavar="FILE", help="write one JSON object a line; - for standard output")
    parser.add_argument("--csv", metavar="FILE", help="write a table, a row a frame")
    parser.add_argument(
        "--annotate", metavar="DIR", type=Path, help="write annotated pictures into a folder; of a sequence, X.mp4"
    )
    parser.add_argument(
        "--rate", type=float, metavar="HZ", help="take pictures in their order as a sequence of so many a second"
    )
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="processes for recordings (default: 1)")
    parser.add_argument("--scheduler", metavar="ADDRESS", help="do recordings on a Dask cluster, as tcp://host:8786")
    add_masks(parser)


def run_estimate(arguments: argparse.Namespace) -> int:
    """Do what was typed; returns the exit status. Raises UserError where it cannot be done."""
    camera, dock, settings = camera_of(arguments), dock_of(arguments), settings_of(arguments)
    outputs = Outputs(arguments.json, arguments.csv, arguments.annotate)
    return estimate_sources(arguments.sources, camera, dock, settings, outputs, _how(arguments))


def estimate_sources(
    sources: Sequence[str],
    camera: Camera | None,
    dock: Dock | None,
    settings: Settings,
    outputs: Outputs,
    how: How | None = None,
) -> int:
    """Estimate every picture and sequence, and write what was asked for, frame by frame.

    Parameters
    ----------
    sources : as they were typed.
    camera, dock : for all sources; where None, each one's own, from the YAML beside it.
    settings, how : how to search.
    outputs : where results go; a line for each frame is printed where nothing is asked for.

    Returns
    -------
    Exit status: 0 where every frame was read, 1 where some could not be, which standard error tells, 130 where it was
    stopped by Ctrl-C; what was done until then is kept.

    Raises
    ------
    UserError
        if a source has no camera or dock, or an output cannot be written.
    """
    how = how or How()
    parts = [part.ready(camera, dock) for part in _parts(sources, how.rate_hz)]
    if outputs.video_asked and (len(parts) != 1 or isinstance(parts[0], Batch)):
        raise UserError(f"--annotate {outputs.annotate}: a video is made of one sequence; give a folder instead")
    all_read = True
    with contextlib.ExitStack() as files:
        interrupts = files.enter_context(Interrupts())
        results = Results(outputs, files, interrupts.check)
        try:
            for part in parts:
                if isinstance(part, Batch):
                    _estimate_pictures(part, settings, how, outputs, results)
                    all_read &= part.exit_status == EXIT_ALL_READ
                else:
                    folder = _folder(outputs, part, parts)
                    all_read &= part is not None and _try_sequence(part, settings, how, outputs, results, folder)
        except KeyboardInterrupt:
            frames = "1 frame" if results.frames == 1 else f"{results.frames} frames"
            say(f"stopped after {frames}, whose results are kept")
            return EXIT_STOPPED
    return EXIT_ALL_READ if all_read else EXIT_SOME_UNREADABLE


def _how(arguments: argparse.Namespace) -> How:
    rate_hz, jobs = arguments.rate, arguments.jobs
    if rate_hz is not None and not 0 < rate_hz < 1e6:
        raise UserError(f"--rate is {rate_hz:g}; it must be above 0 and below a million")
    if jobs < 1:
        raise UserError(f"--jobs is {jobs}; it must be at least 1")
    return How(rate_hz, jobs, arguments.scheduler)


@dataclass
class _Part:
    """Sources that are done together: pictures that do not belong together, or one sequence."""

    source: str
    kind: Kind
    paths: list[Path]
    is_sequence: bool

    def ready(self, camera: Camera | None, dock: Dock | None) -> Batch | SequenceSource | None:
        """Find its cameras and docks; None for a sequence that cannot be read, which is told."""
        if not self.is_sequence:
            return Batch(self.paths, camera, dock)
        try:
            return known(self.source, self.kind, tuple(self.paths), camera, dock)
        except FileError as error:
            say(str(error))
            return None


def _parts(sources: Sequence[str], rate_hz: float | None) -> list[_Part]:
    """Pictures without a rate go together; with one, those typed one by one, and each folder and glob by itself."""
    parts: list[_Part] = []
    for source in sources:
        kind = kind_of(source)
        if kind not in _OF_PICTURES:
            parts.append(_Part(source, kind, [], True))
            continue
        part = _Part(source, kind, expand([source]), rate_hz is not None)
        last = parts[-1] if parts else None
        together = last is not None and last.kind in _OF_PICTURES
        if last is not None and together and (rate_hz is None or kind is last.kind is Kind.PICTURE):
            last.paths += part.paths
        else:
            parts.append(part)
    return parts


def _folder(outputs: Outputs, part: SequenceSource | None, parts: Sequence[object]) -> Path | None:
    """Folder for a sequence's annotated pictures: one of its own where there are several sources."""
    if outputs.annotate is None or part is None or len(parts) == 1:
        return outputs.annotate
    return outputs.annotate / f"{parts.index(part) + 1}_{Path(part.source).stem}"


def _try_sequence(
    part: SequenceSource, settings: Settings, how: How, outputs: Outputs, results: Results, folder: Path | None
) -> bool:
    try:
        return estimate_sequence(part, settings, how, outputs, results, folder)
    except UserError:
        raise
    except ValueError as error:
        say(str(error) if part.source in str(error) else f"{part.source}: {error}")
        return False


def _estimate_pictures(batch: Batch, settings: Settings, how: How, outputs: Outputs, results: Results) -> None:
    paths = [job.path for job in batch.jobs]
    folder = None if outputs.annotate is None else PictureFolder(outputs.annotate, paths)
    auto_masks = AutoMasks(settings, say)
    if how.is_split:
        _split_pictures(batch, settings, how, auto_masks, results, folder)
        return

    def work(picture: Picture) -> Estimate:
        wanted = auto_masks.settings_for(picture.image.shape, picture.camera, picture.dock)
        found = estimate(picture.image, picture.camera, picture.dock, wanted)
        auto_masks.see(found, str(picture.path))
        return found

    for picture, found in batch.run(work):
        line = found.to_dict(str(picture.path), 0, None, picture.sha256) | {"track": None}

        def draw(picture: Picture = picture, found: Estimate = found) -> None:
            if folder is not None:
                folder.write(picture.path, annotate(picture.image, found))

        results.write(line, str(picture.path), draw)


def _split_pictures(
    batch: Batch, settings: Settings, how: How, auto_masks: AutoMasks, results: Results, folder: PictureFolder | None
) -> None:
    with workers(how.jobs, how.scheduler) as (executor, at_once):
        for one in split(PictureWork(batch.jobs), executor, at_once, auto_masks, settings):
            if one.estimate is None:
                batch.pass_over(one.told)
                continue
            line = one.estimate.to_dict(one.name, 0, None, one.sha256) | {"track": None}

            def draw(index: int = one.index, found: Estimate = one.estimate) -> None:
                if folder is not None:
                    picture = read_job(batch.jobs[index])
                    folder.write(picture.path, annotate(picture.image, found))

            results.write(line, one.name, draw)
