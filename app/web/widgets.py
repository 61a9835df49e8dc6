"""What panels are built from: the base class, sliders, and work in the background with its progress."""

import math
import threading
from collections.abc import Callable, Collection, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import viser
from dockpose.app.experiment.session import SessionFolder
from dockpose.app.export.mavlink import Autopilot
from dockpose.app.inputs.received import UploadStore
from dockpose.app.processing.analysis import Analysis
from dockpose.app.processing.background import CancelledError, Progress
from dockpose.app.resources import read_toml
from dockpose.app.state.parameters import Parameter
from dockpose.app.state.preferences import Memory
from dockpose.app.state.tank import Tanks
from dockpose.app.state.view import View
from dockpose.app.web.notifications import Notify, attempt, tell_refusal
from dockpose.app.web.scene.scene import Scene3D
from dockpose.app.web.sequence import SequenceController
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.server.viser_private import hear_values, identity

if TYPE_CHECKING:
    from dockpose.app.web.live import LivePage

Act = Callable[[viser.ClientHandle], object]
Take = Callable[[bytes, str, viser.ClientHandle], object]  # of a file its bytes and name
# Applies a function to the present view, for the browser that asked for it; by ``reload`` the controls follow.
Change = Callable[..., None]
Choice = tuple[str, Any, Any]  # a control's id, the control, and the value that a person gave it
IDLE_S = 1.5  # a pause in typing
_SAVING = "Something is being saved already. Wait for it, or stop it first."


@dataclass(frozen=True)
class Parts:
    """What the panels work with."""

    server: viser.ViserServer
    live: "LivePage"
    change: Change
    choices: "Choices"
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
    closing: ExitStack  # stops whatever runs
    autopilot: Autopilot | None = None  # to which what is seen may be sent

    def attempt(self, act: Callable[[], object], client: viser.ClientHandle) -> bool:
        """Do what a person asked for; False if it failed, after saying so."""
        return attempt(act, self.notify, self.fail, client)


