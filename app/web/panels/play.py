"""The tab Play: the sequence that is open, which static/timeline.js draws and steers, and how fast it is played."""

import itertools
import math
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import viser
from dockpose.app.inputs.sequences import FrameSource, choices, choose, sent
from dockpose.app.processing.analysis import COLUMNS, Analysis, TrackedFrame, Trajectory
from dockpose.app.processing.following import FrameFollower
from dockpose.app.processing.player import FramePlayer
from dockpose.app.state.scene import scene_of
from dockpose.app.web.panels.live import LiveControls
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import App, Panel
from dockpose.sources import Frames

NONE_CHOSEN = "(none)"


class SequenceController:
    """Holds one sequence at a time, and shows its frames through the page's App."""

    def __init__(self, stage: Any, given: FrameSource | None, root: Path | None) -> None:
        self._stage, self._given, self._root = stage, given, root
        self._lock = threading.Lock()
        self._source: FrameSource | None = None
        self.player: FramePlayer | None = None
        self.follower: FrameFollower | None = None

    @property
    def is_playing(self) -> bool:
        """Whether the sequence is playing now."""
        return self.player is not None and self.player.is_playing

    @property
    def name(self) -> str | None:
        """Name of the open sequence, if any."""
        return None if self._source is None else self._source.name

    @property
    def is_sent(self) -> bool:
        """Whether the open sequence was sent by a browser."""
        return self._source is not None and self._source.folder is not None

    def names(self) -> list[str]:
        """Return the names of the sequences that can be chosen."""
        return choices(self._given, self._root)

    def choose(self, name: Any, client: viser.ClientHandle) -> None:
        """Open a sequence in place of the open one; if that fails, say so and change nothing."""
        if name == NONE_CHOSEN:
            self.close()
            return
        self._try(lambda: choose(name, self._given, self._root, scene_of(self._stage.view)), client)

    def take(self, data: bytes, name: str, client: viser.ClientHandle) -> None:
        """Open an uploaded video, in the same way."""
        self._try(lambda: sent(data, name), client)

    def open_given(self) -> None:
        """Open the sequence given at the start, if any. Raises ValueError if it cannot be opened."""
        if self._given is not None:
            self.open(self._given)

    def open(self, source: FrameSource) -> None:
        """Show the first frame of a sequence; start playing if it is live."""
        frames = source.open(self.tell)
        self.close()
        with self._lock:
            self._source, self.follower = source, FrameFollower(frames, source.name, self.tell)
            self.player = FramePlayer(frames, self._stage.show_frame, self._stage.on_rest, self._show_error)
        self._stage.on_sequence(source.name)

    def play(self, is_playing: bool) -> None:
        """Play or pause."""
        if self.player is not None:
            self.player.play(is_playing)
            if not is_playing:
                self._stage.on_rest()

    def close(self) -> None:
        """Close the open sequence, if any."""
        with self._lock:
            player, source = self.player, self._source
            self.player = self.follower = self._source = None
        if player is not None and source is not None:
            player.close()
            source.discard()
            self._stage.on_sequence(None)

    def tell(self, sentence: str) -> None:
        """Report on the source: skipped frames, a stream lost or restored."""
        self._stage.notify("About the sequence", sentence, "yellow", None)

    def _try(self, resolving: Callable[[], FrameSource], client: viser.ClientHandle) -> None:
        if not self._stage.attempt(lambda: self.open(resolving()), client):
            self._stage.on_sequence(self.name)

    def _show_error(self, error: Exception) -> None:
        if isinstance(error, ValueError):
            self._stage.notify("The sequence ended", str(error), "red", None)
        else:
            self._stage.fail(error)
        self._stage.on_rest()


