"""What panels know of the page: the view that all browsers show, how to change it, and how to tell people something."""

import contextlib
import threading
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import viser
from dockpose import Camera, Dock
from dockpose.app.inputs.received import UploadStore
from dockpose.app.inputs.sequences import FrameSource, given, is_sequence, of_size
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import FramePlayer, LatestWorker
from dockpose.app.state.camera import kept
from dockpose.app.state.preferences import Memory, with_last_settings
from dockpose.app.state.tank import Tanks
from dockpose.app.state.undo import History, difference_words
from dockpose.app.state.view import View, open_source
from dockpose.app.web.choices import Choices
from dockpose.app.web.live import LivePage
from dockpose.app.web.notifications import REFUSED, Colour, Notifications
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.server.guard import Guard
from dockpose.app.web.server.journal import LOG
from dockpose.app.web.server.options import Options
from dockpose.app.web.server.start import open_server, reachable_hosts, token_for
from dockpose.app.web.work import BackgroundWork
from dockpose.sources import Frame

FRAME_LIMIT_S = 60.0  # a frame of a sequence that takes longer no longer holds up the next


class Page:
    """The server, the view and what is kept of it; :class:`dockpose.app.web.app.App` works on it and shows it."""

    def __init__(
        self, source: str | None, camera: Camera | None, dock: Dock | None, host: str, port: int, options: Options
    ) -> None:
        self.options, self.memory = options, Memory(options.remember_in)
        self.history, self.tanks = History(), Tanks(options.remember_in)
        self.given = given(source, camera, dock, options.topic) if source is not None and is_sequence(source) else None
        self.beside = None if source is None or self.given is not None else Path(source).resolve().parent
        self._view = self._first_view(source, camera, dock)
        keep_in = options.remember_in if port else None  # any free port is another one the next time
        token = token_for(keep_in, str(port))
        self._guard = Guard(host, options.allow_hosts, token, options.allow_frames)
        self.server = open_server(host, port, self._guard)
        self.live, self.closing = LivePage(self.server), contextlib.ExitStack()  # which stops whatever runs
        self.kept, self._notices, self.choices = UploadStore(), Notifications(), Choices()
        self._lock = threading.RLock()
        self.scene = Scene3D(self.server)
        self.work = BackgroundWork(self.server.gui, self.report, self.notify)
        self.closing.callback(self.work.close)
        self.opened: FrameSource | None = None  # the sequence that is open
        self.player: FramePlayer | None = None  # which plays it
        self.close_sequence = lambda: None  # replaced by what can
        self.panels: Sequence[Any] = ()  # which have controls and show results
        self.newest: Analysis | None = None  # of the frames of a sequence
        self.worker: LatestWorker[View | Frame | None] = LatestWorker(self.work_on, self.fail)

    def _first_view(self, source: str | None, camera: Camera | None, dock: Dock | None) -> View:
        tank = self.memory.now.tank
        if self.given is not None:
            tank = tank.with_given(camera, dock)
            self.given = replace(self.given, capture=of_size(self.options.capture, tank.camera))
            view = open_source(None, None, None, tank)
        else:
            is_left_open = source is None and camera is None and dock is None
            view = (self.memory.last_view(tank) if is_left_open else None) or open_source(source, camera, dock, tank)
        return with_last_settings(self.memory.with_lights(view), self.memory.now.settings)

    def work_on(self, job: View | Frame | None) -> None:
        """Work on a view, on a frame, or show all of the newest frame; called from the worker's thread."""
        raise NotImplementedError

    def load(self, view: View) -> None:
        """Set all controls to the values of a view."""
        for panel in self.panels:
            panel.load(view)
        self.choices.put_back()

    def show_frame(self, frame: Frame) -> None:
        """Search and show a frame of the sequence that is open; returns when that is done."""
        self.worker.submit(frame)
        self.worker.wait_until_idle(FRAME_LIMIT_S)

    def forget_frames(self) -> None:
        """Forget the frames that were shown: another sequence was opened, or none."""
        self.newest = None
        self.history.forget()

    def on_rest(self) -> None:
        """Show the frame in full; while playing, only its picture may have been shown."""
        if self.newest is not None:
            self.worker.submit(None)

    @property
    def port(self) -> int:
        """The port it listens on."""
        return self.server.get_port()

    @property
    def address(self) -> str:
        """Address to open in a browser on this machine, with the access token."""
        return self.addresses()[0]

    def addresses(self) -> list[str]:
        """Addresses to open in a browser: on this machine first, then, where it listens to them, on others."""
        return [
            f"http://{host}:{self.port}/?token={self._guard.token}" for host in reachable_hosts(self.server.get_host())
        ]

    @property
    def view(self) -> View:
        """The current view."""
        with self._lock:
            return self._view

    @property
    def is_playing(self) -> bool:
        """Whether a sequence is playing now."""
        return self.player is not None and self.player.is_playing

    def change(
        self, function: Callable[[View], View], client: viser.ClientHandle | None = None, *, reload: bool = False
    ) -> None:
        """Apply a function to the view and have the result worked on; where it refuses, say so and keep the view."""
        with self._lock:
            before, choice = self._view, self.choices.put_back()

            def apply() -> None:
                self._view = function(before)

            is_done = self.attempt(apply, client)
            self.choices.taken(choice)
            after = kept(before, self._view)
            if after.image is not before.image:
                after = self.memory.with_lights(after)
            elif after.set_lights is not before.set_lights:
                self.memory.keep_lights(after)
            self._view = after
            if reload or not is_done:
                self.load(after)
            if after is not before:
                self._notices.withdraw()
                self.history.note(before, after)
                if not (self.is_playing and after.list_name == "sequence"):  # else the next frame has it
                    self.worker.submit(after)
        if before.list_name == "sequence" != after.list_name:
            self.close_sequence()

    def go_back(self, step: Callable[[View], View], title: str, client: viser.ClientHandle) -> None:
        """Undo or redo, and say what that changed."""
        told: list[str] = []

        def stepped(view: View) -> View:
            after = step(view)
            told.append(difference_words(view, after) or "There is nothing more.")
            return after

        self.change(stepped, client, reload=True)
        for sentence in told:
            self.notify(title, sentence, "green", client)

    def attempt(self, act: Callable[[], object], client: viser.ClientHandle | None) -> bool:
        """Do what a person asked for; False if it failed, after saying so."""
        try:
            act()
        except Exception as error:
            self.report(error, client)
            return False
        return True

    def report(self, error: Exception, client: viser.ClientHandle | None) -> None:
        """Say why something cannot be done, or, in the terminal and in all browsers, what went wrong."""
        if isinstance(error, ValueError):
            self.notify(REFUSED, str(error), "red", client)
        else:
            self.fail(error)

    def fail(self, error: Exception) -> None:
        """Report an unexpected error in the terminal and in all browsers."""
        LOG.error("%s: %s", type(error).__name__, error)
        self.notify("That went wrong", f"{type(error).__name__}: {error}", "red", None)

    def notify(self, title: str, sentence: str, colour: Colour, client: viser.ClientHandle | None) -> None:
        """Show a notification in one browser, or in all."""
        for one in [client] if client is not None else self.server.get_clients().values():
            self._notices.show(title, sentence, colour, one)
