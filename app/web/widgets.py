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
from dockpose.app.state.view import Limits, View
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


def add_slider(gui: viser.GuiApi, label: str, hint: str) -> viser.GuiSliderHandle[float]:
    """Add a slider whose range is still to be set by :func:`set_slider`."""
    return gui.add_slider(label, min=0.0, max=1.0, step=1.0, initial_value=0.0, hint=hint)


def set_slider(slider: viser.GuiSliderHandle[float], limits: Limits, value: float) -> None:
    """Set range and value of a slider; its box shows as many decimals as its steps have, at least one."""
    decimals = max(1, math.ceil(-math.log10(limits.step)))
    slider.min, slider.max, slider.step, slider.precision = limits.low, limits.high, limits.step, decimals
    slider.value = round(value, 4)
