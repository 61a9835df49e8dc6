"""Sequences for ``dockpose estimate``: frame after frame searched, followed over time, and written."""

import argparse
import contextlib
import functools
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import cv2
import numpy as np
from dockpose import Settings
from dockpose.app.commands.arguments import turned
from dockpose.app.commands.output import ResultWriter
from dockpose.app.errors import UserError
from dockpose.app.export.recording import record
from dockpose.app.export.recordings.ros import Seen
from dockpose.app.export.video import VideoFile, is_video_file
from dockpose.app.inputs.pictures import known
from dockpose.app.inputs.sequences import FrameSource
from dockpose.app.processing.following import Following
from dockpose.camera.mark import COMMENT
from dockpose.sources import Callback, Frames, Live, read_ahead

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
        camera, dock = known(source.name, frames.camera, frames.dock)
        following = Following(camera, dock, settings, progress.tell, is_live=frames.is_live)
        lacks_frame = how.by_hand is not None  # whether the frame whose lights are set has not come
        write_picture = _picture_writer(frames, results, folder, files)
        bag = results.bag(source.name, files, progress.tell)
        before = results.frames
        files.callback(lambda: results.miss(frames.skipped, frames.dropped))
        for frame in frames.fitting(frames if frames.is_live else read_ahead(frames), camera):
            is_set = lacks_frame and frame.index == how.at_frame
            lacks_frame &= not is_set
            followed = following.see(frame, how.by_hand if is_set else None)
            tracked = followed.tracked
            if autopilot is not None:
                autopilot.see(frame, followed.estimate, tracked, followed.trust)
            times = frame.time_s, frame.sha256, frame.time_unix_s
            line = tracked.to_dict(frame.name, frame.index, *times, how.carrier) | turned(how)
            time = "" if frame.time_s is None else f" ({frame.time_s:.3f} s)"
            seen = Seen(frame.name, frame.index, followed.estimate, followed.trust, tracked.track, vehicle=how.carrier)
            keep = functools.partial(write_picture, frame.index, frame.time_s)
            results.write(line, f"{frame.name} frame {frame.index}{time}", seen, frame, keep, bag)
            progress.step(frames.dropped)
        if results.frames == before and not frames.skipped:
            progress.tell(f"{frames.source}: has no frames")
            return False
        if lacks_frame:
            progress.tell(f"{frames.source}: has no frame {how.at_frame}, whose lights --lights-at sets")
        if how.record is not None and (recording is None or not recording.is_whole()):
            return False
        return frames.is_live or not (frames.skipped or frames.is_cut_short or lacks_frame)


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
