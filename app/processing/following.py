"""Following the dock from frame to frame: search, track and trust, for commands, the page and the ROS node alike."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import msgspec
from dockpose import Camera, Dock, Estimate, Settings, Tracker
from dockpose.app.processing.analysis import Analysis, TrackedFrame, Trajectory, select_pose
from dockpose.app.processing.masks import AutoMasks
from dockpose.app.state.trust import Trust, trust_of
from dockpose.app.state.view import View, with_first_frame, with_frame
from dockpose.lights.by_hand import ByHand
from dockpose.pose.choice import DECIDED
from dockpose.sources import ExposureWatch, Frame, Frames
from dockpose.tracking.search import Search
from dockpose.tracking.tracker import Tracked


@dataclass(frozen=True, eq=False)
class Followed:
    """One frame followed; ``estimate`` is the frame's, with the pose selected that the track prefers."""

    tracked: Tracked
    estimate: Estimate

    @cached_property
    def trust(self) -> Trust:
        """How far the result can be trusted, with the probability that the track gives."""
        return trust_of(self.estimate, self.tracked)


class Following:
    """Follows one dock from frame to frame; ``tell`` hears of masks and exposure."""

    def __init__(
        self, camera: Camera, dock: Dock, settings: Settings, tell: Callable[[str], None], *, is_live: bool = False
    ) -> None:
        self._camera, self._dock, self._tell = camera, dock, tell
        self._tracker = Tracker(camera, dock, settings)
        self._search = Search(camera, dock, is_live=is_live)
        self._watch = ExposureWatch() if is_live else None
        self.masks = AutoMasks(settings, tell)
        self.settings = settings  # with the masks found so far

    def see(self, frame: Frame, by_hand: ByHand | None = None) -> Followed:
        """Search the next frame, or take the lights that somebody has set in it, and update the track."""
        settings = self.masks.settings_for(frame.image.shape, self._camera, self._dock)
        lights = {} if by_hand is None else msgspec.structs.asdict(by_hand)
        found = self._search.see(frame.image, frame.index, frame.time_s, settings, **lights)
        self.masks.see(found, f"{frame.name} frame {frame.index}")
        self.settings = self.masks.settings_for(frame.image.shape, self._camera, self._dock)
        if self._watch is not None and (sentence := self._watch.see(frame, found)):
            self._tell(f"{frame.name}: {sentence}")
        return self.follow(found, frame.time_s)

    def follow(self, found: Estimate, time_s: float | None) -> Followed:
        """Update the track with the next frame, which was searched elsewhere."""
        tracked = self._tracker.follow(found, time_s)
        return Followed(tracked, chosen_by_track(tracked))


class FrameFollower:
    """Analyses the frames of one sequence, each with the camera, dock and settings that the page has by then."""

    def __init__(self, frames: Frames, name: str, tell: Callable[[str], None]) -> None:
        self.frames, self._name, self._tell = frames, name, tell
        self._following: Following | None = None
        self._searched_with: tuple[Any, ...] = ()
        self._before: int | None = None
        self._frame: Frame | None = None
        self._lights: dict[int, ByHand] = {}  # that the operator set, by frame
        self.trajectory = Trajectory()

    def leaves_out(self, view: View, frame: Frame) -> bool:
        """Whether the size of a later frame is none for which the camera of the view can be."""
        is_known = self._before is not None and view.camera_of != "guess"
        return is_known and not any(self.frames.fitting([frame], view.camera))

    def view_of(self, view: View, frame: Frame) -> View:
        """Return the view with this frame as its picture."""
        number = f"frame {frame.index + 1}" + (f" of {self.frames.count}" if self.frames.count else "")
        time = "" if frame.time_s is None else f", {frame.time_s:.2f} s"
        source = f"{self._name}, {number}{time}"
        if self._before is None:
            return with_first_frame(view, frame.image, source, self.frames.camera, self.frames.dock)
        return replace(with_frame(view, frame.image, source), set_lights=self._lights.get(frame.index))

    def takes(self, view: View) -> Analysis | None:
        """Begin a new track by the lights that were set in the frame that a view shows; None where none are or were."""
        frame = self._frame
        if frame is None or view.list_name != "sequence" or view.image is not frame.image:
            return None
        before = self._lights.pop(frame.index, None)
        if view.set_lights is not None:
            self._lights[frame.index] = view.set_lights
        elif before is None:
            return None
        self._following = None
        return self.read(view, frame)

    def read(self, view: View, frame: Frame) -> Analysis:
        """Search the frame that a view shows, and track the dock from the frame before."""
        followed = self._following_for(view, frame).see(replace(frame, image=view.image), view.set_lights)
        self._frame, self._before = frame, frame.index
        self.trajectory.note(frame, followed.tracked)
        return Analysis(view, followed.estimate, TrackedFrame(frame, followed.tracked, self.trajectory))

    def _following_for(self, view: View, frame: Frame) -> Following:
        """What follows the dock now; a new track begins after a jump, or when camera, dock or settings have changed."""
        searched_with = (view.camera, view.dock, view.settings)
        goes_on = self._before is not None and (frame.index == self._before + 1 or self.frames.is_live)
        is_same = searched_with == self._searched_with
        if self._following is None or not goes_on or not is_same:
            # What is burnt in stays masked after a jump.
            settings = self._following.settings if self._following is not None and is_same else view.settings
            self._following = Following(view.camera, view.dock, settings, self._tell, is_live=self.frames.is_live)
            self._searched_with = searched_with
        return self._following


def chosen_by_track(tracked: Tracked) -> Estimate:
    """The frame's estimate, with the pose selected that the track prefers."""
    track, choice, by = tracked.track, tracked.estimate.choice, tracked.selected_by
    # Where the frames together doubt the pose that this one is sure of, their probability is reported alone.
    is_doubted = track.probability is not None and track.probability < DECIDED and track.age > 1 and not track.predicted
    if by != "tracking" and not (is_doubted and choice is not None and not choice.coincide):
        return replace(tracked.estimate, message=tracked.message)
    why = f"which {track.age} frames make {100 * (track.probability or 0):.1f} % likely"
    return select_pose(tracked.estimate, tracked.index, by or "tracking", why)
