"""The frames of a sequence on the page, read one after the other."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from dockpose import Estimate, Tracker
from dockpose.app.drawing.colours import POSE_NAMES
from dockpose.app.inputs.sequences import Opened
from dockpose.app.processing.analysis import Analysis, TrackedFrame
from dockpose.app.processing.trajectory import Trajectory
from dockpose.app.state.view import View, with_frame
from dockpose.sources import Frame
from dockpose.tracking.tracker import Tracked


class FrameFollower:
    """Reads the frames of one sequence, each with the camera, dock and settings that the page has at that moment."""

    def __init__(self, opened: Opened) -> None:
        self._opened, self._frames = opened, opened.frames
        self._tracker: Tracker | None = None
        self._searched_with: tuple[Any, ...] = ()
        self._before: int | None = None
        self.trajectory = Trajectory()

    def view_of(self, view: View, frame: Frame) -> View:
        """The view that shows a frame in place of what is shown."""
        number = f"frame {frame.index + 1}" + (f" of {self._frames.count}" if self._frames.count else "")
        time = "" if frame.time_s is None else f", {frame.time_s:.2f} s"
        source = f"{self._opened.name}, {number}{time}"
        if self._before is None:
            return with_frame(view, frame.image, source, self._opened.camera, self._opened.dock)
        return with_frame(view, frame.image, source)

    def read(self, view: View, frame: Frame) -> Analysis:
        """Search the frame that a view shows, and follow the dock from the frame before."""
        tracked = self._tracker_for(view, frame).see(view.image, frame.time_s)
        self._before = frame.index
        self.trajectory.note(frame, tracked)
        found = chosen_by_track(tracked)
        return Analysis(view, found, TrackedFrame(frame, tracked, self.trajectory))

    def _tracker_for(self, view: View, frame: Frame) -> Tracker:
        """The tracker so far; a new one after a leap, or when anything else is searched for."""
        searched_with = (view.camera, view.dock, view.settings)
        goes_on = self._before is not None and (frame.index == self._before + 1 or self._frames.is_live)
        if self._tracker is None or not goes_on or searched_with != self._searched_with:
            # In the whole picture, so that a frame that is taken down gives the same numbers by itself.
            self._tracker = Tracker(view.camera, view.dock, view.settings, use_region=False)
            self._searched_with = searched_with
        return self._tracker


def chosen_by_track(tracked: Tracked) -> Estimate:
    """The frame's estimate with the pose selected that the frames before speak for."""
    found, selected = tracked.estimate, tracked.selected
    if found.choice is None or selected is None or tracked.selected_by != "tracking":
        return found
    depth_cm = 100 * found.choice.candidates[selected].position_m[2]
    chance = 100 * (tracked.track.probability or 0)
    message = (
        f"{found.lights_on_ring} lights on the ring; the dock is {depth_cm:.1f} cm ahead by pose {POSE_NAMES[selected]}"
        f", which {tracked.track.age} frames make {chance:.1f} % likely."
    )
    return replace(found, choice=replace(found.choice, selected=selected, selected_by="tracking"), message=message)
