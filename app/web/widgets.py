"""What panels are built from: the base class, sliders, buttons for files, and the wiring of what a person does."""

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import viser
from dockpose.app.experiment.session import SessionFolder
from dockpose.app.inputs.received import UploadStore
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import CancelledError, Progress
from dockpose.app.state.parameters import Parameter
from dockpose.app.state.preferences import Memory
from dockpose.app.state.tank import Tanks
from dockpose.app.state.view import View
from dockpose.app.web.notifications import Notify, attempt, tell_refusal
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.sequence import SequenceController
from dockpose.app.web.server.uploads import ClientUploads

Act = Callable[[viser.ClientHandle], object]
IDLE_S = 1.5  # a pause in typing
_BUSY = "Something is being saved already. Wait for it, or stop it first."


class Change(Protocol):
    """Applies a function to the present view, for the browser that asked for it."""

    def __call__(self, function: Callable[[View], View], client: viser.ClientHandle, *, reload: bool = False) -> None:
        """``reload``: the controls must follow, since they were not what changed the view."""


@dataclass(frozen=True)
class Parts:
    """What the panels work with."""

    change: Change
    notify: Notify
    fail: Callable[[Exception], None]  # reports unexpected errors
    undo: Act
    redo: Act
    uploads: UploadStore
    root: Path | None  # the folder whose pictures may be listed
    beside: Path | None  # that of the picture given at the start
    memory: Memory
    tanks: Tanks
    sequence: SequenceController
    scene: Scene3D
    sessions: SessionFolder
    recordings: Path  # where a live source is recorded

    def attempt(self, act: Callable[[], object], client: viser.ClientHandle) -> bool:
        """Do what a person asked for; False if it failed, after saying so."""
        return attempt(act, self.notify, self.fail, client)


class Panel:
    """A part of the page, with the controls that it builds when it is made; it overrides the methods it needs."""

    def load(self, view: View) -> None:
        """Set the controls to the values of a view."""

    def show(self, analysis: Analysis) -> None:
        """Show what was found; called from the worker's thread."""

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its upload button."""

    def close(self) -> None:
        """Stop whatever runs."""


def on_person(attach: Callable[[Callable[[Any], None]], object], act: Act) -> None:
    """Call ``act`` with the browser in which a person, not the program, did what ``attach`` (``on_click``) is for."""

    def called(event: Any) -> None:
        if event.client is not None:
            act(event.client)

    attach(called)


def on_click(button: Any, act: Act) -> None:
    """Call ``act`` with the browser in which a person presses this button, or one of this group."""
    on_person(button.on_click, act)


def on_change(handle: Any, change: Change, function: Callable[[View], View], *, reload: bool = False) -> None:
    """Apply ``function``, which must read the value itself, to the view whenever a person changes this control."""
    # It runs with the view locked; viser calls back out of order, so only the value at that moment is the newest.
    on_person(handle.on_update, lambda client: change(function, client, reload=reload))


def on_download(button: Any, change: Change, name: str, make: Callable[[View], bytes]) -> None:
    """Send ``make(view)`` to the downloads of the browser in which a person presses this button."""

    def send(view: View, client: viser.ClientHandle) -> View:
        client.send_file_download(name, make(view), save_immediately=True)
        return view

    on_click(button, lambda client: change(lambda view: send(view, client), client))


def add_upload_button(
    area: viser.GuiFolderHandle,
    client: viser.ClientHandle,
    uploads: ClientUploads,
    take: Callable[[bytes, str, viser.ClientHandle], None],
    label: str,
    hint: str,
    *,
    mime_type: str = ".yaml,.yml",
    order: float | None = None,
) -> None:
    """Give one browser a button in ``area`` that hands a file's bytes and name to ``take``."""
    with area:
        button = client.gui.add_upload_button(
            label, icon=viser.Icon.UPLOAD, mime_type=mime_type, hint=hint, order=order
        )
    uploads.receive(button, lambda data, name: take(data, name, client))


def offer(dropdown: Any, options: tuple[str, ...], chosen: str) -> None:
    """Set what a drop-down offers and which of it is chosen, where either is another by now."""
    if dropdown.options != options:
        dropdown.options = options
    if dropdown.value != chosen:
        dropdown.value = chosen


def loading(
    change: Change, function: Callable[[View, bytes, str], View]
) -> Callable[[bytes, str, viser.ClientHandle], None]:
    """Return what :func:`add_upload_button` takes for a file that changes the view."""
    return lambda data, name, client: change(lambda view: function(view, data, name), client, reload=True)