class Panel:
    """A part of the page, with the controls that it builds when it is made; it overrides the methods it needs."""

    table = ""  # that of static/controls.toml with its controls

    def __init__(self, parts: Parts) -> None:
        self.parts, self.gui, self.change = parts, parts.server.gui, parts.change
        self.said = read_toml("controls.toml").get(self.table, {})
        self.analysis: Analysis | None = None
        self.sliders: dict[str, Slider] = {}
        self._uploads: list[tuple[viser.GuiFolderHandle, dict[str, Any], Take]] = []

    def load(self, view: View) -> None:
        """Set the controls to the values of a view."""
        for slider in self.sliders.values():
            slider.load(view)

    def show(self, analysis: Analysis) -> None:
        """Show what was found, and keep it; called from the worker's thread."""
        self.analysis = analysis

    def welcome(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give a browser that came what it has to itself: its buttons for files."""
        for area, look, take in self._uploads:
            with area:
                button = client.gui.add_upload_button(**look, icon=viser.Icon.UPLOAD)
            uploads.receive(button, lambda data, name, take=take: take(data, name, client))

    def add(self, kind: str, name: str, act: Act | None = None, **more: Any) -> Any:
        """Add a control by its row of the table; ``act`` is done for the browser in which a person uses it."""
        handle = getattr(self.gui, f"add_{kind}")(**self.said[name], **more)
        if act is not None and hasattr(handle, "on_click"):
            on_person(handle.on_click, act)
        elif act is not None:
            self.parts.choices.on_update(handle, act)
        return handle

    def add_sliders(
        self, parameters: Mapping[str, Parameter], putters: Mapping[str, Any] = {}, reloading: Collection[str] = ()
    ) -> None:
        """Add a slider for each parameter."""
        for name, one in parameters.items():
            self.sliders[name] = Slider(self.parts, one, putters.get(name), reload=name in reloading)

    def add_download(self, name: str, file_name: str, make: Callable[[View], bytes]) -> Any:
        """Add a button that sends ``make(view)`` to the downloads of the browser in which a person presses it."""

        def send(client: viser.ClientHandle, view: View) -> View:
            client.send_file_download(file_name, make(view), save_immediately=True)
            return view

        return self.add("button", name, lambda client: self.change(partial(send, client), client))

    def add_upload(self, area: viser.GuiFolderHandle, name: str, take: Take, mime_type: str = ".yaml,.yml") -> None:
        """Give each browser a button in ``area`` that hands files to ``take``."""
        self._uploads.append((area, {"mime_type": mime_type} | self.said[name], take))

    def changing(self, function: Callable[[View], View], *, reload: bool = True) -> Act:
        """What applies to the view a function that reads the controls itself."""
        # It runs with the view locked; only then does a control have what was set last, for viser calls in any order.
        return lambda client: self.change(function, client, reload=reload)

    def trying(self, act: Act) -> Act:
        """What does an act; if that fails, it says so and keeps everything typed."""
        return lambda client: self.parts.attempt(lambda: act(client), client)

    def changing_by_file(self, function: Callable[[View, bytes, str], View]) -> Take:
        """What applies a function of a file to the view."""
        return lambda data, name, client: self.change(lambda view: function(view, data, name), client, reload=True)


class Choices:
    """What people set in controls and no act has taken up yet: another act that ends meanwhile sets all controls."""

    def __init__(self) -> None:
        self._open: dict[str | None, Choice] = {}
        self._held = threading.Lock()  # or a choice that has just been replaced is put back over the newer one
        self._acting = threading.local()

    def on_update(self, handle: Any, act: Act) -> None:
        """Call ``act`` with the browser in which a person set a control, which then has the value set last."""
        key = identity(handle)
        sent: dict[str, Any] = {}

        async def note(event: Any) -> None:  # viser awaits this in the order of a browser's messages
            if event.client is not None:
                with self._held:
                    self._open[key] = key, handle, sent["value"]

        def take_up(client: viser.ClientHandle) -> None:  # which viser calls in any order
            self._acting.on = key
            choice = self.put_back()
            try:
                act(client)
            finally:
                self.taken(choice)
                self._acting.on = None

        hear_values(handle, sent.update)
        handle.on_update(note)
        on_person(handle.on_update, take_up)

    def put_back(self) -> Choice | None:
        """Set controls as people did, where the program set them otherwise since; return what this thread acts on."""
        with self._held:
            for _, handle, value in self._open.values():
                if handle.value != value:
                    handle.value = value
            return self._open.get(getattr(self._acting, "on", None))

    def taken(self, choice: Choice | None) -> None:
        """Say that an act has read a choice; one that was made in the same control since stays."""
        with self._held:
            if choice is not None and self._open.get(choice[0]) is choice:
                del self._open[choice[0]]


def on_person(attach: Callable[[Callable[[Any], None]], object], act: Act) -> None:
    """Call ``act`` with the browser in which a person, not the program, did what ``attach`` (``on_click``) is for."""

    def called(event: Any) -> None:
        if event.client is not None:
            act(event.client)

    attach(called)


def offer(dropdown: Any, options: tuple[str, ...], chosen: str) -> None:
    """Set what a drop-down offers and which of it is chosen, where either is another by now."""
    if dropdown.options != options:
        dropdown.options = options
    if dropdown.value != chosen:
        dropdown.value = chosen


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
        parts: Parts,
        parameter: Parameter,
        put: Callable[[View, Any], View] | None = None,
        *,
        reload: bool = False,
    ) -> None:
        self._parameter, put, change = parameter, put or parameter.put, parts.change
        self.handle = parts.server.gui.add_slider(
            parameter.label, min=0.0, max=1.0, step=1.0, initial_value=0.0, hint=parameter.hint
        )

        def changed(client: viser.ClientHandle, view: View) -> View:
            sent = self.handle.value
            new = put(view, sent)
            if not math.isclose(parameter.get(new), sent, rel_tol=1e-9, abs_tol=1e-4):  # it was out of range
                return_when_idle(self.handle, change, client, self.load)
            return new

        parts.choices.on_update(self.handle, lambda client: change(partial(changed, client), client, reload=reload))

    def load(self, view: View, *, with_value: bool = True) -> None:
        """Set the range and, by default, the value; the box shows as many decimals as a step has, at least one."""
        limits, handle = self._parameter.range(view), self.handle
        handle.min, handle.max, handle.step = limits.low, limits.high, limits.step
        handle.precision = 0 if self._parameter.whole else max(1, math.ceil(-math.log10(limits.step)))
        if with_value:
            handle.value = round(self._parameter.get(view), 4)


class BackgroundWork:
    """Runs one piece of work at a time in its own thread, with a progress bar and a button to stop, with its hint."""

    def __init__(self, parts: Parts, hint: str = "Do not make the file.", busy: str = _SAVING) -> None:
        self._parts, self._busy, gui = parts, busy, parts.server.gui
        self._bar = gui.add_progress_bar(0, visible=False, animated=True)
        self._stop = gui.add_button("Stop", icon=viser.Icon.PLAYER_STOP, visible=False, hint=hint)
        self._stop.on_click(lambda event: self.cancel())
        self._lock = threading.Lock()
        self._running: tuple[threading.Thread, Progress] | None = None
        parts.closing.callback(self.close)

    def start(self, work: Callable[[Progress], None], client: viser.ClientHandle | None = None) -> bool:
        """Start; return False if other work is still running. ``client`` is told of that, and of a ValueError."""
        with self._lock:
            if self._running is None:
                progress = Progress(self._tell)
                arguments = work, progress, client
                thread = threading.Thread(target=self._run, args=arguments, name="dockpose task", daemon=True)
                self._running = thread, progress
                thread.start()
                return True
        if client is not None:
            self._parts.notify("Please wait", self._busy, "yellow", client)
        return False

    def save(self, client: viser.ClientHandle, name: str, make: Callable[[Progress], bytes]) -> None:
        """Make a file and send it to the browser's downloads under that name."""

        def work(progress: Progress) -> None:
            content = make(progress)
            for _ in progress.over(["send"]):  # unless it was asked to stop meanwhile
                client.send_file_download(name, content, save_immediately=True)

        self.start(work, client)

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

    def _run(self, work: Callable[[Progress], None], progress: Progress, client: viser.ClientHandle | None) -> None:
        self._show(True)
        try:
            work(progress)
        except CancelledError:
            pass
        except Exception as error:  # whatever it was, people should read of it on the page
            if isinstance(error, ValueError) and client is not None:
                tell_refusal(error, self._parts.notify, client)
            else:
                self._parts.fail(error)
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
