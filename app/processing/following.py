"""Tracking the dock through a sequence on the page, frame by frame."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dockpose import Estimate, Tracker
from dockpose.app.processing.analysis import Analysis, TrackedFrame, select_pose
from dockpose.app.processing.trajectory import Trajectory
from dockpose.app.state.view import View, with_first_frame, with_frame
from dockpose.sources import Frame, Frames
from dockpose.tracking.tracker import Tracked


class FrameFollower:
    """Analyses the frames of one sequence, each with the camera, dock and settings that the page has by then."""

    def __init__(self, frames: Frames, name: str) -> None:
        self.frames, self._name = frames, name
        self._tracker: Tracker | None = None
        self._searched_with: tuple[Any, ...] = ()
        self._before: int | None = None
        self.trajectory = Trajectory()

    def view_of(self, view: View, frame: Frame) -> View:
        """Return the view with this frame as its picture."""
        number = f"frame {frame.index + 1}" + (f" of {self.frames.count}" if self.frames.count else "")
        time = "" if frame.time_s is None else f", {frame.time_s:.2f} s"
        source = f"{self._name}, {number}{time}"
        if self._before is None:
            return with_first_frame(view, frame.image, source, self.frames.camera, self.frames.dock)
        return with_frame(view, frame.image, source)

    def read(self, view: View, frame: Frame) -> Analysis:
        """Search the frame that a view shows, and track the dock from the frame before."""
        tracked = self._tracker_for(view, frame).see(view.image, frame.time_s)
        self._before = frame.index
        self.trajectory.note(frame, tracked)
        return Analysis(view, chosen_by_track(tracked), TrackedFrame(frame, tracked, self.trajectory))

    def _tracker_for(self, view: View, frame: Frame) -> Tracker:
        """The present tracker; a new one after a jump, or when camera, dock or settings have changed."""
        searched_with = (view.camera, view.dock, view.settings)
        goes_on = self._before is not None and (frame.index == self._before + 1 or self.frames.is_live)
        if self._tracker is None or not goes_on or searched_with != self._searched_with:
            # Searching the whole picture gives a frame in the log the same numbers as the frame on its own.
            self._tracker = Tracker(view.camera, view.dock, view.settings, use_region=False)
            self._searched_with = searched_with
        return self._tracker


def chosen_by_track(tracked: Tracked) -> Estimate:
    """The frame's estimate, with the pose selected that the track prefers."""
    if tracked.selected_by != "tracking":
        return replace(tracked.estimate, message=tracked.message)
    chance = 100 * (tracked.track.probability or 0)
    why = f"which {tracked.track.age} frames make {chance:.1f} % likely"
    return select_pose(tracked.estimate, tracked.selected, "tracking", why)
