"""The page in the browser: a viser server, its panels and its scene, and the worker behind them."""

import contextlib
import threading
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import viser
from dockpose import Camera, Dock
from dockpose.app.inputs.received import UploadStore
from dockpose.app.inputs.sequences import given, is_sequence, of_size
from dockpose.app.processing.analysis import Analysis, analyse
from dockpose.app.processing.background import LatestWorker
from dockpose.app.state.camera import kept
from dockpose.app.state.preferences import Memory, with_last_settings
from dockpose.app.state.tank import Tanks
from dockpose.app.state.undo import History, difference_words
from dockpose.app.state.view import View, open_source
from dockpose.app.web.layout import Layout
from dockpose.app.web.live import LivePage
from dockpose.app.web.notifications import Colour, Notifications
from dockpose.app.web.panels.guidance import GuidancePanel
from dockpose.app.web.panels.picture import StripPanel
from dockpose.app.web.panels.play import SequencePanel
from dockpose.app.web.panels.settings import SettingsPanel
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.server.guard import Guard
from dockpose.app.web.server.journal import LOG
from dockpose.app.web.server.looks import Looks, UpdatePacing
from dockpose.app.web.server.options import DEFAULTS, Options
from dockpose.app.web.server.start import open_server, reachable_hosts, silence, token_for
from dockpose.app.web.server.uploads import Uploads
from dockpose.app.web.server.viser_private import icons_from_one_archive
from dockpose.app.web.widgets import Choices
from dockpose.sources import Frame

LOOPBACK = "127.0.0.1"
FRAME_LIMIT_S = 60.0  # a frame of a sequence that takes longer no longer holds up the next


