"""The page in the browser: a viser server, its panels and its scene, and the worker behind them."""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable

import viser

from app.guard import LOOPBACK_NAMES, Guard, accept_values_only
from app.history import History
from app.memory import Memory, with_last_settings
from app.notices import Colour, Notices
from app.opening import open_server, silence
from app.options import DEFAULTS, Options
from app.panels import Panel, Uploader
from app.panels.camera import CameraPanel
from app.panels.compare import ComparePanel
from app.panels.detect import DetectPanel
from app.panels.export import ExportPanel
from app.panels.habits import Actions, HabitsPanel, help_link
from app.panels.masks import MasksPanel
from app.panels.picture import PicturePanel
from app.panels.pose import PosePanel
from app.panels.result import ResultPanel, StatusPanel
from app.panels.simulator import SimulatorPanel
from app.panels.source import SourcePanel
from app.panels.viewpoint import ViewpointPanel
from app.reading import Reading, read_view
from app.shelf import Shelf
from app.state import View, open_source
from app.uploads import Uploads
from app.view3d import View3D
from app.worker import LatestWorker
from pipeline import Camera, Dock

LOOPBACK = "127.0.0.1"
SLOW_DRAWING_S = 0.7  # a browser goes on drawing for 0.25 s after each change of the 3D scene
PICTURE_WIDTH_PX, CONTROLS_WIDTH_PX = 560, 370
_OPEN_WARNING = (
    "dockpose: it listens on {host}, so every machine of that network can reach this page. Who has the address with "
    "its token can steer it and see its pictures; the connection is not encrypted. README.md shows a proxy with TLS."
)


def serve(
    source: str | None,
    camera: Camera | None,
    dock: Dock | None,
    host: str = LOOPBACK,
    port: int = 8080,
    options: Options = DEFAULTS,
    report: Callable[[str], None] | None = None,
) -> None:
    """Serve the page until it is interrupted.

    Parameters
    ----------
    source : path of the picture to start with; None for a sample scene.
    camera, dock : None takes what the YAML beside the picture says.
    host, port : to listen on; port 0 takes any free one.
    options : what the page may do.
    report : is told the page's address; the default writes to standard error.

    Raises
    ------
    ValueError
        if the picture cannot be read or does not belong to the camera.
    PortBusyError
        if the port cannot be had. Another one is never taken in its place.
    """
    tell = report or _tell
    app = App.build(source, camera, dock, host=host, port=port, options=options)
    try:
        tell(f"dockpose is at {app.address} (Ctrl+C stops it)")
        if host not in LOOPBACK_NAMES:
            tell(_OPEN_WARNING.format(host=host))
        threading.Event().wait()
    except KeyboardInterrupt:
        tell("dockpose: stopped")
    finally:
        app.stop()


