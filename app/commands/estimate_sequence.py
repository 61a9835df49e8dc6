"""Sequences for ``dockpose estimate``: frame after frame searched, followed over time, and written."""

import argparse
import contextlib
import functools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from dockpose import Settings
from dockpose.app.commands.arguments import is_split, turned
from dockpose.app.commands.output import ResultWriter
from dockpose.app.errors import UserError
from dockpose.app.export.recording import record
from dockpose.app.export.recordings.ros import Seen
from dockpose.app.export.video import VideoFile, is_video_file
from dockpose.app.inputs.pictures import known
from dockpose.app.inputs.sequences import FrameSource
from dockpose.app.processing.following import Followed, Following
from dockpose.app.processing.parallel import Found, SequenceWork, found_in, split, workers
from dockpose.camera.mark import COMMENT
from dockpose.sources import Callback, Frame, Frames, Live, read_ahead

if TYPE_CHECKING:
    from dockpose.app.export.mavlink import Autopilot

_RATE_HZ = 25.0  # of an annotated video of a source that gives no rate


def estimate_sequence(
    source: FrameSource, settings: Settings, how: argparse.Namespace, results: ResultWriter, folder: Path | None
) -> bool:
    """Estimate and follow all frames of a sequence, and write what was asked for."""
    with contextlib.ExitStack() as files:
        # The decoder's threads and this one keep the cores busy; OpenCV's own would only wait for each other.
        files.callback(cv2.setNumThreads, cv2.getNumThreads())
        cv2.setNumThreads(1)
        from dockpose.app.commands.progress import FrameProgress  # loads rich, which single pictures need not

        progress = files.enter_context(FrameProgress(source.name))
        frames = files.enter_context(source.open(progress.tell, grey=True))
        progress.total = frames.count
        recording = None
        if isinstance(frames, Live):
            if frames.about:
                progress.tell(f"{frames.source}: {frames.about}")
            recording = None if how.record is None else record(frames, how.record, progress.tell)
            if recording is not None:
                files.callback(recording.close)
        elif how.record is not None:
            progress.tell(f"{frames.source}: is a recording already, so that --record {how.record} records nothing")
        autopilot = _begin_mavlink(frames, how, progress.tell, files)
        run = _Run(source, frames, settings, how, progress.tell)
        write_picture = _picture_writer(frames, results, folder, files)
        bag = results.bag(source.name, files, progress.tell)
        before = results.frames
        files.callback(lambda: results.miss(frames.skipped + run.skipped, frames.dropped))
        for found, followed in run:
            tracked = followed.tracked
            if autopilot is not None and run.last is not None:
                autopilot.see(run.last, followed.estimate, tracked, followed.trust)
            times = found.time_s, found.sha256, found.time_unix_s
            line = tracked.to_dict(found.name, found.index, *times, how.carrier) | turned(how)
            time = "" if found.time_s is None else f" ({found.time_s:.3f} s)"
            seen = Seen(found.name, found.index, followed.estimate, followed.trust, tracked.track, vehicle=how.carrier)
            read = functools.partial(run.frame, found.index)
            keep = functools.partial(write_picture, found.index, found.time_s)
            results.write(line, f"{found.label}{time}", seen, read, keep, bag)
            progress.step(frames.dropped)
        if results.frames == before and not run.skipped + frames.skipped:
            progress.tell(f"{frames.source}: has no frames")
            return False
        if run.lacks_frame:
            progress.tell(f"{frames.source}: has no frame {how.at_frame}, whose lights --lights-at sets")
        if how.record is not None and (recording is None or not recording.is_whole()):
            return False
        return frames.is_live or not (run.skipped or frames.skipped or frames.is_cut_short or run.lacks_frame)


def _begin_mavlink(
    frames: Frames, how: argparse.Namespace, tell: Callback, files: contextlib.ExitStack
) -> "Autopilot | None":
    """Open the link to an autopilot where one is asked for. Raises UserError where the frames are not of now."""
    if how.mavlink is None:
        return None
    if not frames.is_live:
        raise UserError(f"--mavlink {how.mavlink}: sends what is seen now, but {frames.source} is a recording")
    from dockpose.app.export.mavlink import Autopilot  # loads what takes long and is seldom asked for

    send, made_for = how.mavlink_send, how.mavlink_for
    autopilot = Autopilot(how.mavlink, send, how.mavlink_ids, how.mavlink_age, how.carrier, tell, made_for=made_for)
    files.callback(autopilot.close)
    return autopilot


class _Run:
    """The frames of a sequence as they are found and followed, whichever way they are searched."""

    def __init__(
        self, source: FrameSource, frames: Frames, settings: Settings, how: argparse.Namespace, tell: Callback
    ) -> None:
        self._source, self._frames, self._settings, self._how, self._tell = source, frames, settings, how, tell
        self.camera, self._dock = known(source.name, frames.camera, frames.dock)
        self._following = Following(self.camera, self._dock, settings, tell, is_live=frames.is_live)
        self.last: Frame | None = None  # the frame that came last
        self.skipped = 0  # corrupt frames that other processes reported
        self.lacks_frame = how.by_hand is not None  # whether the frame whose lights are set has not come

    def frame(self, index: int) -> Frame:
        """The frame that came last, by its index."""
        if self.last is None or self.last.index != index:
            self.last = self._frames.at(index)
        return self.last

    def __iter__(self) -> Iterator[tuple[Found, Followed]]:
        frames = self._frames
        if not is_split(self._how) or frames.is_live:
            return self._one_by_one()
        if self._how.by_hand is not None:
            why = "follow from lights that are set, so that they are estimated one by one"
            self._tell(f"{frames.source}: its frames {why}")
            return self._one_by_one()
        return self._split(frames.count or 0)

    def _one_by_one(self) -> Iterator[tuple[Found, Followed]]:
        frames = self._frames if self._frames.is_live else read_ahead(self._frames)
        for frame in self._frames.fitting(frames, self.camera):
            self.last = frame
            is_set = self.lacks_frame and frame.index == self._how.at_frame
            self.lacks_frame &= not is_set
            followed = self._following.see(frame, self._how.by_hand if is_set else None)
            yield found_in(frame, frame.name, followed.tracked.estimate), followed

    def _split(self, count: int) -> Iterator[tuple[Found, Followed]]:
        work = SequenceWork(self._source, self.camera, self._dock, count)
        with workers(self._how.jobs) as (executor, at_once):
            for found in split(work, executor, at_once, self._following.masks, self._settings):
                if found.estimate is None:
                    self.skipped += found.skipped
                    self._tell(found.message)
                else:
                    yield found, self._following.follow(found.estimate, found.time_s)


def _picture_writer(
    frames: Frames, results: ResultWriter, folder: Path | None, files: contextlib.ExitStack
) -> Callable[[int, float | None, np.ndarray], object]:
    """What writes the annotated picture of a frame, by its index and time."""
    if folder is None:
        return lambda index, time_s, picture: None
    if is_video_file(results.to.annotate):
        video = files.enter_context(VideoFile(folder, frames.rate_hz or _RATE_HZ, metadata={"comment": COMMENT}))
        return lambda index, time_s, picture: video.write(picture, time_s)
    pictures = results.folder(folder)
    return lambda index, time_s, picture: pictures.write(f"frame_{index + 1:04d}", picture)
