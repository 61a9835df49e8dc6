"""``dockpose serve``: the page in the browser."""

import argparse
import threading
from collections.abc import Callable

from dockpose import Camera, Dock
from dockpose.app.commands.arguments import Commands, add_options, camera_of, dock_of, wishes_of
from dockpose.app.commands.console import EXIT_ALL_READ, Terminated, say
from dockpose.app.commands.logging_options import warned
from dockpose.app.errors import UserError
from dockpose.app.web.server.options import DEFAULT_PORT, DEFAULTS, SESSIONS_FOLDER, Options

_OPEN_WARNING = (
    "it listens on {host}, so every machine of that network can reach this page. Who has the address with its token "
    "can steer it and see its pictures; the connection is not encrypted. docs/sharing.md shows a proxy with TLS."
)


def add_parser(commands: Commands) -> None:
    """Add the command ``serve``."""
    parser = commands.add_parser("serve", help="open the page in the browser (this is what dockpose alone does)")
    add_options(parser, "serve_source", "camera_and_dock", "topic", "wishes")
    add_options(parser, "serve", port={"default": DEFAULT_PORT}, sessions={"default": SESSIONS_FOLDER})


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose serve``; returns the exit status."""
    camera, dock = camera_of(arguments), dock_of(arguments)
    if not 0 <= arguments.port <= 65535:
        raise UserError(f"--port is {arguments.port}; it must be 0 to 65535")
    options = _options(arguments)
    with warned():
        serve(arguments.source, camera, dock, host=arguments.host, port=arguments.port, options=options)
    return EXIT_ALL_READ


def _options(arguments: argparse.Namespace) -> Options:
    from dockpose.app.state.preferences import config_folder

    megabytes, folder, sessions = arguments.upload_limit_mb, arguments.folder, arguments.sessions
    if not 0 < megabytes < 1e6:
        raise UserError(f"--upload-limit-mb is {megabytes:g}; it must be above 0 and below a million")
    if folder is not None and not folder.is_dir():
        raise UserError(f"--folder {folder}: there is no such folder")
    if sessions.exists() and not sessions.is_dir():
        raise UserError(f"--sessions {sessions}: is not a folder")
    return Options(
        allow_hosts=tuple(arguments.allow_host),
        folder=None if folder is None else folder.resolve(),
        upload_limit_bytes=round(megabytes * 2**20),
        remember_in=config_folder(),
        sessions=sessions.resolve(),
        view_link=arguments.view_token,
        wishes=wishes_of(arguments, [] if arguments.source is None else [arguments.source]),
        topic=arguments.topic,
    )


def serve(
    source: str | None,
    camera: Camera | None,
    dock: Dock | None,
    host: str = "127.0.0.1",
    port: int = DEFAULT_PORT,
    options: Options = DEFAULTS,
    report: Callable[[str], None] = say,
) -> None:
    """Serve the page until it is interrupted."""
    from dockpose.app.web.app import App  # viser takes a second to import, which the other commands need not wait for
    from dockpose.app.web.server.guard import LOOPBACK_NAMES

    app = App.build(source, camera, dock, host=host, port=port, options=options)
    try:
        here, *elsewhere = app.addresses()
        report(f"the page is at {here} (Ctrl+C stops it)")
        for address in elsewhere:
            report(f"from another machine: {address}")
        if options.view_link:
            report(f"for viewers, who can change nothing: {' or '.join(app.addresses(for_viewers=True))}")
        if host not in LOOPBACK_NAMES:
            report(_OPEN_WARNING.format(host=host))
        threading.Event().wait()
    except Terminated:
        raise
    except KeyboardInterrupt:
        report("stopped")
    finally:
        app.stop()
