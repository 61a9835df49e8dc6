"""Checks that the installed viser has what the guard and the upload cap rely on; without it, nothing is served.

viser offers no place for either, so both reach into its private parts, which any version may change.
"""

from __future__ import annotations

import contextlib
import dataclasses
import http.client
import inspect
from importlib.metadata import version

import viser
import websockets.asyncio.server as websocket_server
from dockpose.app.errors import UserError
from dockpose.app.web.server.guard import CONTENT_POLICY
from viser import _messages as messages

_TIMEOUT_S = 10.0
_CLOSED = ("ShareUrlRequest", "FileTransferStartUpload", "FileTransferPart")  # messages without a shared handler
_FIELDS = {
    "ShareUrlRequest": (),
    "GuiUpdateMessage": ("updates",),
    "FileTransferStartUpload": ("source_component_uuid", "transfer_uuid", "filename", "size_bytes"),
    "FileTransferPart": ("transfer_uuid", "content"),
    "FileTransferPartAck": ("source_component_uuid", "transfer_uuid", "transferred_bytes", "total_bytes"),
}
_METHODS = {
    "_handle_gui_updates": ("self", "client_id", "message"),
    "_handle_file_transfer_start": ("self", "client_id", "message"),
    "_handle_file_transfer_part": ("self", "client_id", "message"),
    "_finish_file_upload": ("self", "client_id", "transfer_uuid", "source_component_uuid"),
}
_GUI_PARTS = ("_websock_interface", "_current_file_upload_states", "_thread_executor")
_CONNECTION_PARTS = ("register_handler", "unregister_handler", "queue_message", "_incoming_handlers")
_UPGRADE = {
    "Connection": "Upgrade",
    "Upgrade": "websocket",
    "Sec-WebSocket-Version": "13",
    "Sec-WebSocket-Key": "AAAAAAAAAAAAAAAAAAAAAA==",
}


class UnprotectedError(UserError):
    """The installed viser would leave the page unprotected; the text says in what."""

    def __init__(self, what: str) -> None:
        super().__init__(
            f"viser {version('viser')} would leave the page unprotected ({what}), so nothing is served; "
            "install the version of viser that dockpose asks for"
        )


def check_names() -> None:
    """Raise UnprotectedError unless viser has every message, method and hook that is relied on, before it starts."""
    if "process_request" not in inspect.signature(websocket_server.serve).parameters:
        raise UnprotectedError("requests cannot be checked before they are answered")
    for name, wanted in _FIELDS.items():
        kind = getattr(messages, name, None)
        fields = {field.name for field in dataclasses.fields(kind)} if dataclasses.is_dataclass(kind) else None
        if fields is None or not fields.issuperset(wanted):
            raise UnprotectedError(f"its message {name} is another")
    for name, wanted in _METHODS.items():
        method = getattr(viser.GuiApi, name, None)
        if method is None or tuple(inspect.signature(method).parameters) != wanted:
            raise UnprotectedError(f"its method {name} is another")


def check_parts(server: viser.ViserServer) -> None:
    """Raise UnprotectedError unless a server has the attributes through which uploads and values are taken over."""
    for owner, names in ((server.gui, _GUI_PARTS), (getattr(server, "_websock_server", None), _CONNECTION_PARTS)):
        missing = [name for name in names if not hasattr(owner, name)]
        if missing:
            raise UnprotectedError(f"{type(owner).__name__} has no {missing[0]}")
    if server.gui._websock_interface is not server._websock_server:
        raise UnprotectedError("controls receive messages by another way")


def check_running(server: viser.ViserServer) -> None:
    """Raise UnprotectedError unless a running server refuses whoever has no token, and takes no shared uploads."""
    handlers = server._websock_server._incoming_handlers
    for name in _CLOSED:
        if handlers.get(getattr(messages, name)):
            raise UnprotectedError(f"it still answers {name}")
    if server.gui._handle_gui_updates in handlers.get(messages.GuiUpdateMessage, ()):
        raise UnprotectedError("browsers could set any property of a control")
    for way, headers in (("HTTP", {}), ("WebSocket", _UPGRADE)):
        if not _refuses(server.get_host(), server.get_port(), headers):
            raise UnprotectedError(f"a {way} request without the token is not refused")


def _refuses(host: str, port: int, headers: dict[str, str]) -> bool:
    """Whether the guard, and nobody else, answers a request without the token with 403."""
    reachable = {"0.0.0.0": "127.0.0.1", "": "127.0.0.1", "::": "::1"}.get(host, host)
    try:
        with contextlib.closing(http.client.HTTPConnection(reachable, port, timeout=_TIMEOUT_S)) as connection:
            connection.request("GET", "/", headers={"Host": f"localhost:{port}"} | headers)
            answer = connection.getresponse()
            return answer.status == 403 and answer.getheader("Content-Security-Policy") == CONTENT_POLICY
    except (OSError, http.client.HTTPException):
        return False
