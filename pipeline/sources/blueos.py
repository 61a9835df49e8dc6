"""BlueOS's camera manager, which tells where a vehicle's streams are."""

import contextlib
import http.client
import json
import socket
from typing import Any
from urllib.parse import unquote, urlsplit

from dockpose.sources.frames import SourceError
from dockpose.text import printable, without_secrets

SCHEME = "blueos://"
_PORT, _MOST_BYTES = 6020, 2**20
_HERE = ("127.0.0.1", "localhost", "0.0.0.0", "::1")


def stream_of(address: str, timeout_s: float) -> str:
    """Return the stream behind ``blueos://HOST[:PORT][/NAME]``, the first that can be had. Raises SourceError."""
    try:
        parts = urlsplit(address)
        host, port, name = parts.hostname or "127.0.0.1", parts.port or _PORT, unquote(parts.path.strip("/"))
    except ValueError as error:
        raise SourceError(f"{address}: write it as blueos://192.168.2.2, or with a port and a stream's name") from error
    told = []
    for called, endpoint in _endpoints(address, host, port, timeout_s):
        is_wanted = name in ("", called)
        if is_wanted and (there := _reachable(endpoint, host)) is not None:
            return there
        shown = f"{without_secrets(printable(endpoint[:200]))} does not come here"
        told.append(shown if is_wanted else f"there is {printable(called[:80])!r}")
    why = "; ".join(told[:4]) or "no stream is running"
    raise SourceError(
        f"{address}: {why}. Give a stream of the vehicle's video page an RTSP endpoint, or a UDP one to here"
    )


def _endpoints(address: str, host: str, port: int, timeout_s: float) -> list[tuple[str, str]]:
    """Names and endpoints of the streams that run, as /streams lists them."""
    connection = http.client.HTTPConnection(host, port, timeout=timeout_s)
    try:
        with contextlib.closing(connection):
            connection.request("GET", "/streams", headers={"Accept": "application/json"})
            answer = connection.getresponse()
            content = answer.read(_MOST_BYTES)
    except (OSError, http.client.HTTPException) as error:
        why = getattr(error, "strerror", None) or str(error) or type(error).__name__
        raise SourceError(f"{address}: the camera manager at port {port} does not answer ({why})") from error
    if answer.status != 200:
        raise SourceError(f"{address}: the camera manager says {answer.status} when asked for its streams")
    try:
        streams: Any = json.loads(content)
        running = [one["video_and_stream"] for one in streams if one.get("running", True)]
        return [(str(one["name"]), str(end)) for one in running for end in one["stream_information"]["endpoints"]]
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError) as error:
        raise SourceError(f"{address}: port {port} answers, but not with a camera manager's streams") from error


def _reachable(endpoint: str, manager: str) -> str | None:
    """An endpoint as a source of ours; None where it goes to another machine or is of another kind."""
    try:
        parts = urlsplit(endpoint)
        host, port = parts.hostname or "", parts.port
    except ValueError:
        return None
    is_here = host in _HERE
    if parts.scheme in ("rtsp", "rtspt", "rtsps"):
        there = f"[{manager}]" if ":" in manager else manager
        return parts._replace(scheme="rtsp", netloc=f"{there}:{port or 554}").geturl() if is_here else endpoint
    if parts.scheme not in ("udp", "udp265", "rtp") or port is None or (is_here and manager not in _HERE):
        return None
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as attempt:
        attempt.bind(("127.0.0.1" if is_here else host, 0))  # which only an address of this machine can
        return f"rtp://:{port}"
    return None
