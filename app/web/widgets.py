"""What panels are built from: the base class, and sliders."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import viser
from dockpose.app.errors import UserError
from dockpose.app.processing.analysis import Analysis
from dockpose.app.resources import read_toml
from dockpose.app.state.parameters import Parameter
from dockpose.app.state.values import VALUES, Value
from dockpose.app.state.view import View, typed_number
from dockpose.app.web.choices import Act, Client, on_person
from dockpose.app.web.page import Page
from dockpose.app.web.server.uploads import ClientUploads
from dockpose.app.web.server.values import why_not

Take = Callable[[bytes, str, Client], object]  # of a file its bytes and name


class Panel:
    """A part of the page, with the controls that it builds when it is made; it overrides the methods it needs."""

    table = ""  # that of static/controls.toml with its controls

    def __init__(self, app: Page) -> None:
        self.app, self.gui, self.change = app, app.server.gui, app.change
        self.said = read_toml("controls.toml").get(self.table, {})
        self.analysis: Analysis | None = None
        self.sliders: dict[str, Slider] = {}
        self.values: list[tuple[Any, Value]] = []
        self._uploads: list[tuple[viser.GuiFolderHandle, dict[str, Any], Take, bool]] = []

    def load(self, view: View) -> None:
        """Set the controls to the values of a view."""
        for slider in self.sliders.values():
            slider.load(view)
        for handle, value in self.values:
            if value.options is not None:
                offer(handle, value.options(view), value.get(view))
            else:
                handle.value = value.get(view)

    def show(self, analysis: Analysis) -> None:
        """Show what was found, and keep it; called from the worker's thread."""
        self.analysis = analysis

    def welcome(self, client: Client, uploads: ClientUploads) -> None:
        """Give a browser that came what it has to itself: its buttons for files."""
        for area, look, take, waits in self._uploads:
            with area:
                button = client.gui.add_upload_button(**look, icon=viser.Icon.UPLOAD)
            uploads.receive(button, partial(self._received, button if waits else None, take, client))

    def _received(self, waiting: Any, take: Take, client: Client, data: bytes, name: str) -> None:
        try:
            if waiting is not None:
                waiting.disabled = True
            take(data, name, client)
        finally:
            if waiting is not None:
                waiting.disabled = False

    def add(self, kind: str, name: str, act: Act | None = None, **more: Any) -> Any:
        """Add a control by its row of the table; ``act`` is done for the browser in which a person uses it."""
        handle = getattr(self.gui, f"add_{kind}")(**self.said[name], **more)
        if act is not None and hasattr(handle, "on_click"):
            on_person(handle.on_click, act)
        elif act is not None:
            self.app.choices.on_update(handle, act)
        return handle

    def add_value(self, kind: str, name: str, *, reload: bool = True, **more: Any) -> Any:
        """Add a control by its row of the table, which sets the value of that name and shows it from then on."""
        value = VALUES[name]
        if value.options is not None:
            more["options"] = value.options(self.app.view)
        act = self.changing(lambda view: value.put(view, handle.value), reload=reload)
        handle = self.add(kind, name, act, **more)
        self.values.append((handle, value))
        return handle

    def add_sliders(
        self, parameters: Mapping[str, Parameter], putters: Mapping[str, Any] = {}, order: float | None = None
    ) -> None:
        """Add a slider for each parameter."""
        for name, one in parameters.items():
            self.sliders[name] = Slider(self.app, one, putters.get(name), order)

    def add_download(self, name: str, file_name: str, make: Callable[[View], bytes]) -> Any:
        """Add a button that sends ``make(view)`` to the downloads of the browser in which a person presses it."""

        def send(client: Client, view: View) -> View:
            client.send_file_download(file_name, make(view), save_immediately=True)
            return view

        return self.add("button", name, lambda client: self.change(partial(send, client), client))

    def add_upload(
        self, area: viser.GuiFolderHandle, name: str, take: Take, mime_type: str = ".yaml,.yml", *, waits: bool = False
    ) -> None:
        """Give each browser a button in ``area`` that hands files to ``take``, by ``waits`` one after the other."""
        self._uploads.append((area, {"mime_type": mime_type} | self.said[name], take, waits))

    def changing(self, function: Callable[[View], View], *, reload: bool = True) -> Act:
        """What applies to the view a function that reads the controls itself."""
        # It runs with the view locked; only then does a control have what was set last, for viser calls in any order.
        return lambda client: self.change(function, client, reload=reload)

    def trying(self, act: Act) -> Act:
        """What does an act; if that fails, it says so and keeps everything typed."""
        return lambda client: self.app.attempt(lambda: act(client), client)

    def changing_by_file(self, function: Callable[[View, bytes, str], View]) -> Take:
        """What applies a function of a file to the view."""
        return lambda data, name, client: self.change(lambda view: function(view, data, name), client, reload=True)


def offer(dropdown: Any, options: tuple[str, ...], chosen: str) -> None:
    """Set what a drop-down offers and which of it is chosen, where either is another by now."""
    if dropdown.options != options:
        dropdown.options = options
    if dropdown.value != chosen:
        dropdown.value = chosen


def take_number(app: Page, asked: Any, client: Client) -> None:
    """Set a box for a number, by the id of its control, to what was typed there; what it cannot be, is told."""

    def take() -> None:
        handle, put = app.choices.typed[asked.of]
        number = typed_number(handle.label, asked.text)
        if number is None:
            return
        is_part = handle.precision == 0 and number % 1 != 0
        if reason := "it must be a whole number" if is_part else why_not(handle, number):
            raise UserError(f"{handle.label} is {asked.text.strip()!r}, which is not taken: {reason}.")
        put(number, client)

    if asked.of in app.choices.typed:
        app.attempt(take, client)


class Slider:
    """A slider with a typed value for one parameter; ``put`` replaces its own."""

    def __init__(self, app: Page, parameter: Parameter, put: Any = None, order: float | None = None) -> None:
        self._parameter, put, change = parameter, put or parameter.put, app.change
        self.handle: Any = app.server.gui.add_slider(
            parameter.label, min=0.0, max=1.0, step=1.0, initial_value=0.0, hint=parameter.hint, order=order
        )

        def changed(client: Client, view: View) -> View:
            sent = self.handle.value
            new = put(view, sent)
            if not math.isclose(parameter.get(new), sent, rel_tol=1e-9, abs_tol=1e-4):  # it was out of range
                self.load(new)
                taken = f"{parameter.label} cannot be {sent:g}; it is {self.handle.value:g} now."
                app.notify("Not taken", taken, "yellow", client)
            if not self.handle.min <= parameter.get(new) <= self.handle.max:  # typed beyond the slider's track
                self.load(new, with_value=False)
            return new

        app.choices.on_update(self.handle, lambda client: change(partial(changed, client), client))

    def load(self, view: View, *, with_value: bool = True) -> None:
        """Set the range and, by default, the value; the box shows as many decimals as a step has, at least one."""
        limits, handle, widest = self._parameter.track(view), self.handle, self._parameter.range(view)
        handle.widest = widest.low, widest.high
        handle.min, handle.max, handle.step = limits.low, limits.high, limits.step
        handle.disabled = not self._parameter.is_there(view)
        handle.precision = 0 if self._parameter.whole else max(1, math.ceil(-math.log10(limits.step)))
        if with_value:
            handle.value = round(self._parameter.get(view), 4)
