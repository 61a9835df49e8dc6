"""Of the tab Source: the sequence that is open, which static/timeline.js draws and steers, and how fast it plays."""

import itertools
import math
import threading
from collections.abc import Callable
from html import escape
from typing import Any

from dockpose.app.inputs.sequences import FrameSource, choices, choose, sent
from dockpose.app.processing.analysis import COLUMNS, Analysis, TrackedFrame, Trajectory
from dockpose.app.processing.background import FramePlayer
from dockpose.app.processing.following import FrameFollower
from dockpose.app.state.scene import scene_of
from dockpose.app.web.choices import Client
from dockpose.app.web.page import Page
from dockpose.app.web.panels.live import LiveControls
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import Panel, offer
from dockpose.sources import Frames

NONE_CHOSEN = "(none)"
SURE = 0.999  # beyond it no more digits are shown
SPEEDS = {"1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0, "4": 4.0}
_SENT_AGAIN = 20  # frames before the present one that are sent with it, should a browser have missed some
_MOST_POINTS = 4000  # of a course as a whole
_SEEN, _PREDICTED, _LOST = range(3)
_TIME, _Z, _CHANCE, _IS_LOST = (COLUMNS.index(name) for name in ("time_s", "z_m", "probability", "lost"))


class SequencePanel(Panel):
    """Holds one sequence at a time; its choice, speed and words. The time line is sent the rest."""

    table = "sequence"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._lock = threading.Lock()
        self.follower: FrameFollower | None = None
        self._courses = itertools.count(1)
        self._course, self._newest = 0, None
        self._speed = "1"
        area = self.gui.add_folder(None)
        with area:
            choose = lambda client: self.choose(self._choice.value, client)  # noqa: E731
            self._choice = self.add("dropdown", "choice", choose, options=(NONE_CHOSEN,))
        self.add_upload(area, "upload", self.take)
        self.gui.add_html('<dockpose-live name="sequence" id="sequence"></dockpose-live>')
        self._camera = None if app.given is None else LiveControls(app)  # else nothing live can be opened
        self._put_numbers()
        self._show_choice()
        app.close_sequence = self.close

    def choose(self, name: Any, client: Client) -> None:
        """Open a sequence in place of the open one; if that fails, say so and change nothing."""
        if name == NONE_CHOSEN:
            self.close()
            return
        given, root, scene = self.app.given, self.app.options.folder, scene_of(self.app.view)
        self._try(lambda: choose(name, given, root, scene), client)

    def take(self, data: bytes, name: str, client: Client) -> None:
        """Open an uploaded video, in the same way."""
        self._try(lambda: sent(data, name), client)

    def _try(self, resolving: Callable[[], FrameSource], client: Client) -> None:
        if not self.app.attempt(lambda: self.open(resolving()), client):
            self._reset()

    def open(self, source: FrameSource) -> None:
        """Show the first frame of a sequence; start playing if it is live. Raises ValueError if it cannot be opened."""
        frames = source.open(self._tell)
        self.close()
        with self._lock:
            self.app.opened, self.follower = source, FrameFollower(frames, source.name, self._tell)
            self.app.player = FramePlayer(frames, self.app.show_frame, self.app.on_rest, self._show_error)
        self._reset()

    def play(self, is_playing: bool) -> None:
        """Play or pause."""
        if self.app.player is not None:
            self.app.player.play(is_playing)
            if not is_playing:
                self.app.on_rest()

    def close(self) -> None:
        """Close the open sequence, if any."""
        with self._lock:
            player, source = self.app.player, self.app.opened
            self.app.player = self.follower = self.app.opened = None
        if player is not None and source is not None:
            player.close()
            source.discard()
            self._reset()

    def welcome(self, client: Client, uploads: ClientUploads) -> None:
        """Let a new browser have the whole course so far."""
        super().welcome(client, uploads)
        self._tell_whole()

    def toggle(self, client: Client) -> None:
        """Play, or pause; where no sequence is open, the first of those that can be."""
        if self.app.player is None:
            self.choose(choices(self.app.given, self.app.options.folder)[0], client)
        if self.app.player is not None:
            self.play(not self.app.player.is_playing)
            self._tell_now()

    def go_to(self, frame: int) -> None:
        """Show a frame, counted from 0; a live source has none to go to."""
        if self.app.player is not None and not self.app.player.frames.is_live:
            self.app.player.go_to(frame)

    def set_speed(self, speed: Any) -> None:
        """Play at one of ``SPEEDS``."""
        if speed in SPEEDS:
            self._speed = speed
            self._set_speed()
            self._tell_now()

    def show(self, analysis: Analysis) -> None:
        """Show where in the sequence the frame is."""
        if analysis.tracked_frame is None or self.app.player is None:
            return
        self._newest = analysis.tracked_frame
        if self._camera is not None:
            self._camera.show(analysis)
        self._put_numbers()
        if not self.app.is_playing:
            self._tell_whole()

    def _reset(self) -> None:
        """Show that another sequence was opened, or none."""
        self.app.forget_frames()
        if self._camera is not None:
            self._camera.reset()
        self._course, self._newest = next(self._courses), None
        self._show_choice()
        self._set_speed()
        self._tell_now()
        self._tell_whole()

    def _show_choice(self) -> None:
        source, names = self.app.opened, choices(self.app.given, self.app.options.folder)
        shown = names if source is None or source.name in names else [*names, source.name]
        offer(self._choice, (NONE_CHOSEN, *shown), NONE_CHOSEN if source is None else source.name)

    def _set_speed(self) -> None:
        if self.app.player is not None:
            self.app.player.set_speed(SPEEDS[self._speed])

    def _tell(self, sentence: str) -> None:
        """Report on the source: skipped frames, a stream lost or restored."""
        self.app.notify("About the sequence", sentence, "yellow", None)

    def _show_error(self, error: Exception) -> None:
        if isinstance(error, ValueError):
            self.app.notify("The sequence ended", str(error), "red", None)
        else:
            self.app.fail(error)
        self.app.on_rest()

    def _tell_now(self) -> None:
        """Send what changed without a new frame, as that it plays."""
        with self.app.live.held:
            self._put_numbers()
            self.app.live.send()

    def _tell_whole(self) -> None:
        """Send the course as a whole, so that no browser lacks a part of it."""
        points = [] if self._newest is None else course_points(self._newest.trajectory)
        step = math.ceil(len(points) / _MOST_POINTS) or 1
        self.app.live.send_aside("course", {"course": self._course, "points": points[::step]})

    def _put_numbers(self) -> None:
        """Put what the time line draws, and the words on the frame, into the next message."""
        player, newest = self.app.player, self._newest
        words = "No sequence is open. Choose one here, or send a video." if player is None else ""
        if player is not None and newest is not None:
            words = sequence_words(newest, player.frames)
        self.app.live.put_html("sequence", escape(words))
        self.app.live.put(timeline=self._numbers())

    def _numbers(self) -> dict[str, Any]:
        player, source, newest = self.app.player, self.app.opened, self._newest
        if player is None or source is None:
            return {"course": self._course, "name": None}
        at, points = 0, []
        if newest is not None:
            at = newest.frame.index
            points = course_points(newest.trajectory, max(0, at - _SENT_AGAIN), at)
        return {
            "course": self._course,
            "name": source.name,
            "count": player.frames.count,
            "isLive": player.frames.is_live,
            "isPlaying": player.is_playing,
            "speed": self._speed,
            "speeds": list(SPEEDS),
            "at": at,
            "points": points,
        }


def course_points(trajectory: Trajectory, first: int = 0, last: int | None = None) -> list[list[float | None]]:
    """Return of each frame its number, time (s), z (cm) and probability, and whether it was seen, predicted or lost."""
    points = []
    for index, row in trajectory.rows(first, last):
        z_cm = _rounded(100 * row[_Z], 2)
        state = _SEEN if not row[_IS_LOST] else _LOST if z_cm is None else _PREDICTED
        points.append([index, _rounded(row[_TIME], 3), z_cm, _rounded(row[_CHANCE], 4), state])
    return points


def _rounded(value: float, digits: int) -> float | None:
    return None if math.isnan(value) else round(value, digits)


def sequence_words(tracked_frame: TrackedFrame, frames: Frames) -> str:
    """Where in the sequence a frame is, and how the dock is followed there."""
    frame, track = tracked_frame.frame, tracked_frame.tracked.track
    count = "" if frames.count is None else f" of {frames.count}"
    time = "" if frame.time_s is None else f" at {frame.time_s:.2f} s"
    if track.lost:
        state = "The dock is lost: it was not seen yet, or not for too long."
    elif track.predicted:
        state = "The dock is not seen in this frame; its place is predicted from those before."
    else:
        state = f"Followed for {track.age} frame{'' if track.age == 1 else 's'}"
        if track.probability is not None:
            chance = f"{100 * track.probability:.1f} %" if track.probability < SURE else f"over {100 * SURE:g} %"
            state += f"; the chosen pose is {chance} likely"
        state += "."
    missed = (frames.skipped, "corrupt"), (frames.dropped, "too fast")
    left_out = [f"{number} {what}" for number, what in missed if number]
    missing = f" Left out: {', '.join(left_out)}." if left_out else ""
    return f"Frame {frame.index + 1}{count}{time}. {state}{missing}"
