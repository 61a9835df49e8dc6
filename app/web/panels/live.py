"""A camera or stream that is open: what it gives, what it is asked for, its exposure, and its recording."""

import re
import time
from dataclasses import replace
from datetime import datetime
from html import escape
from pathlib import Path
from typing import Any

from dockpose.app.drawing.numbers import count
from dockpose.app.errors import UserError
from dockpose.app.export.recording import ENDING, Recording
from dockpose.app.inputs.received import safe_name
from dockpose.app.inputs.sequences import capture_from
from dockpose.app.processing.analysis import Analysis
from dockpose.app.web.html import small
from dockpose.app.web.page import Page
from dockpose.app.web.server.options import RECORDINGS_FOLDER
from dockpose.app.web.widgets import Panel
from dockpose.sources import ExposureWatch, Live

CAMERA = "camera "  # with its number, the name of one
_RED = "#e03131"
_LARGEST_DOWNLOAD_BYTES = 2**29  # a browser holds a file in its memory; a larger one is fetched from its folder
_TOLD_EVERY_S = 0.5


class LiveControls(Panel):
    """Controls of the live source that is open; hidden while none is."""

    table = "live"

    def __init__(self, app: Page) -> None:
        super().__init__(app)
        self._recording: Recording | None = None
        self._recorded: Path | None = None
        self._summary = ""
        self._began_s = self._told_s = 0.0
        self._watch = ExposureWatch()
        self._words = self.gui.add_html("", visible=False)
        self._record = self.add("button", "record", self.trying(lambda client: self.record()))
        self._download = self.add("button", "download", self.trying(self._send))
        self._sending: Any = None
        if app.options.autopilot is not None:
            self._sending = self.add("checkbox", "sending", lambda client: self._switch(), visible=False)
        self._boxes = {
            name: self.gui.add_text(**box, initial_value="", visible=False) for name, box in self.said["boxes"].items()
        }
        self._ask = self.add("button", "ask", self.trying(lambda client: self.ask()))
        app.closing.callback(self.stop)

    def _source(self) -> Live | None:
        player = self.app.player
        return player.frames if player is not None and isinstance(player.frames, Live) else None

    def reset(self) -> None:
        """Show the controls of what is open now, and finish the recording of what was open before."""
        self.stop()
        live = self._source()
        self._watch, self._summary = ExposureWatch(), ""
        self._words.visible = self._record.visible = live is not None
        self._download.visible = False
        if (autopilot := self.app.options.autopilot) is not None:
            self._sending.visible, self._sending.value = live is not None, autopilot.is_on
        is_camera = live is not None and live.source.startswith(CAMERA)
        for control in (*self._boxes.values(), self._ask):
            control.visible = is_camera
        if live is not None and is_camera:
            for name, box in self._boxes.items():
                wished = getattr(live.settings, name)
                box.value = "" if wished is None else wished if name == "format" else f"{wished:g}"
        self._tell()

    def show(self, analysis: Analysis) -> None:
        """Judge a frame's exposure, and say how the source and its recording are."""
        if self._source() is None or analysis.tracked_frame is None:
            return
        sentence = self._watch.see(analysis.tracked_frame.frame, analysis.estimate)
        if sentence:
            self.app.notify("About the exposure", sentence, "yellow", None)
        if sentence or time.monotonic() - self._told_s >= _TOLD_EVERY_S:
            self._tell()

    def ask(self) -> None:
        """Ask the camera for what is typed. Raises UserError for what is no number."""
        labels = {name: box["label"] for name, box in self.said["boxes"].items()}
        capture = capture_from({name: box.value for name, box in self._boxes.items()}, labels)
        live = self._source()
        if live is not None:
            live.ask(replace(capture, width=live.settings.width, height=live.settings.height))

    def record(self) -> None:
        """Begin a recording, or finish the one that goes on. Raises UserError where it cannot be written."""
        live = self._source()
        if live is None or self._recording is not None:
            self.stop()
            return
        folder = self.app.options.sessions.with_name(RECORDINGS_FOLDER)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise UserError(f"{folder}: cannot be made ({error.strerror or error})") from error
        self._recording = Recording(recording_path(folder, live.source), self._tell_of_recording)
        self._began_s = time.monotonic()
        live.on_arrival = self._recording.take
        self._record.label, self._download.visible, self._summary = "Stop recording", False, ""
        self._tell()

    def stop(self) -> None:
        """Finish the recording, if there is one."""
        recording, live = self._recording, self._source()
        if recording is None:
            return
        if live is not None:
            live.on_arrival = None
        recording.close()
        self._recording, self._record.label = None, self.said["record"]["label"]
        self._recorded, self._summary = recording.path, f"{recording.summary()}."
        self._download.visible = recording.path.exists() and recording.size_bytes <= _LARGEST_DOWNLOAD_BYTES
        self._tell()

    def _switch(self) -> None:
        if self.app.options.autopilot is not None:
            self.app.options.autopilot.is_on = self._sending.value
            self._tell()

    def _tell(self) -> None:
        self._told_s = time.monotonic()
        live, recording, parts = self._source(), self._recording, []
        if live is not None:
            parts.append(f"<b>{escape(live.source)}</b>: {escape(live.about or 'does not say what it gives')}")
            if self._watch.hint.sentence:
                parts.append(f'<b id="exposure-hint">⚠ {escape(self._watch.hint.sentence)}</b>')
        if recording is not None:
            words = recording_words(recording, time.monotonic() - self._began_s)
            parts.append(f'<b id="recording" style="color: {_RED}">● {escape(words)}</b>')
        elif self._summary:
            parts.append(f'<span id="recorded">{escape(self._summary)}</span>')
        autopilot = self.app.options.autopilot
        if live is not None and autopilot is not None:
            words = f"MAVLink to {autopilot.address}: {autopilot.words if autopilot.is_on else 'nothing, switched off'}"
            sent = f"{count(autopilot.sent, 'frame')} sent, {autopilot.refused} not"
            parts.append(f'<span id="autopilot">{escape(words)} ({sent})</span>')
        content = small("<br>".join(parts), 'id="live-source"')
        if content != self._words.content:
            self._words.content = content

    def _tell_of_recording(self, sentence: str) -> None:
        if self._recording is not None and self._recording.has_failed:
            self.app.notify("About the recording", sentence, "yellow", None)

    def _send(self, client: Any) -> None:
        if self._recorded is None:
            return
        try:
            content = self._recorded.read_bytes()
        except OSError as error:
            raise UserError(f"{self._recorded}: cannot be read ({error.strerror or error})") from error
        client.send_file_download(self._recorded.name, content, save_immediately=True)


def recording_path(folder: Path, source: str, now: datetime | None = None) -> Path:
    """Return a name for a recording that begins now, and that no file has yet; without the password of an address."""
    moment = (now or datetime.now()).strftime("%Y-%m-%d_%H-%M-%S")
    taken = [path.name for path in folder.iterdir()]
    source = re.sub(r"//[^/]*@", "//", source)
    return folder / safe_name(f"{moment}_{source}", ENDING, taken=taken, otherwise="recording")


def recording_words(recording: Recording, elapsed_s: float) -> str:
    """How far a recording is: "Recording: 120 frames in 4 s, 5.6 MB"."""
    frames = "1 frame" if recording.frames == 1 else f"{recording.frames} frames"
    if recording.has_failed:
        return f"No longer recording, after {frames}; press Stop recording"
    missing = f"; {recording.missing} missing, which there was no time to write" if recording.missing else ""
    return f"Recording: {frames} in {elapsed_s:.0f} s, {recording.size_bytes / 1e6:.1f} MB{missing}"
