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
from dockpose.app.web.server import protection, start
from dockpose.app.web.server.gate import Gate
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


def test_a_message_without_its_size(monkeypatch, port):
    other = dataclasses.make_dataclass("FileTransferStartUpload", ["transfer_uuid", "filename", "bytes"])
    monkeypatch.setattr(messages, "FileTransferStartUpload", other)
    assert "FileTransferStartUpload" in refused(port)


def test_an_attribute_that_is_gone(monkeypatch, port):
    real = viser.GuiApi.__init__

    def init(self, *arguments, **keywords):
        real(self, *arguments, **keywords)
        del self._current_file_upload_states

    monkeypatch.setattr(viser.GuiApi, "__init__", init)
    assert "_current_file_upload_states" in refused(port)


def test_a_start_that_passes_the_guard_by(monkeypatch, port):
    monkeypatch.setattr(start, "guarded", lambda guard, gate, pages: contextlib.nullcontext())
    assert "HTTP request without the token is not refused" in refused(port)


def test_a_guard_that_sees_no_sockets(monkeypatch, port):
    """As if viser opened its WebSocket by another way than its pages."""
    refusal = Guard.refusal
    monkeypatch.setattr(
        Guard, "refusal", lambda self, headers, path: None if "Upgrade" in headers else refusal(self, headers, path)
    )
    assert "WebSocket request without the token is not refused" in refused(port)


def test_a_viser_that_starts_its_server_by_a_name_of_its_own(monkeypatch, port):
    """As after ``from websockets.asyncio.server import serve``: replacing the module's function has no effect there."""
    own = types.SimpleNamespace(serve=websocket_server.serve)
    bound = types.SimpleNamespace(asyncio=types.SimpleNamespace(server=own), exceptions=websockets.exceptions)
    bound.datastructures = websockets.datastructures
    monkeypatch.setattr(viser.infra._infra, "websockets", bound)
    assert "HTTP request without the token is not refused" in refused(port)


def test_a_guard_that_does_not_look_at_the_origin(monkeypatch, port):
    refusal = Guard.refusal

    def without_origin(self, headers, path):
        return refusal(self, Headers([pair for pair in headers.raw_items() if pair[0] != "Origin"]), path)

    monkeypatch.setattr(Guard, "refusal", without_origin)
    assert "another origin is not refused" in refused(port)


def test_messages_that_pass_the_gate_by(monkeypatch, port):
    monkeypatch.setattr(Gate, "stand_before", lambda self, connection, only_views: None)
    monkeypatch.setattr(protection, "_TIMEOUT_S", 1.0)
    assert "do not pass the gate" in refused(port)


def test_a_server_that_cannot_be_asked_before_it_answers(monkeypatch, port):
    monkeypatch.setattr(websocket_server, "serve", lambda handler, host, port: None)
    assert "checked before they are answered" in refused(port)


def test_handlers_that_stay(monkeypatch, port):
    monkeypatch.setattr(WebsockMessageHandler, "unregister_handler", lambda *_: None)
    assert "ShareUrlRequest" in refused(port)
