"""The program ``dockpose``: its arguments, and which command does the work."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Sequence
from pathlib import Path

from dockpose.app.commands import export as export_command
from dockpose.app.commands.arguments import add_camera_and_dock, add_masks, camera_of, dock_of, masks_of
from dockpose.app.commands.calibrate import calibrate_folder
from dockpose.app.commands.compare import compare_sources
from dockpose.app.commands.estimate import add_estimate_arguments, run_estimate
from dockpose.app.commands.replay import add_session_argument, run_session
from dockpose.app.errors import UserError
from dockpose.app.inputs.expand import expand
from dockpose.app.web.server.options import SESSIONS_FOLDER, Options
from dockpose.camera.calibrate import LENSES
from dockpose.camera.files import FORMATS
from dockpose.thresholds.compiled import on_compiling

COMMANDS = ("serve", "estimate", "compare", "export", "simulate", "calibrate")
EXIT_BAD_ARGUMENTS = 2
_COMPILING = "compiling the loops over pixels; the first run takes some seconds longer"


def main(argv: Sequence[str] | None = None) -> int:
    """Run the program. Returns its exit status: 0 all read, 1 some source could not be read, 2 bad arguments."""
    words = list(sys.argv[1:] if argv is None else argv)
    if not words or (words[0] not in COMMANDS and words[0] not in ("-h", "--help", "--version")):
        words.insert(0, "serve")
    arguments = _parser().parse_args(words)
    try:
        with on_compiling(lambda: print(f"dockpose: {_COMPILING}", file=sys.stderr, flush=True)):
            return arguments.run(arguments)
    except UserError as error:
        print(f"dockpose: {error}", file=sys.stderr)
        return EXIT_BAD_ARGUMENTS
    except KeyboardInterrupt:
        print("dockpose: stopped", file=sys.stderr)
        return 130
    except BrokenPipeError:  # the reader of our output went away, as `head` does
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 1


def _parser() -> argparse.ArgumentParser:
    from importlib.metadata import version

    parser = argparse.ArgumentParser(
        prog="dockpose",
        description="Where is the dock? Position and attitude of a ring of lights from one camera image. "
        "Without a command the page in the browser is opened on a sample scene.",
    )
    parser.add_argument("--version", action="version", version=f"dockpose {version('dockpose')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    serve = commands.add_parser("serve", help="open the page in the browser (this is what dockpose alone does)")
    serve.add_argument(
        "source",
        nargs="?",
        metavar="SOURCE",
        help="picture, folder, video, camera's number or stream to start with; default: a sample scene",
    )
    add_camera_and_dock(serve)
    serve.add_argument("--host", default="127.0.0.1", help="address to listen on (default: %(default)s, this machine)")
    serve.add_argument("--port", type=int, default=8080, help="port to listen on (default: %(default)s)")
    serve.add_argument("--folder", metavar="ROOT", type=Path, help="let the page show pictures of this folder")
    serve.add_argument(
        "--sessions",
        metavar="FOLDER",
        type=Path,
        default=SESSIONS_FOLDER,
        help="where the page keeps experiments; made with the first one (default: %(default)s)",
    )
    serve.add_argument(
        "--upload-limit-mb", type=float, default=200, metavar="MB", help="of all pictures sent to it (default: 200)"
    )
    serve.add_argument(
        "--allow-host",
        metavar="NAME",
        action="append",
        default=[],
        help="another name by which browsers may call it, as a reverse proxy's; may be given repeatedly",
    )
    serve.set_defaults(run=_serve)
    estimate = commands.add_parser("estimate", help="estimate the dock's pose in pictures, videos and live streams")
    add_estimate_arguments(estimate)
    add_session_argument(estimate)
    estimate.set_defaults(run=lambda arguments: _estimate(arguments, estimate))
    compare = commands.add_parser("compare", help="try every threshold method on pictures, up to the pose")
    compare.add_argument("sources", nargs="+", metavar="SOURCE", help="a picture, a folder of pictures, or a glob")
    add_camera_and_dock(compare)
    compare.add_argument("--json", metavar="FILE", help="write one JSON object a line; - for standard output")
    compare.add_argument("--montage", metavar="DIR", type=Path, help="write a picture of all methods side by side")
    add_masks(compare)
    compare.set_defaults(run=_compare)
    export_command.add_parser(commands)
    simulate = commands.add_parser("simulate", help="render pictures of a dock, with the truth beside them")
    simulate.add_argument("--scene", metavar="S.yaml", help="scene file (default: an approach from 20 m to 1 m)")
    simulate.add_argument("--seed", type=int, metavar="N", help="of all that is random (default: the scene file's)")
    simulate.add_argument("--frames", type=int, metavar="N", help="how many pictures (default: as the scene file says)")
    simulate.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        type=Path,
        help="folder for frame_0001.png and so on with truth.csv; or a video with its truth in a CSV beside it: "
        "NAME.mp4, or NAME.avi, which keeps every grey level",
    )
    simulate.set_defaults(run=_simulate)
    _add_calibrate(commands.add_parser("calibrate", help="make a camera file from pictures of a chessboard"))
    return parser


def _add_calibrate(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("sources", nargs="+", metavar="FOLDER", help="of pictures; or pictures, or a glob")
    parser.add_argument("--board", required=True, metavar="10x7", help="how many squares the board has")
    parser.add_argument("--square", required=True, type=float, metavar="M", help="side of a square, in metres")
    parser.add_argument("--charuco", metavar="DICT", help="dictionary of a ChArUco board, as DICT_4X4_50")
    parser.add_argument("--marker", type=float, metavar="M", help="side of its markers (default: 3/4 of a square)")
    parser.add_argument("--lens", default="perspective", choices=LENSES, help="default: %(default)s")
    parser.add_argument("--format", default="dockpose", choices=FORMATS, help="of the file (default: %(default)s)")
    parser.add_argument("--out", default="camera.yaml", metavar="C.yaml", type=Path, help="default: %(default)s")
    parser.set_defaults(run=_calibrate)


def _serve(arguments: argparse.Namespace) -> int:
    camera, dock = camera_of(arguments), dock_of(arguments)
    if not 0 <= arguments.port <= 65535:
        raise UserError(f"--port is {arguments.port}; it must be 0 to 65535")
    options = _options(arguments)
    from dockpose.app.web.app import serve  # viser takes a second to import, which the other commands need not wait for

    try:
        serve(arguments.source, camera, dock, host=arguments.host, port=arguments.port, options=options)
    except (OSError, ValueError) as error:
        raise UserError(str(error)) from error
    return 0


def _options(arguments: argparse.Namespace) -> Options:
    from dockpose.app.state.preferences import config_folder

    megabytes, folder, sessions = arguments.upload_limit_mb, arguments.folder, arguments.sessions
    if not 0 < megabytes < 1e6:
        raise UserError(f"--upload-limit-mb is {megabytes:g}; it must be above 0 and below a million")
    if folder is not None and not folder.is_dir():
        raise UserError(f"--folder {folder}: there is no such folder")
    if sessions.exists() and not sessions.is_dir():
        raise UserError(f"--sessions {sessions}: is no folder")
    return Options(
        allow_hosts=tuple(arguments.allow_host),
        folder=None if folder is None else folder.resolve(),
        upload_limit_bytes=round(megabytes * 2**20),
        remember_in=config_folder(),
        sessions=sessions.resolve(),
    )


def _estimate(arguments: argparse.Namespace, parser: argparse.ArgumentParser) -> int:
    if arguments.session is not None:
        return run_session(arguments)
    if not arguments.sources:
        parser.error("give a SOURCE, or --session FOLDER")
    return run_estimate(arguments)


def _compare(arguments: argparse.Namespace) -> int:
    camera, dock, masks = camera_of(arguments), dock_of(arguments), masks_of(arguments)
    return compare_sources(expand(arguments.sources), camera, dock, masks, arguments.json, arguments.montage)


def _simulate(arguments: argparse.Namespace) -> int:
    from dockpose.app.commands.simulate import simulate  # rich's bars take a moment to import

    return simulate(arguments.scene, arguments.seed, arguments.frames, arguments.out)


def _calibrate(arguments: argparse.Namespace) -> int:
    return calibrate_folder(
        arguments.sources,
        arguments.board,
        arguments.square,
        charuco=arguments.charuco,
        marker_m=arguments.marker,
        lens=arguments.lens,
        out=arguments.out,
        file_format=arguments.format,
    )


if __name__ == "__main__":
    sys.exit(main())