class App:
    """The running page. Make it with :meth:`build`, end it with :meth:`stop`."""

    def __init__(
        self,
        server: viser.ViserServer,
        guard: Guard,
        view: View,
        memory: Memory,
        options: Options,
        draws_slowly: threading.Event,
    ) -> None:
        self._server = server
        self._guard = guard
        self._notices = Notices()
        self._shelf = Shelf()
        self._uploads = Uploads(options.upload_limit_bytes, self._shelf.make_room)
        self._root = options.folder
        self._memory, self._history = memory, History()
        self._view = view
        self._lock = threading.RLock()
        self._scene = View3D(server)
        self._shown = view
        self._panels: list[Panel] = []
        self._uploaders: list[Uploader] = []
        self._build_panels()
        for panel in self._panels:
            panel.load(view)
        # Where a browser has no graphics card, the 3D scene leaves it time for the pictures.
        self._scene_worker = LatestWorker(
            self._scene.show, self._on_error, lambda: SLOW_DRAWING_S if draws_slowly.is_set() else 0.0
        )
        self._worker = LatestWorker(self._work, self._on_error)
        self._worker.submit(view)
        server.on_client_connect(self._welcome)
        server.on_client_disconnect(self._say_goodbye)

    @classmethod
    def build(
        cls,
        source: str | None = None,
        camera: Camera | None = None,
        dock: Dock | None = None,
        host: str = LOOPBACK,
        port: int = 0,
        options: Options = DEFAULTS,
    ) -> App:
        """Open the source and start serving; see :func:`serve` for the arguments and errors."""
        view, memory = open_source(source, camera, dock), Memory(options.remember_in)
        view = with_last_settings(view, memory.now.settings)
        guard = Guard(host, options.allow_hosts)
        draws_slowly = threading.Event()
        server = open_server(host, port, guard, draws_slowly.set)
        return cls(server, guard, view, memory, options, draws_slowly)

    @property
    def port(self) -> int:
        """The port it listens on."""
        return self._server.get_port()

    @property
    def address(self) -> str:
        """What to open in a browser: with the token that lets it in."""
        host = self._server.get_host()
        shown = f"[{host}]" if ":" in host else "127.0.0.1" if host == "0.0.0.0" else host
        return f"http://{shown}:{self.port}/?token={self._guard.token}"

    @property
    def view(self) -> View:
        """What the page shows and works from at this moment."""
        with self._lock:
            return self._view

    def wait_until_idle(self, timeout_s: float) -> bool:
        """Wait until the newest view was worked on; False if that takes longer."""
        end_s = time.monotonic() + timeout_s
        workers = (self._worker, self._scene_worker)  # in this order: the first gives the second its work
        return all(worker.wait_until_idle(max(0.0, end_s - time.monotonic())) for worker in workers)

    def stop(self) -> None:
        """End the worker and the server."""
        self._compare.close()
        self._export.close()
        self._worker.close()
        self._scene_worker.close()
        self._memory.write()
        with silence():
            self._server.stop()

    def change(
        self, function: Callable[[View], View], client: viser.ClientHandle | None = None, *, reload: bool = False
    ) -> None:
        """Apply a function to the view and have the result worked on; where it refuses, say so and keep the view."""
        with self._lock:
            before = after = self._view
            try:
                after = self._view = function(before)
            except ValueError as error:
                self._notify("That did not work", str(error), "red", client)
                reload = True
            except Exception as error:  # viser would only write it to the terminal, where nobody looks
                self._on_error(error)
                reload = True
            if reload:
                for panel in self._panels:
                    panel.load(after)
            if after is not before:
                self._history.note(before, after)
                self._worker.submit(after)
        if after.note and after.note != before.note:
            self._notify("Please check the camera", after.note, "yellow", client)

    def _build_panels(self) -> None:
        gui, panels = self._server.gui, self._panels
        tabs = gui.add_tab_group()
        with tabs.add_tab("Source", viser.Icon.PHOTO):
            self._source = SourcePanel(gui, self.change, self._shelf, self._root)
            simulator = SimulatorPanel(gui, self.change)
            gui.add_html(help_link("source"), order=1e9)
        with tabs.add_tab("Camera & dock", viser.Icon.CAMERA):
            camera = CameraPanel(gui, self.change)
            panels += [self._source, simulator, camera]
            gui.add_html(help_link("camera"), order=1e9)
        with tabs.add_tab("Detect", viser.Icon.ADJUSTMENTS):
            panels += [DetectPanel(gui, self.change), MasksPanel(gui, self.change)]
            gui.add_html(help_link("detect"), order=1e9)
        with tabs.add_tab("Pose", viser.Icon.AXIS_X):
            panels.append(PosePanel(gui, self.change))
            gui.add_html(help_link("pose"), order=1e9)
        with tabs.add_tab("Export", viser.Icon.DOWNLOAD):
            self._export = ExportPanel(gui, self._on_error)
            gui.add_html(help_link("export"), order=1e9)
        panels.append(self._export)
        with tabs.add_tab("Settings", viser.Icon.SETTINGS):
            self._habits = HabitsPanel(self._server, self.change, self._memory, self._actions())
        panels.append(self._habits)
        panels.append(ViewpointPanel(gui, self._scene))
        gui.main_panel.dock_right()
        gui.main_panel.set_width(CONTROLS_WIDTH_PX)
        left = gui.add_panel()
        with left.add_tab("Picture and pose", viser.Icon.TARGET):
            status, picture = StatusPanel(gui), PicturePanel(gui, self._server.flush)
            panels.insert(0, picture)  # it is what people wait for
            panels += [status, ResultPanel(gui)]
        with picture.compare_tab:
            self._compare = ComparePanel(gui, self.change, self._on_error)
        panels.append(self._compare)
        left.dock_left()
        left.set_width(PICTURE_WIDTH_PX)
        self._uploaders += [self._source, simulator, camera, self._habits]

    def _actions(self) -> Actions:
        return Actions(
            undo=lambda client: self.change(self._history.undo, client, reload=True),
            redo=lambda client: self.change(self._history.redo, client, reload=True),
            turn=self._source.turn,
        )

    def _welcome(self, client: viser.ClientHandle) -> None:
        """Give a browser that just came what it has for itself."""
        accept_values_only(client)
        uploads = self._uploads.attach(client)
        for panel in self._uploaders:
            panel.add_upload(client, uploads)

    def _say_goodbye(self, client: viser.ClientHandle) -> None:
        """Forget a browser that left."""
        self._uploads.detach(client)
        self._notices.forget(client)
        self._habits.forget(client)

    def _work(self, view: View) -> None:
        try:
            reading: Reading = read_view(view)
        except ValueError as error:  # a scene that cannot be rendered
            self._go_back(view, error)
            return
        self._shown = view
        for panel in self._panels:
            panel.show(reading)
        self._scene_worker.submit(reading)

    def _go_back(self, refused: View, error: ValueError) -> None:
        """Return to what is shown from a view that turned out to be impossible, unless there is a newer one."""
        with self._lock:
            if self._view is not refused:
                return
            self._view = self._shown
            for panel in self._panels:
                panel.load(self._shown)
        self._notify("That did not work", str(error), "red", None)

    def _on_error(self, error: Exception) -> None:
        _tell(f"dockpose: {type(error).__name__}: {error}")
        self._notify("That went wrong", f"{type(error).__name__}: {error}", "red", None)

    def _notify(self, title: str, sentence: str, colour: Colour, client: viser.ClientHandle | None) -> None:
        """Show a notification in one browser, or in all."""
        for one in [client] if client is not None else self._server.get_clients().values():
            self._notices.show(title, sentence, colour, one)


def _tell(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
