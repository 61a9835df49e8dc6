"""Sequences: which one is played, its buttons, and its course over time."""

from __future__ import annotations

from html import escape

import viser
from dockpose.app.processing.analysis import Analysis, TrackedFrame
from dockpose.app.web.charts.trajectory import TrajectoryCharts
from dockpose.app.web.html import SMALL
from dockpose.app.web.sequence import NONE_CHOSEN, SequenceController
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.widgets import Panel, add_upload_button, on_click, on_person
from dockpose.sources import Frames

SURE = 0.999  # beyond it no more digits are told
SPEEDS = {"1/4": 0.25, "1/2": 0.5, "1": 1.0, "2": 2.0, "4": 4.0}


class SequencePanel(Panel):
    """Play, pause, step, speed and a slider of frames; charts over time below."""

    def __init__(self, gui: viser.GuiApi, controller: SequenceController) -> None:
        self._controller = controller
        self._area = gui.add_folder("Sequence", expand_by_default=True)
        with self._area:
            self._choice = gui.add_dropdown(
                "Sequence",
                (NONE_CHOSEN, *controller.names()),
                hint="What was given when dockpose was started, videos and pictures below its folder (--folder), or a "
                "simulated course through the scene under Source.",
                order=1,
            )
            self._play = gui.add_button(
                "Play", icon=viser.Icon.PLAYER_PLAY, hint="Go on, or pause. Key: K.", order=3, disabled=True
            )
            self._steps = gui.add_button_group(
                "Step", ("Back", "Forward"), hint="Pause, and show the frame before or after.", order=4, visible=False
            )
            self._frame = gui.add_slider(
                "Frame", min=1, max=2, step=1, initial_value=1, hint="Go to a frame.", order=5, visible=False
            )
            self._speed = gui.add_dropdown(
                "Speed (times)",
                tuple(SPEEDS),
                initial_value="1",
                hint="How many times as fast as the frames were taken; no frame of a recording is left out.",
                order=6,
            )
            self._words = gui.add_html("", order=7)
        self._charts = TrajectoryCharts(gui)
        on_click(self._play, lambda client: self.toggle())
        on_person(self._choice.on_update, lambda client: controller.choose(self._choice.value, client))
        on_person(self._steps.on_click, lambda client: self._step(1 if self._steps.value == "Forward" else -1))
        on_person(self._frame.on_update, lambda client: self._go_to())
        on_person(self._speed.on_update, lambda client: self._set_speed())
        self.reset(None)

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its button to send a video."""
        add_upload_button(
            self._area,
            client,
            uploads,
            self._controller.take,
            "Upload a video",
            "MP4, AVI, MOV, MKV or WebM. It stays on this machine, and is deleted when another sequence is chosen.",
            mime_type="video/*",
            order=2,
        )

    def toggle(self) -> None:
        """Play, or pause."""
        if self._controller.player is not None:
            self._controller.play(not self._controller.player.is_playing)
            self.follow_player()

    def reset(self, name: str | None) -> None:
        """Show that another sequence was opened, or none."""
        player = self._controller.player
        self._charts.hide()
        names = (NONE_CHOSEN, *self._controller.names())
        shown = (*names, name) if name is not None and name not in names else names
        self._choice.options, self._choice.value = shown, name or NONE_CHOSEN
        is_recording = player is not None and not player.frames.is_live
        self._play.disabled = player is None
        self._steps.visible = self._frame.visible = self._speed.visible = is_recording
        if player is not None and player.frames.count is not None:
            self._frame.max = max(2, player.frames.count)
        self._words.content = _small("No sequence is chosen." if player is None else "")
        self._set_speed()
        self.follow_player()

    def follow_player(self) -> None:
        """Let the button say what it would do."""
        player = self._controller.player
        is_playing = player is not None and player.is_playing
        self._play.label, self._play.icon = (
            ("Pause", viser.Icon.PLAYER_PAUSE) if is_playing else ("Play", viser.Icon.PLAYER_PLAY)
        )

    def show(self, analysis: Analysis) -> None:
        """Show where in the sequence the frame is, and the course so far."""
        player = self._controller.player
        self.follow_player()
        if analysis.tracked_frame is None or player is None:
            return
        if not player.frames.is_live:
            self._frame.value = analysis.tracked_frame.frame.index + 1
        self._words.content = _small(sequence_words(analysis.tracked_frame, player.frames))
        self._charts.show(analysis.tracked_frame.trajectory)

    def _step(self, by: int) -> None:
        if self._controller.player is not None:
            self._controller.player.step(by)

    def _go_to(self) -> None:
        if self._controller.player is not None and isinstance(self._frame.value, (int, float)):
            self._controller.player.go_to(int(self._frame.value) - 1)

    def _set_speed(self) -> None:
        if self._controller.player is not None:
            self._controller.player.set_speed(SPEEDS.get(self._speed.value, 1.0))


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
        state = f"Followed for {track.age} frame{'' if track.age == 1 else 's'}{_chance_words(track.probability)}."
    left_out = [
        f"{number} {what}" for number, what in ((frames.skipped, "corrupt"), (frames.dropped, "too fast")) if number
    ]
    missing = f" Left out: {', '.join(left_out)}." if left_out else ""
    return f"Frame {frame.index + 1}{count}{time}. {state}{missing}"


def _chance_words(probability: float | None) -> str:
    if probability is None:
        return ""
    chance = f"{100 * probability:.1f} %" if probability < SURE else f"over {100 * SURE:g} %"
    return f"; the chosen pose is right with a probability of {chance}"


def _small(text: str) -> str:
    return f'<div id="sequence" style="{SMALL}">{escape(text)}</div>'
