"""The page in the browser: a viser server, its panels and its scene, and the worker behind them."""

import contextlib
import threading
import time

import cv2
import viser
from dockpose import Camera, Dock
from dockpose.app.drawing.annotated import annotate
from dockpose.app.processing.analysis import Analysis, analyse
from dockpose.app.processing.background import LatestWorker
from dockpose.app.state.view import View
from dockpose.app.web.layout import Layout
from dockpose.app.web.page import Page
from dockpose.app.web.panels.guidance import GuidancePanel
from dockpose.app.web.panels.picture import StripPanel
from dockpose.app.web.panels.play import SequencePanel
from dockpose.app.web.panels.settings import SettingsPanel
from dockpose.app.web.scene.drawing import drawing_of
from dockpose.app.web.server.journal import LOG
from dockpose.app.web.server.looks import Looks, UpdatePacing
from dockpose.app.web.server.options import DEFAULTS, Options
from dockpose.app.web.server.start import silence
from dockpose.app.web.server.uploads import Uploads
from dockpose.app.web.server.viser_private import icons_from_one_archive
from dockpose.estimate.drawing import PARTS
from dockpose.sources import Frame

LOOPBACK = "127.0.0.1"
FIRST_RESULT_S = 1.0  # for which the page's first request waits


class App(Page, contextlib.AbstractContextManager["App"]):
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
        super().__init__(source, camera, dock, host, port, options)
        self._shown = view = self._view
        self._uploads = Uploads(options.upload_limit_bytes, self.kept.make_room)
        self._is_warm = self._is_hidden = False  # the 3D scene, behind its light drawing
        self._looks = Looks(self.server, self._guard, lambda *look: self._layout.of(SettingsPanel).follow(*look))
        self._pacing = pacing = UpdatePacing(lambda: bool(self._looks.slow), lambda: self.is_playing)
        if options.autopilot is not None:
            self.closing.callback(options.autopilot.close)
        with icons_from_one_archive():
            self._layout = Layout(self)
        self.panels, self.sequence = self._layout.panels, self._layout.of(SequencePanel)
        self._layout.of(GuidancePanel).watch(self._layout.of(StripPanel).say_stale)
        self.load(view)
        self._current: Analysis | None = None
        self._drawing, self._greeting = threading.Lock(), threading.Lock()
        self._scene_worker = LatestWorker(self._draw, self.fail, pacing.drawing_pauses_s)
        self.worker.submit(view)
        self._guard.made |= {"/": self._shell, "/index.html": self._shell, "/alive": lambda: str(self.live.results)}
        self.server.on_client_connect(self._welcome)
        self.server.on_client_disconnect(self._say_goodbye)
        try:
            if self.given is not None:
                self.sequence.open(self.given)
        except ValueError:
            self.stop()
            raise

    def wait_until_idle(self, timeout_s: float) -> bool:
        """Wait until the newest view was worked on; False if that takes longer."""
        end_s = time.monotonic() + timeout_s
        workers = (self.worker, self._scene_worker)  # in this order: the first gives the second its work
        return all(worker.wait_until_idle(max(0.0, end_s - time.monotonic())) for worker in workers)

    def stop(self) -> None:
        """End the worker and the server."""
        self.sequence.close()
        self.closing.close()
        self.worker.close()
        self._scene_worker.close()
        self.memory.write()
        with silence():
            self.server.stop()

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _welcome(self, client: viser.ClientHandle) -> None:
        LOG.info("browser %d opened the page", client.client_id)
        client.scene.set_global_visibility(True)  # only now: all else on its page would wait for the first drawing
        self._looks.heed(client)
        self._layout.of(StripPanel).count_browsers(len(self.server.get_clients()))
        uploads = self._uploads.attach(client)
        with self._greeting:  # viser takes buttons for one browser at a time into a folder
            for panel in self.panels:
                panel.welcome(client, uploads)

    def _say_goodbye(self, client: viser.ClientHandle) -> None:
        LOG.info("browser %d left", client.client_id)
        self._looks.slow.discard(client.client_id)
        self._uploads.detach(client)
        self._notices.forget(client)
        self._layout.of(StripPanel).count_browsers(len(self.server.get_clients()))

    def work_on(self, job: View | Frame | None) -> None:
        """Work on a view, on a frame, or show all of the newest frame; called from the worker's thread."""
        if isinstance(job, Frame):
            self._work_on_frame(job)
            return
        if job is None:
            if self.newest is not None:
                self._show(self.newest)
            return
        try:
            if (follower := self.sequence.follower) is not None and (taken := follower.takes(job)) is not None:
                self.newest = taken
                self._show(taken)
                return
            analysis = analyse(job, self._current)
            if not self._is_warm:  # the first run loads compiled code, and its time is not that of a picture
                self._is_warm, analysis = True, analyse(job)
        except ValueError as error:  # a scene that cannot be rendered: what is shown comes back, but for a newer one
            with self._lock:
                if self._view is not job:
                    return
                self._view = self._shown
                self.load(self._shown)
            self.report(error, None)
            return
        with self._lock:
            if self._view is job:  # what is simulated was rendered, which need not be done again
                self._view = analysis.view
        self._show(analysis)

    def _work_on_frame(self, frame: Frame) -> None:
        with self._lock:
            follower, before = self.sequence.follower, self._view
            if follower is None or follower.leaves_out(before, frame):  # closed meanwhile, or of another size
                return
            view = self._view = follower.view_of(before, frame)
            if (view.camera, view.dock, view.list_name) != (before.camera, before.dock, before.list_name):
                self.load(view)
        analysis = self.newest = follower.read(view, frame)
        if self.options.autopilot is not None and (seen := analysis.tracked_frame) is not None:
            assumed = f"the {' and the '.join(sorted(view.assumed))} is assumed" if view.assumed else None
            self.options.autopilot.see(frame, analysis.estimate, seen.tracked, analysis.trust, assumed)
        if self._pacing.shows_next():
            self._show(analysis)

    def _show(self, analysis: Analysis) -> None:
        """Show a result, of a frame all of it in one update, so that nothing on the page is ever of another frame."""
        _ = analysis.trust  # which is judged when first asked for, and what is sent must not wait for
        self._shown, self._current = analysis.view, analysis
        is_frame, is_hidden = analysis.tracked_frame is not None, self._pacing.draws_slowly()  # while it changes
        with self.live.held, self.server.atomic() if is_frame else contextlib.nullcontext():
            self._is_hidden = is_hidden
            self.live.put(hidesScene=is_hidden, scene=drawing_of(analysis).numbers() if is_hidden else None)
            for panel in self.panels[: self._layout.until_sent]:
                panel.show(analysis)
            self.live.show(analysis)
            for panel in self.panels[self._layout.until_sent :]:
                panel.show(analysis)
            if is_frame and not is_hidden:
                self._draw(analysis)
        if is_frame:
            self.server.flush()
        if not (self.is_playing if is_hidden else is_frame):
            self._scene_worker.submit(analysis)  # the 3D scene follows when it has rested

    def _shell(self) -> str:
        self.worker.wait_until_idle(FIRST_RESULT_S)
        return self.live.shell(self._still)

    def _still(self, found: Analysis) -> bytes:
        """The annotated picture as a JPEG; nothing of a sequence, nor of what is being changed."""
        if self.opened is not None or found.view is not self.view:
            return b""
        return cv2.imencode(".jpg", annotate(found.view.image, found.estimate, layers=PARTS))[1].tobytes()

    def _draw(self, analysis: Analysis) -> None:
        with self._drawing:
            if analysis is self._current:
                self.scene.show(analysis)
        with self.live.held:
            if self._is_hidden and analysis is self._current:
                self._is_hidden = False
                self.live.put(hidesScene=False)
                self.live.send()
