"""The fuzz target "message": what a browser sends, through the gate's checks, without a socket."""

import contextlib
import functools
from collections.abc import Mapping
from typing import Any

import msgspec
import viser
from dockpose.app.web.server import start
from dockpose.app.web.server.guard import Guard
from dockpose.app.web.server.messages import RefusedError, check_message
from viser import _messages as messages

from tests.support.visitors import VIEWPOINT, packed


@functools.cache
def page() -> tuple[viser.ViserServer, Mapping[str, Any]]:
    """A server with a control of each kind, and those that can be set by their ids."""
    server = start.open_server("127.0.0.1", 0, Guard("127.0.0.1"))
    gui = server.gui
    with gui.add_form("form"):
        gui.add_text("text", "")
    gui.add_slider("slider", min=0.5, max=10.0, step=0.5, initial_value=1.0)
    gui.add_slider("whole", min=0, max=255, step=1, initial_value=7)
    gui.add_number("number", 10, min=0, max=64)
    gui.add_number("free", 1.0)
    gui.add_dropdown("choice", ("one", "two"))
    gui.add_button_group("buttons", ("left", "right"))
    gui.add_button("button")
    gui.add_checkbox("box", False)
    gui.add_vector2("corner", (1.0, 1.0), min=(0.0, 0.0))
    with start.silence():
        server.stop()  # its controls are all that is needed
    return server, gui._gui_input_handle_from_uuid


def seeds() -> list[bytes]:
    """Messages as the page sends them: of each kind, and for each control."""
    _, controls = page()
    some = [
        VIEWPOINT,
        messages.FileTransferStartUpload("a", "b", "c.png", "image/png", 1, 9),
        messages.FileTransferPart("a", "b", 0, b"123456789"),
        messages.GetRenderResponseMessage(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\0\4\0\0\0\4", "a"),
        messages.CommandTriggerMessage("a"),
        messages.GuiFormSubmitMessage("a"),
    ]
    values = [messages.GuiUpdateMessage(uuid, {"value": one.value}) for uuid, one in controls.items()]
    return [packed(message) for message in (*some, *values)]


def take(raw: bytes) -> None:
    """Check a message; what passes must be what the library can read, take over and send on.

    Raises
    ------
    RefusedError
        Where it is refused.
    """
    server, controls = page()
    containers = server.gui._container_handle_from_uuid
    with contextlib.suppress(RefusedError):
        check_message(raw, controls.get, containers.get, only_views=True)
    check_message(raw, controls.get, containers.get)
    read = messages.Message.deserialize(raw)
    if isinstance(read, messages.GuiUpdateMessage):
        state, value = controls[read.uuid]._impl, read.updates["value"]
        cast = tuple(map(float, value)) if isinstance(state.value, tuple) else type(state.value)(value)
        sent = messages.GuiUpdateMessage(read.uuid, {"value": cast})
        msgspec.msgpack.encode(sent.as_serializable_dict([]))
