"""Checks that viser has what ``viser_private.py`` and the guard rely on; without it, nothing is served."""

import contextlib
import http.client
import inspect
from importlib.metadata import version

import viser
import websockets.asyncio.server as websocket_server
from dockpose.app.errors import UserError
from dockpose.app.web.server import viser_private
from dockpose.app.web.server.guard import Guard, cookie_name

_TIMEOUT_S = 10.0
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


def refuse_if(what: str | None) -> None:
    """Raise UnprotectedError where something is not as it is relied on."""
    if what is not None:
        raise UnprotectedError(what)


def check_names() -> None:
    """Raise UnprotectedError unless viser has every message, method and hook that is relied on, before it starts."""
    if "process_request" not in inspect.signature(websocket_server.serve).parameters:
        raise UnprotectedError("requests cannot be checked before they are answered")
    refuse_if(viser_private.what_changed())


def check_running(server: viser.ViserServer, guard: Guard) -> None:
    """Raise UnprotectedError unless a running server refuses strangers."""
    refuse_if(viser_private.answered_to_all(server))
    host, port = server.get_host(), server.get_port()
    reachable = {"0.0.0.0": "127.0.0.1", "": "127.0.0.1", "::": "::1"}.get(host, host)
    named = {"Host": f"localhost:{port}"}
    cookie = {"Cookie": f"{cookie_name(named['Host'])}={guard.token}"}
    for way, headers in (("HTTP", {}), ("WebSocket", _UPGRADE)):
        if not _refuses(guard, reachable, port, named | headers):
            raise UnprotectedError(f"a {way} request without the token is not refused")
        if not _refuses(guard, reachable, port, named | headers | cookie | {"Origin": "http://another.example"}):
            raise UnprotectedError(f"a {way} request from the page of another origin is not refused")


def _refuses(guard: Guard, host: str, port: int, headers: dict[str, str]) -> bool:
    """Whether the guard, and nobody else, answers a request with 403."""
    try:
        with contextlib.closing(http.client.HTTPConnection(host, port, timeout=_TIMEOUT_S)) as connection:
            connection.request("GET", "/help", headers=headers)
            answer = connection.getresponse()
            return (
                answer.status == 403
                and answer.getheader("Content-Security-Policy") == guard.headers["Content-Security-Policy"]
            )
    except (OSError, http.client.HTTPException):
        return False
