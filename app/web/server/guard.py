"""Access control, which viser lacks: only requests of the page itself pass, from a browser that has shown the token."""

import asyncio
import contextlib
import hmac
import ipaddress
import secrets
from collections.abc import Callable, Iterable, Mapping
from contextlib import AbstractContextManager
from typing import Any
from urllib.parse import SplitResult, parse_qs, urlsplit

from dockpose.app.web.server.connections import SETTINGS, Connections
from dockpose.app.web.server.journal import JOURNAL, SOCKETS_LOG, client_of
from dockpose.app.web.server.pages import LOOK_PATH, MADE_HERE, WITHOUT_TOKEN, Page
from dockpose.app.web.server.viser_private import serving_through
from dockpose.text import printable
from websockets import Headers
from websockets.http11 import Request, Response

LOOPBACK_NAMES = ("127.0.0.1", "localhost", "::1")
_NONE = "'none'"
_UNFRAMED, _NO_FORMS = f"frame-ancestors {_NONE}", f"form-action {_NONE}"
_LONGEST_PATH = 255  # no page of ours has a longer one, and most file systems know none
# viser's page unpacks its script and style itself, so both are inline, and its decoder is WebAssembly; pictures and
# fonts come as data: and blob:. Nothing is loaded from or sent to another host; handlers in HTML do not run.
CONTENT_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'",
        "script-src-attr 'none'",
        "style-src 'self' 'unsafe-inline'",
        "img-src 'self' data: blob:",
        "font-src 'self' data:",
        "worker-src blob:",
        "connect-src 'self' blob: data:",
        "base-uri 'none'",
        _NO_FORMS,
        _UNFRAMED,
    )
)
_HEADERS = {"X-Content-Type-Options": "nosniff", "Referrer-Policy": "no-referrer", "Cache-Control": "no-store"}


class Guard:
    """Decides which requests pass: by one of our names, with the token shown once."""

    def __init__(
        self, host: str, more_names: Iterable[str] = (), token: str | None = None, frames: Iterable[str] = ()
    ) -> None:
        self.token = token or secrets.token_urlsafe(18)
        framing = " ".join(frames)  # who may show the page in a frame
        policy = CONTENT_POLICY.replace(_UNFRAMED, f"frame-ancestors {framing or _NONE}")
        self.is_framed, self.headers = bool(framing), _HEADERS | {"Content-Security-Policy": policy}
        self.headers |= {} if framing else {"X-Frame-Options": "DENY"}
        # A name, or the whole address of a page, which may then ask though a proxy passes on another Host.
        more = [name.lower().rstrip("/") for name in more_names]
        self._origins = {name for name in more if "://" in name}
        self._names = {*LOOPBACK_NAMES, host.lower(), *more, *(_split(name).hostname or "" for name in self._origins)}
        self.on_look: Callable[[Headers], None] = lambda headers: None  # called where a browser's look has changed
        self.made: dict[str, Callable[[], str]] = {}  # what pages have for this request alone, by their paths
        # Anyone can make a name point here (DNS rebinding), but not a bare address.
        self._takes_addresses = host not in LOOPBACK_NAMES

    def refusal(self, headers: Headers, path: str) -> str | None:
        """Why a request is refused, in a sentence; None where it may pass."""
        if (reason := self._refusal_of_sender(headers)) is not None:
            return reason
        if not self._shows_token(headers, path):
            return "Open the address that dockpose printed in the terminal; it ends in ?token= and some letters."
        if len(headers.get_all("Upgrade")) > 1:
            return "This asks for two protocols at once (Upgrade)."
        if len(path.partition("?")[0]) > _LONGEST_PATH or not path.isascii():
            return "No page here has such an address."
        return None

    def _refusal_of_sender(self, headers: Headers) -> str | None:
        """Why a request is refused by whom it asks, and who asks."""
        hosts, origins = headers.get_all("Host"), headers.get_all("Origin")
        if len(hosts) != 1 or not self._knows(hosts[0]):
            return "This page is not known by that name (Host). Use the address that dockpose printed."
        if len(origins) > 1 or (origins and not self._is_ours(origins[0].lower(), hosts[0].lower())):
            asking, asked = (printable(value[:80]) for value in (origins[0], hosts[0]))
            return (
                f"A page at {asking} (Origin) asked {asked} (Host), which only its own page may. Behind a proxy, let "
                f"that pass on the browser's Host, or start dockpose with --allow-host {asking}."
            )
        return None

    def stranger_page(self, headers: Headers, path: str) -> Page | None:
        """What one without the token is shown where the page may be framed: who it is, and a form for the token."""
        is_asked = self.is_framed and not is_upgrade(headers) and self._refusal_of_sender(headers) is None
        is_stranger = is_asked and not self._shows_token(headers, path)
        return WITHOUT_TOKEN.get(path.partition("?")[0]) if is_stranger else None

    def cookie(self, headers: Headers) -> str:
        """The cookie that identifies a browser from then on."""
        return f"{cookie_name(headers.get('Host', ''))}={self.token}; HttpOnly; SameSite=Strict; Path=/"

    def _shows_token(self, headers: Headers, path: str) -> bool:
        """Whether a request has the token: in its cookies, or its address unless it opens a WebSocket."""
        in_address = [] if is_upgrade(headers) else parse_qs(path.partition("?")[2]).get("token", [])
        shown = (*in_address, *_cookies(headers, cookie_name(headers.get("Host", ""))))
        return any(hmac.compare_digest(one.encode(errors="surrogateescape"), self.token.encode()) for one in shown)

    def _is_ours(self, origin: str, host: str) -> bool:
        return _split(origin).netloc == host or origin in self._origins

    def _knows(self, host: str) -> bool:
        name = (_split(f"//{host}").hostname or "").lower()
        with contextlib.suppress(ValueError):
            return name in self._names or (self._takes_addresses and bool(ipaddress.ip_address(name)))
        return False


