"""Without what the guard and the upload cap rely on in viser, nothing is served."""

import contextlib
import dataclasses
import socket
import types

import pytest
import viser
import viser.infra._infra
import websockets.asyncio.server as websocket_server
import websockets.datastructures
import websockets.exceptions
from dockpose.app.errors import UserError
from dockpose.app.web.server import start
from dockpose.app.web.server.guard import Guard
from dockpose.app.web.server.protection import UnprotectedError
from dockpose.app.web.server.start import open_server
from viser import _messages as messages
from viser.infra import WebsockMessageHandler
from websockets import Headers


@pytest.fixture
def port():
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        return free.getsockname()[1]


def refused(port):
    """The sentence; afterwards nobody listens on the port."""
    with pytest.raises(UnprotectedError) as caught:
        open_server("127.0.0.1", port, Guard("127.0.0.1"))
    with socket.socket() as attempt:
        assert attempt.connect_ex(("127.0.0.1", port)) != 0
    assert isinstance(caught.value, UserError)
    text = str(caught.value)
    assert text.startswith(f"viser {viser.__version__} would leave the page unprotected (")
    assert "nothing is served" in text
    return text


@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0", "localhost"])
def test_the_viser_that_is_asked_for_is_protected(host):
    server = open_server(host, 0, Guard(host))
    with start.silence():
        server.stop()


@pytest.mark.parametrize("name", ["_handle_file_transfer_start", "_handle_file_transfer_part", "_finish_file_upload"])
def test_a_method_that_is_gone_or_takes_something_else(monkeypatch, port, name):
    monkeypatch.setattr(viser.GuiApi, name, lambda self, message: None)
    assert name in refused(port)
    monkeypatch.delattr(viser.GuiApi, name)
    assert name in refused(port)


@pytest.mark.parametrize("name", ["ShareUrlRequest", "FileTransferStartUpload", "FileTransferPartAck"])
def test_a_message_that_is_gone(monkeypatch, port, name):
    monkeypatch.delattr(messages, name)
    assert name in refused(port)


def init_without_states(self, *arguments, init=viser.GuiApi.__init__, **keywords):
    init(self, *arguments, **keywords)
    del self._current_file_upload_states


def pass_sockets(self, headers, path, refusal=Guard.refusal):
    """As if viser opened its WebSocket by another way than its pages."""
    return None if "Upgrade" in headers else refusal(self, headers, path)


def ignore_origin(self, headers, path, refusal=Guard.refusal):
    return refusal(self, Headers([pair for pair in headers.raw_items() if pair[0] != "Origin"]), path)


# As after ``from websockets.asyncio.server import serve``: replacing the module's function has no effect there.
OWN_NAME = types.SimpleNamespace(
    asyncio=types.SimpleNamespace(server=types.SimpleNamespace(serve=websocket_server.serve)),
    exceptions=websockets.exceptions,
    datastructures=websockets.datastructures,
)
WITHOUT_SIZE = dataclasses.make_dataclass("FileTransferStartUpload", ["transfer_uuid", "filename", "bytes"])


@pytest.mark.parametrize(
    ("owner", "name", "other", "words"),
    [
        (messages, "FileTransferStartUpload", WITHOUT_SIZE, "FileTransferStartUpload"),
        (viser.GuiApi, "__init__", init_without_states, "_current_file_upload_states"),
        (start, "guarded", lambda *_: contextlib.nullcontext(), "HTTP request without the token is not refused"),
        (Guard, "refusal", pass_sockets, "WebSocket request without the token is not refused"),
        (viser.infra._infra, "websockets", OWN_NAME, "HTTP request without the token is not refused"),
        (Guard, "refusal", ignore_origin, "another origin is not refused"),
        (viser.GuiApi, "_handle_gui_updates", lambda self, message: None, "_handle_gui_updates"),
        (websocket_server, "serve", lambda handler, host, port: None, "checked before they are answered"),
        (WebsockMessageHandler, "unregister_handler", lambda *_: None, "ShareUrlRequest"),
    ],
)
def test_whatever_else_is_not_as_it_is_relied_on(monkeypatch, port, owner, name, other, words):
    monkeypatch.setattr(owner, name, other)
    assert words in refused(port)