class App(contextlib.AbstractContextManager["App"]):
    """The running page, ended by :meth:`stop` or as a context. Raises ValueError or OSError where it cannot start."""

    def __init__(
        self,
        source: str | None = None,
        camera: Camera | None = None,
        dock: Dock | None = None,
        host: str = LOOPBACK,
        port: int = 0,
        options: Options = DEFAULTS,
    ) -> None:
        self.options, self.memory = options, Memory(options.remember_in)
        self.history, self.tanks = History(), Tanks(options.remember_in)
        self.given = given(source, camera, dock, options.topic) if source is not None and is_sequence(source) else None
        self.beside = None if source is None or self.given is not None else Path(source).resolve().parent
        self._view = self._shown = view = self._first_view(source, camera, dock)
        keep_in = options.remember_in if port else None  # any free port is another one the next time
        view_token = token_for(keep_in, f"{port}-view") if options.view_link else None
        self._guard = Guard(host, options.allow_hosts, token_for(keep_in, str(port)), view_token)
        self.server = server = open_server(host, port, self._guard)
        self._notices = Notifications()
        self.kept = UploadStore()
        self._uploads = Uploads(options.upload_limit_bytes, self.kept.make_room)
        self._lock, self.choices = threading.RLock(), Choices()
        self.scene = Scene3D(server)
        self._newest: Analysis | None = None
        self._is_warm = False
        self._looks = Looks(server, self._guard, lambda *look: self._layout.of(SettingsPanel).follow(*look))
        self._pacing = pacing = UpdatePacing(lambda: bool(self._looks.slow), lambda: self.sequence.is_playing)
        self.live, self.closing = LivePage(), contextlib.ExitStack()  # which stops whatever runs
        if options.autopilot is not None:
            self.closing.callback(options.autopilot.close)
        with icons_from_one_archive():
            self._layout = Layout(self)  # pyright: ignore[reportArgumentType]
        self._panels, self.sequence = self._layout.panels, self._layout.of(SequencePanel)
        self._layout.of(GuidancePanel).watch(self._layout.of(StripPanel).say_stale)
        self._load(view)
        self._current: Analysis | None = None
        self._drawing, self._greeting = threading.Lock(), threading.Lock()
        self._scene_worker = LatestWorker(self._draw, self.fail, pacing.drawing_pauses_s)
        self._worker: LatestWorker[View | Frame | None] = LatestWorker(self._work, self.fail)
        self._worker.submit(view)
        server.on_client_connect(self._welcome)
        server.on_client_disconnect(self._say_goodbye)
        try:
            if self.given is not None:
                self.sequence.open(self.given)
        except ValueError:
            self.stop()
            raise

    def _first_view(self, source: str | None, camera: Camera | None, dock: Dock | None) -> View:
        tank = self.memory.now.tank
        if self.given is not None:
            tank = tank.with_given(camera, dock)
            self.given = replace(self.given, wishes=of_size(self.options.wishes, tank.camera))
            view = open_source(None, None, None, tank)
        else:
            is_left_open = source is None and camera is None and dock is None
            view = (self.memory.last_view(tank) if is_left_open else None) or open_source(source, camera, dock, tank)
        return with_last_settings(view, self.memory.now.settings)

    @property
    def port(self) -> int:
        """The port it listens on."""
        return self.server.get_port()

    @property
    def address(self) -> str:
        """Address to open in a browser on this machine, with the access token."""
        return self.addresses()[0]

    def addresses(self, *, for_viewers: bool = False) -> list[str]:
        """Addresses to open in a browser: on this machine first, then, where it listens to them, on others."""
        token = self._guard.view_token if for_viewers else self._guard.token
        return [f"http://{host}:{self.port}/?token={token}" for host in reachable_hosts(self.server.get_host())]

    @property
    def view(self) -> View:
        """The current view."""
        with self._lock:
            return self._view

    def wait_until_idle(self, timeout_s: float) -> bool:
        """Wait until the newest view was worked on; False if that takes longer."""
        end_s = time.monotonic() + timeout_s
        workers = (self._worker, self._scene_worker)  # in this order: the first gives the second its work
        return all(worker.wait_until_idle(max(0.0, end_s - time.monotonic())) for worker in workers)

    def stop(self) -> None:
        """End the worker and the server."""
        self.sequence.close()
        self.closing.close()
        self._worker.close()
        self._scene_worker.close()
        self.memory.write()
        with silence():
            self.server.stop()

    def __exit__(self, *_: object) -> None:
        self.stop()

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
            after = self._view = kept(before, self._view)
            if reload or not is_done:
                self._load(after)
            if after is not before:
                self.history.note(before, after)
                if not (self.sequence.is_playing and after.list_name == "sequence"):  # else the next frame has it
                    self._worker.submit(after)
        if before.list_name == "sequence" != after.list_name:
            self.sequence.close()
        self._tell_notes(before, after, client)

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

    def _load(self, view: View) -> None:
        for panel in self._panels:
            panel.load(view)
        self.choices.put_back()

    def _tell_notes(self, before: View, after: View, client: viser.ClientHandle | None) -> None:
        for note in after.notes:
            if note not in before.notes:
                self.notify("Please check the camera", note, "yellow", client)

    def show_frame(self, frame: Frame) -> None:
        """Search and show a frame of the sequence that is open; returns when that is done."""
        self._worker.submit(frame)
        self._worker.wait_until_idle(FRAME_LIMIT_S)

    def forget_frames(self) -> None:
        """Forget the frames that were shown: another sequence was opened, or none."""
        self._newest = None
        self.history.forget()

    def on_rest(self) -> None:
        """Show the frame in full; while playing, only its picture may have been shown."""
        if self._newest is not None:
            self._worker.submit(None)

    def _welcome(self, client: viser.ClientHandle) -> None:
        LOG.info("browser %d opened the page", client.client_id)
        client.scene.set_global_visibility(True)  # only now: all else on its page would wait for the first drawing
        self._looks.heed(client)
        self._layout.of(StripPanel).count_browsers(len(self.server.get_clients()))
        uploads = self._uploads.attach(client)
        with self._greeting:  # viser takes buttons for one browser at a time into a folder
            for panel in self._panels:
                panel.welcome(client, uploads)

    def _say_goodbye(self, client: viser.ClientHandle) -> None:
        LOG.info("browser %d left", client.client_id)
        self._looks.slow.discard(client.client_id)
        self._uploads.detach(client)
        self._notices.forget(client)
        self._layout.of(StripPanel).count_browsers(len(self.server.get_clients()))

    def _work(self, job: View | Frame | None) -> None:
        """Work on a view, on a frame, or show all of the newest frame."""
        if isinstance(job, Frame):
            self._work_on_frame(job)
            return
        if job is None:
            if self._newest is not None:
                self._show(self._newest)
            return
        try:
            analysis = analyse(job, self._current)
            if not self._is_warm:  # the first run loads compiled code, and its time is not that of a picture
                self._is_warm, analysis = True, analyse(job)
        except ValueError as error:  # a scene that cannot be rendered: what is shown comes back, but for a newer one
            with self._lock:
                if self._view is not job:
                    return
                self._view = self._shown
                self._load(self._shown)
            self.refuse(error, None)
            return
        self._show(analysis)

    def _work_on_frame(self, frame: Frame) -> None:
        with self._lock:
            follower, before = self.sequence.follower, self._view
            if follower is None:  # closed meanwhile
                return
            view = self._view = follower.view_of(before, frame)
            if (view.camera, view.dock, view.list_name) != (before.camera, before.dock, before.list_name):
                self._load(view)
        self._tell_notes(before, view, None)
        analysis = self._newest = follower.read(view, frame)
        if self.options.autopilot is not None and (seen := analysis.tracked_frame) is not None:
            assumed = f"the {' and the '.join(sorted(view.assumed))} is assumed" if view.assumed else None
            self.options.autopilot.see(frame, analysis.estimate, seen.tracked, analysis.trust, assumed)
        if self._pacing.shows_next():
            self._show(analysis)

    def _show(self, analysis: Analysis) -> None:
        """Show a result, of a frame all of it in one update, so that nothing on the page is ever of another frame."""
        _ = analysis.trust  # which is judged when first asked for, and what is sent must not wait for
        self._shown, self._current = analysis.view, analysis
        is_frame = analysis.tracked_frame is not None
        is_hidden = is_frame and self._pacing.hides_scene()
        with self.live.held, self.server.atomic() if is_frame else contextlib.nullcontext():
            self.live.put(hidesScene=is_hidden)
            for panel in self._panels:
                panel.show(analysis)
            if is_frame and not is_hidden:
                self._draw(analysis)
        if is_frame:
            self.server.flush()
        else:
            self._scene_worker.submit(analysis)  # the 3D scene follows when it has rested

    def _draw(self, analysis: Analysis) -> None:
        with self._drawing:
            if analysis is self._current:
                self.scene.show(analysis)

    def fail(self, error: Exception) -> None:
        """Report an unexpected error in the terminal and in all browsers."""
        LOG.error("%s: %s", type(error).__name__, error)
        self.notify("That went wrong", f"{type(error).__name__}: {error}", "red", None)

    def attempt(self, act: Callable[[], object], client: viser.ClientHandle | None) -> bool:
        """Do what a person asked for; False if it failed, after saying so."""
        try:
            act()
        except ValueError as error:
            self.refuse(error, client)
            return False
        except Exception as error:
            self.fail(error)
            return False
        return True

    def refuse(self, error: ValueError, client: viser.ClientHandle | None) -> None:
        """Say why something cannot be done."""
        self.notify("That did not work", str(error), "red", client)

    def notify(self, title: str, sentence: str, colour: Colour, client: viser.ClientHandle | None) -> None:
        """Show a notification in one browser, or in all."""
        for one in [client] if client is not None else self.server.get_clients().values():
            self._notices.show(title, sentence, colour, one)
