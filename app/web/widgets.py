"""The panels of the page, one a file.

A panel builds its controls where it is made. ``load(view)`` sets them to the values of a view, ``show(analysis)`` shows
a result. What a person does in it goes out as a function from the present view to the next one.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Protocol

import viser
from dockpose.app.processing.analysis import Analysis
from dockpose.app.state.parameters import Parameter
from dockpose.app.state.view import View
from dockpose.app.web.server.uploads import ClientUploads, Receiver

YAML_FILES = ".yaml,.yml"


class Change(Protocol):
    """Applies a function to the present view, for the browser that asked for it."""

    def __call__(self, function: Callable[[View], View], client: viser.ClientHandle, *, reload: bool = False) -> None:
        """``reload``: the controls must follow, since they were not what changed the view."""
        ...


class Panel(Protocol):
    """What the server asks of every panel."""

    def load(self, view: View) -> None:
        """Set the controls to the values of a view."""
        ...

    def show(self, analysis: Analysis) -> None:
        """Show what was found; called from the worker's thread."""
        ...


class Uploader(Protocol):
    """A panel that takes files."""

    def add_upload(self, client: viser.ClientHandle, uploads: ClientUploads) -> None:
        """Give one browser its upload button."""
        ...


def on_change(handle: Any, change: Change, function: Callable[[View], View], *, reload: bool = False) -> None:
    """Apply ``function`` to the view whenever a person changes this control.

    The function must read the control's value itself. It runs with the view locked, and viser calls back out of
    order, so that only the value at that moment is surely the newest.
    """

    @handle.on_update
    def _(event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:  # None: the program itself set the value
            change(function, event.client, reload=reload)


def on_click(button: viser.GuiButtonHandle, act: Callable[[viser.ClientHandle], None]) -> None:
    """Call ``act`` with the browser in which a person presses this button."""

    @button.on_click
    def _(event: viser.GuiEvent[Any]) -> None:
        if event.client is not None:
            act(event.client)


def add_file_button(
    area: viser.GuiFolderHandle,
    client: viser.ClientHandle,
    uploads: ClientUploads,
    receiver: Receiver,
    label: str,
    hint: str,
    *,
    mime_type: str = YAML_FILES,
    order: float | None = None,
) -> None:
    """Give one browser a button in ``area`` that sends a file to ``receiver``.

    A shared one would show each browser the uploads of the others.
    """
    with area:
        button = client.gui.add_upload_button(
            label, icon=viser.Icon.UPLOAD, mime_type=mime_type, hint=hint, order=order
        )
    uploads.receive(button, receiver)


class Slider:
    """A slider with a typed value that sets one parameter of the view.

    Parameters
    ----------
    gui : viser.GuiApi
        Where to build it.
    parameter : Parameter
        What it sets; see :data:`dockpose.app.state.parameters.PARAMETERS`.
    change : Change
        Applies what a person does.
    put : callable, optional
        ``put(view, value)`` in place of the parameter's own.
    reload : bool
        Whether other controls follow.
    """

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
        on_change(self.handle, change, lambda view: put(view, self.handle.value), reload=reload)

    def load(self, view: View, *, with_value: bool = True) -> None:
        """Set the range and, unless told otherwise, the value; the box shows the decimals of a step, at least one."""
        limits, handle = self._parameter.range(view), self.handle
        handle.min, handle.max, handle.step = limits.low, limits.high, limits.step
        handle.precision = 0 if self._parameter.whole else max(1, math.ceil(-math.log10(limits.step)))
        if with_value:
            handle.value = round(self._parameter.get(view), 4)
