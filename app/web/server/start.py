"""Starting the viser server, guarded, on exactly the port that was asked for; and the access token of a port."""

import contextlib
import io
import os
import re
import secrets
import socket
from pathlib import Path

import viser
from dockpose.app.state.tank import write_whole
from dockpose.app.web.server import viser_private
from dockpose.app.web.server.guard import Guard, guarded
from dockpose.app.web.server.journal import JOURNAL, log_failure, log_unhandled
from dockpose.app.web.server.pages import own_pages
from dockpose.app.web.server.protection import check_names, check_running, refuse_if
from dockpose.app.web.server.values import passes

_TOKEN = re.compile(r"[A-Za-z0-9_-]{24}")
_BYTES = 18  # 24 letters


class PortBusyError(OSError):
    """The port cannot be had; the text names it and says why."""


def open_server(host: str, port: int, guard: Guard) -> viser.ViserServer:
    """Start serving."""
    check_names()
    viser_private.log_failures_by(log_failure)
    viser_private.wake_from_the_loop()
    check_port_is_free(host, port)
    viser_private.hear_only_values(passes)
    with silence(), guarded(guard, own_pages()):
        server = viser.ViserServer(host=host, port=port, label="dockpose", verbose=False)
    try:
        if port not in (0, server.get_port()):  # taken between the check and viser's own attempt
            raise PortBusyError(_busy(host, port, "another program took it just now"))
        refuse_if(viser_private.what_is_missing(server))
        viser_private.refuse_from_all(server)
        viser_private.protect_broadcasts(server)
        viser_private.log_unhandled_by(server, log_unhandled)
        JOURNAL.is_silent = True  # the refusals of the check are our own
        check_running(server, guard)
    except BaseException:
        with silence():
            server.stop()
        raise
    finally:
        JOURNAL.is_silent = False
    return server


def reachable_hosts(host: str) -> list[str]:
    """Names for addresses that open a page served on ``host``: for this machine first, then for others."""
    if host not in ("0.0.0.0", "::", ""):
        return [f"[{host}]" if ":" in host else host]
    found = ["127.0.0.1"]
    with contextlib.suppress(OSError), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        # Nothing is sent: the system only says which of its addresses would be used. The address is for documentation.
        probe.connect(("192.0.2.1", 9))
        found.append(probe.getsockname()[0])
    with contextlib.suppress(OSError):
        found += [str(place[4][0]) for place in socket.getaddrinfo(socket.gethostname(), None, socket.AF_INET)]
    return list(dict.fromkeys(found))


def check_port_is_free(host: str, port: int) -> None:
    """Raise PortBusyError unless the port can be listened on: viser would silently take the next one."""
    try:
        places = socket.getaddrinfo(host, port, type=socket.SOCK_STREAM, flags=socket.AI_PASSIVE)
    except OSError as error:
        raise PortBusyError(f"the host {host!r} is not known ({error.strerror or error})") from error
    for family, kind, protocol, _, place in places:
        with socket.socket(family, kind, protocol) as attempt:
            if os.name == "posix":  # a port that was just given up counts as free
                attempt.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                attempt.bind(place)
            except OSError as error:
                raise PortBusyError(_busy(host, port, error.strerror or str(error))) from error


def _busy(host: str, port: int, reason: str) -> str:
    return f"port {port} on {host} cannot be used ({reason}); choose another one with --port"


def silence() -> contextlib.redirect_stdout[io.StringIO]:
    """Keep viser's banner off standard output."""
    return contextlib.redirect_stdout(io.StringIO())


def token_for(folder: Path | None, name: str) -> str:
    """Return the token of that name, as ``8080``; a new one where none is kept or it could have leaked."""
    new = secrets.token_urlsafe(_BYTES)
    if folder is None:
        return new
    path = folder / f"token-{name}"
    with contextlib.suppress(OSError, UnicodeDecodeError):
        kept = path.read_text(encoding="ascii").strip()
        if _TOKEN.fullmatch(kept) and _is_private(path):
            return kept
    with contextlib.suppress(OSError):
        write_whole(path, new + "\n")
    return new


def _is_private(path: Path) -> bool:
    """Whether nobody but this user can have read or written a file; always where files have no such owners."""
    if not hasattr(os, "getuid"):
        return True
    about = path.lstat()
    return about.st_uid == os.getuid() and not about.st_mode & 0o077
