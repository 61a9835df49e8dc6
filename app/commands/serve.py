"""``dockpose serve``: the page in the browser."""

import argparse
import os
import re
import threading
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from dockpose.app.commands.arguments import camera_of, capture_of, dock_of, vehicle_of, warned
from dockpose.app.commands.console import EXIT_ALL_READ, Terminated, check_stopped, say
from dockpose.app.errors import UserError
from dockpose.app.resources import read_toml
from dockpose.app.web.server.options import DEFAULT_PORT, SESSIONS_FOLDER, Options
from dockpose.sources import Kind, kind_of
from dockpose.vehicle import Vehicle

if TYPE_CHECKING:
    from dockpose.app.export.mavlink import Autopilot
    from dockpose.app.web.app import App

KNOWN = {"port": {"default": DEFAULT_PORT}, "sessions": {"default": SESSIONS_FOLDER}}
_OPEN_WARNING = (
    "it listens on {host}, so every machine of that network can reach this page. Who has the address with its token "
    "can steer it and see its pictures; the connection is not encrypted. docs/sharing.md shows a proxy with TLS."
)

_ORIGIN = re.compile(r"https?://([a-z0-9.-]+|\[[0-9a-f:.]+\])(:\d{1,5})?", re.IGNORECASE)
_VARIABLE = "DOCKPOSE_"
_LOOK_S = 1.0  # how often it looks whether SIGTERM came to another thread, or was lost


def of_environment(environment: Mapping[str, str]) -> list[str]:
    """Words for the options that variables name, as DOCKPOSE_ALLOW_HOST; of one that may be repeated, several words."""
    tables, words = read_toml("options.toml"), []
    about = {name: how for table in tables["commands"]["serve"]["options"] for name, how in tables[table].items()}
    named = {_VARIABLE + name.lstrip("-").replace("-", "_").upper(): (name, how) for name, how in about.items()}
    given = {variable: value for variable, value in environment.items() if variable.startswith(_VARIABLE) and value}
    for variable, value in given.items():
        if variable not in named:
            raise UserError(f"{variable}: there is no such setting; there are {', '.join(sorted(named))}")
        name, how = named[variable]
        if how.get("action") == "store_true":
            words += [name] if value != "0" else []
        elif name.startswith("-"):
            words += [f"{name}={one}" for one in (value.split() if how.get("action") == "append" else [value])]
    return words


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose serve`` until it is interrupted; returns the exit status."""
    arguments.source = arguments.source or os.environ.get("DOCKPOSE_SOURCE") or None
    camera, dock = camera_of(arguments), dock_of(arguments)
    if not 0 <= arguments.port <= 65535:
        raise UserError(f"--port is {arguments.port}; it must be 0 to 65535")
    options = _options(arguments)
    with warned():
        from dockpose.app.web.app import App  # viser takes a second to import, which other commands need not wait for

        app = App(arguments.source, camera, dock, arguments.host, arguments.port, options)
        try:
            for line in _addresses(app, arguments.host):
                say(line)
            while not threading.Event().wait(_LOOK_S):
                check_stopped()
        except Terminated:
            raise
        except KeyboardInterrupt:
            say("stopped")
        finally:
            app.stop()
    return EXIT_ALL_READ


def _addresses(app: "App", host: str) -> Iterator[str]:
    from dockpose.app.web.server.guard import LOOPBACK_NAMES

    here, *elsewhere = app.addresses()
    yield f"the page is at {here} (Ctrl+C stops it)"
    yield from (f"from another machine: {address}" for address in elsewhere)
    if host not in LOOPBACK_NAMES:
        yield _OPEN_WARNING.format(host=host)


def _options(arguments: argparse.Namespace) -> Options:
    from dockpose.app.state.preferences import config_folder

    megabytes, folder, sessions = arguments.upload_limit_mb, arguments.folder, arguments.sessions
    if not 0 < megabytes < 1e6:
        raise UserError(f"--upload-limit-mb is {megabytes:g}; it must be above 0 and below a million")
    if folder is not None and not folder.is_dir():
        raise UserError(f"--folder {folder}: there is no such folder")
    if sessions.exists() and not sessions.is_dir():
        raise UserError(f"--sessions {sessions}: is not a folder")
    for origin in arguments.allow_frame:
        if _ORIGIN.fullmatch(origin) is None:
            raise UserError(f"--allow-frame {origin}: must be an origin without a path, as http://blueos.local")
    vehicle = vehicle_of(arguments)
    return Options(
        allow_hosts=tuple(arguments.allow_host),
        allow_frames=tuple(arguments.allow_frame),
        resume=arguments.resume,
        folder=None if folder is None else folder.resolve(),
        upload_limit_bytes=round(megabytes * 2**20),
        remember_in=config_folder(),
        sessions=sessions.resolve(),
        capture=capture_of(arguments, [] if arguments.source is None else [arguments.source]),
        topic=arguments.topic,
        autopilot=_autopilot(arguments, vehicle),
        vehicle=vehicle,
    )


def _autopilot(arguments: argparse.Namespace, vehicle: Vehicle | None) -> "Autopilot | None":
    """The link to an autopilot, on which nothing is sent until somebody switches it on on the page."""
    if arguments.mavlink is None:
        return None
    if arguments.source is None or kind_of(arguments.source) not in (Kind.CAMERA, Kind.STREAM):
        raise UserError(f"--mavlink {arguments.mavlink}: sends what is seen now; give a camera or a stream")
    from dockpose.app.export.mavlink import Autopilot  # loads what takes long and is seldom asked for

    send, ids, made_for = arguments.mavlink_send, arguments.mavlink_ids, arguments.mavlink_for
    return Autopilot(arguments.mavlink, send, ids, arguments.mavlink_age, vehicle, say, is_on=False, made_for=made_for)