def return_when_idle(handle: Any, change: Change, client: viser.ClientHandle, load: Callable[[View], object]) -> None:
    """Return a box to the number in force by ``load``, once nobody has typed there any more for a while."""
    # What is typed on the way to a number, as the 8 of 812, stays meanwhile.
    refused = handle.value

    def settle() -> None:
        if handle.value == refused:
            change(lambda view: (load(view), view)[1], client)

    timer = threading.Timer(IDLE_S, settle)
    timer.daemon = True
    timer.start()


class Slider:
    """A slider with a typed value for one parameter; ``put`` replaces its own, by ``reload`` other controls follow."""

    def __init__(
        self,
        gui: viser.GuiApi,
        parameter: Parameter,
        change: Change,
        put: Callable[[View, Any], View] | None = None,
        *,
        reload: bool = False,
    ) -> None:
        self._parameter, put = parameter, put or parameter.put
        self.handle = gui.add_slider(
            parameter.label, min=0.0, max=1.0, step=1.0, initial_value=0.0, hint=parameter.hint
        )

        def changed(view: View, client: viser.ClientHandle) -> View:
            sent = self.handle.value
            new = put(view, sent)
            if not math.isclose(parameter.get(new), sent, rel_tol=1e-9, abs_tol=1e-4):  # it was out of range
                return_when_idle(self.handle, change, client, self.load)
            return new

        on_person(
            self.handle.on_update,
            lambda client: change(lambda view: changed(view, client), client, reload=reload),
        )

    def load(self, view: View, *, with_value: bool = True) -> None:
        """Set the range and, by default, the value; the box shows as many decimals as a step has, at least one."""
        limits, handle = self._parameter.range(view), self.handle
        handle.min, handle.max, handle.step = limits.low, limits.high, limits.step
        handle.precision = 0 if self._parameter.whole else max(1, math.ceil(-math.log10(limits.step)))
        if with_value:
            handle.value = round(self._parameter.get(view), 4)


class BackgroundWork:
    """Runs one piece of work at a time in its own thread, with a progress bar and a button to stop, with its hint."""

    def __init__(self, gui: viser.GuiApi, on_error: Callable[[Exception], None], hint: str) -> None:
        self._on_error = on_error
        self._bar = gui.add_progress_bar(0, visible=False, animated=True)
        self._stop = gui.add_button("Stop", icon=viser.Icon.PLAYER_STOP, visible=False, hint=hint)
        self._stop.on_click(lambda event: self.cancel())
        self._lock = threading.Lock()
        self._running: tuple[threading.Thread, Progress] | None = None

    def start(self, work: Callable[[Progress], None]) -> bool:
        """Start; return False if other work is still running."""
        with self._lock:
            if self._running is not None:
                return False
            progress = Progress(self._tell)
            thread = threading.Thread(target=self._run, args=(work, progress), name="dockpose task", daemon=True)
            self._running = thread, progress
        thread.start()
        return True

    def cancel(self) -> None:
        """Ask whatever runs to stop at its next step."""
        with self._lock:
            if self._running is not None:
                self._running[1].stop()

    def close(self, timeout_s: float = 5.0) -> None:
        """Stop whatever runs and wait for its end."""
        self.cancel()
        running = self._running
        if running is not None and running[0] is not threading.current_thread():
            running[0].join(timeout_s)

    def _run(self, work: Callable[[Progress], None], progress: Progress) -> None:
        self._show(True)
        try:
            work(progress)
        except CancelledError:
            pass
        except Exception as error:  # whatever it was, people should read of it on the page
            self._on_error(error)
        finally:
            with self._lock:
                self._running = None
            self._show(False)

    def _tell(self, share: float) -> None:
        if round(100 * share) != self._bar.value:
            self._bar.value = round(100 * share)

    def _show(self, is_running: bool) -> None:
        self._bar.visible = self._stop.visible = is_running
        self._bar.value = 0


class Saver:
    """Makes files one at a time and sends them to the browser that asked, with progress and a button to stop."""

    def __init__(self, gui: viser.GuiApi, parts: Parts) -> None:
        self._notify = parts.notify
        self._work = BackgroundWork(gui, parts.fail, "Do not make the file.")
        self.close = self._work.close

    def save(self, client: viser.ClientHandle, name: str, make: Callable[[Progress], bytes]) -> None:
        """Make a file and send it to the browser's downloads under that name."""

        def work(progress: Progress) -> None:
            try:
                content = make(progress)
            except ValueError as error:
                tell_refusal(error, self._notify, client)
                return
            for _ in progress.over(["send"]):  # unless it was asked to stop meanwhile
                client.send_file_download(name, content, save_immediately=True)

        if not self._work.start(work):
            self._notify("Please wait", _BUSY, "yellow", client)