def cookie_name(host: str) -> str:
    """Name of the cookie for a Host, with the port in it: browsers share cookies among the ports of a machine."""
    port = host.rpartition(":")[2]
    return f"dockpose_{port}" if port.isdecimal() else "dockpose"


def look_of(headers: Headers) -> set[str]:
    """What a browser says of itself in the cookie that static/layout.js sets: "dark", "software", and its id."""
    return {
        word for look in _cookies(headers, f"{cookie_name(headers.get('Host', ''))}_look") for word in look.split(".")
    }


def _cookies(headers: Headers, name: str) -> list[str]:
    parts = [part.strip().partition("=") for header in headers.get_all("Cookie") for part in header.split(";")]
    return [value for one, _, value in parts if one == name]


def is_upgrade(headers: Headers) -> bool:
    """Whether a request opens a WebSocket."""
    return any(value.lower() == "websocket" for value in headers.get_all("Upgrade"))


def guarded(guard: Guard, pages: Mapping[str, Page]) -> AbstractContextManager[None]:
    """Put the guard and our own pages in front of a viser server that is made within this context."""
    connections = Connections()

    def serve(real: Any, *arguments: Any, process_request: Any, **keywords: Any) -> Any:
        async def check(connection: Any, request: Request) -> Response | None:
            answer = _answer(guard, pages, connection, request, process_request)
            make = guard.made.get(request.path.partition("?")[0])
            if make is not None and answer is not None and answer.status_code == 200:
                answer.body = answer.body.replace(MADE_HERE, (await asyncio.to_thread(make)).encode(), 1)
                del answer.headers["Content-Length"]
                answer.headers["Content-Length"] = str(len(answer.body))
            if answer is None and not await connections.admit(connection):
                answer = _response(503, "Service Unavailable", Page("text/plain", b"Too many pages are opened.\n"))
            return answer

        keywords |= SETTINGS | {"logger": SOCKETS_LOG, "create_connection": connections.make}
        return real(*arguments, process_request=check, **keywords)

    return serving_through(serve)


def _answer(
    guard: Guard, pages: Mapping[str, Page], connection: Any, request: Request, otherwise: Any
) -> Response | None:
    """The answer to a request; None where it may open its WebSocket."""
    headers, path = request.headers, request.path
    response = None
    try:
        reason = guard.refusal(headers, path)
        if reason is not None and (greeting := guard.stranger_page(headers, path)) is not None:
            response = _response(200, "OK", greeting)
            policy = guard.headers["Content-Security-Policy"].replace(_NO_FORMS, "form-action 'self'")
            response.headers.update(guard.headers | {"Content-Security-Policy": policy})
            return response
        if reason is None and is_upgrade(headers):
            return otherwise(connection, request)
        if reason is None:
            response = _page(guard, pages, connection, request, otherwise)
    except Exception as error:  # whatever cannot be understood is refused
        reason = f"This request cannot be understood ({type(error).__name__})."
    if response is None:
        reason = str(reason)
        response = _response(403, "Forbidden", Page("text/plain; charset=utf-8", reason.encode()))
        # Nothing else of the request, for it may hold a token.
        named = [f"{name} {value[:80]!r}" for name in ("Host", "Origin") for value in headers.get_all(name)]
        JOURNAL.note(client_of(connection), f"refused a request: {reason} {', '.join(named)}")
    response.headers.update(guard.headers)
    return response


def _page(guard: Guard, pages: Mapping[str, Page], connection: Any, request: Request, otherwise: Any) -> Response:
    otherwise_page = otherwise(connection, request)  # called in any case, for it also silences the library's log
    path = request.path.partition("?")[0]
    if path == LOOK_PATH:
        guard.on_look(request.headers)
    page = pages.get(path)
    response = otherwise_page if page is None else _response(200, "OK", page)
    response.headers["Set-Cookie"] = guard.cookie(request.headers)
    return response


def _response(status: int, phrase: str, page: Page) -> Response:
    headers = Headers({"Content-Type": page.content_type, "Content-Length": str(len(page.body))})
    return Response(status, phrase, headers, page.body)


def _split(address: str) -> SplitResult:
    """The parts of an address; none of it where it is malformed."""
    try:
        return urlsplit(address)
    except ValueError:
        return SplitResult("", "", "", "", "")