SURE = 0.999  # beyond it no more digits are shown
SPEEDS = {"1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0, "4": 4.0}
_SENT_AGAIN = 20  # frames before the present one that are sent with it, should a browser have missed some
_MOST_POINTS = 4000  # of a course as a whole
_SEEN, _PREDICTED, _LOST = range(3)
_TIME, _Z, _CHANCE, _IS_LOST = (COLUMNS.index(name) for name in ("time_s", "z_m", "probability", "lost"))


class SequencePanel(Panel):
    """Choice of the sequence, its speed, and words; the time line is sent the rest."""

    table = "sequence"

    def __init__(self, app: App) -> None:
        super().__init__(app)
        self._controller = app.sequence
        self._courses = itertools.count(1)
        self._course, self._newest = 0, None
        options = NONE_CHOSEN, *self._controller.names()
        self._choice = self.add(
            "dropdown", "choice", lambda client: self._controller.choose(self._choice.value, client), options=options
        )
        self._start = self.add("button", "start", self._open_first)
        self._speed = self.add(
            "dropdown", "speed", lambda client: self.set_speed(self._speed.value), options=tuple(SPEEDS)
        )
        self.gui.add_html('<dockpose-course id="sequence"></dockpose-course>')
        self._camera = LiveControls(app)
        app.live.put(timeline=self._numbers())
        self._show_choice(None)

    def welcome(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Let a new browser have the whole course so far."""
        self._tell_whole()

    def toggle(self) -> None:
        """Play, or pause."""
        if self._controller.player is not None:
            self._controller.play(not self._controller.player.is_playing)
            self._tell_now()

    def go_to(self, frame: int) -> None:
        """Show a frame, counted from 0; a live source has none to go to."""
        player = self._controller.player
        if player is not None and not player.frames.is_live:
            player.go_to(frame)

    def set_speed(self, speed: Any) -> None:
        """Play at one of ``SPEEDS``."""
        if speed in SPEEDS:
            self._speed.value = speed
            self._set_speed()
            self._tell_now()

    def reset(self, name: str | None) -> None:
        """Show that another sequence was opened, or none."""
        self._camera.reset()
        self._course, self._newest = next(self._courses), None
        self._show_choice(name)
        self._set_speed()
        self._tell_now()
        self._tell_whole()

    def _show_choice(self, name: str | None) -> None:
        player = self._controller.player
        names = (NONE_CHOSEN, *self._controller.names())
        shown = (*names, name) if name is not None and name not in names else names
        self._choice.options, self._choice.value = shown, name or NONE_CHOSEN
        self._start.visible, self._start.label = player is None, f"Play {self._controller.names()[0]}"
        self._speed.visible = player is not None and not player.frames.is_live

    def show(self, analysis: Analysis) -> None:
        """Show where in the sequence the frame is."""
        if analysis.tracked_frame is None or self._controller.player is None:
            return
        self._newest = analysis.tracked_frame
        self._camera.show(analysis)
        self.app.live.put(timeline=self._numbers())
        if not self._controller.is_playing:
            self._tell_whole()

    def _open_first(self, client: viser.ClientHandle) -> None:
        if self._controller.player is None:
            self._controller.choose(self._controller.names()[0], client)
            self._controller.play(True)
            self._tell_now()

    def _set_speed(self) -> None:
        if self._controller.player is not None:
            self._controller.player.set_speed(SPEEDS.get(self._speed.value, 1.0))

    def _tell_now(self) -> None:
        """Send what changed without a new frame, as that it plays."""
        with self.app.live.held:
            self.app.live.put(timeline=self._numbers())
            self.app.live.send()

    def _tell_whole(self) -> None:
        """Send the course as a whole, so that no browser lacks a part of it."""
        points = [] if self._newest is None else course_points(self._newest.trajectory)
        step = math.ceil(len(points) / _MOST_POINTS) or 1
        self.app.live.send_aside("course", {"course": self._course, "points": points[::step]})

    def _numbers(self) -> dict[str, Any]:
        player, newest = self._controller.player, self._newest
        if player is None:
            return {"course": self._course, "name": None, "words": "No sequence is chosen."}
        numbers = {
            "course": self._course,
            "name": self._controller.name,
            "count": player.frames.count,
            "isLive": player.frames.is_live,
            "isPlaying": player.is_playing,
            "speed": self._speed.value,
            "speeds": list(SPEEDS),
            "at": 0 if newest is None else newest.frame.index,
            "words": "" if newest is None else sequence_words(newest, player.frames),
        }
        last = numbers["at"]
        points = [] if newest is None else course_points(newest.trajectory, max(0, last - _SENT_AGAIN), last)
        return numbers | {"points": points}


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
            state += f"; the chosen pose is right with a probability of {chance}"
        state += "."
    missed = (frames.skipped, "corrupt"), (frames.dropped, "too fast")
    left_out = [f"{number} {what}" for number, what in missed if number]
    missing = f" Left out: {', '.join(left_out)}." if left_out else ""
    return f"Frame {frame.index + 1}{count}{time}. {state}{missing}"
