"""``dockpose calibrate``: pictures of a board in, a camera file out."""

from __future__ import annotations

import argparse
import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from dockpose.app.commands.arguments import Commands
from dockpose.app.commands.console import EXIT_ALL_READ, EXIT_SOME_UNREADABLE
from dockpose.app.errors import UserError, blaming, writing
from dockpose.app.inputs.pictures import expand
from dockpose.camera.calibrate import LENSES, Board, BoardView, Calibration, CalibrationError, calibrate
from dockpose.camera.files import FORMATS, save_camera
from dockpose.camera.image import decode, to_grey, to_levels
from rich.console import Console
from rich.progress import track


def add_parser(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add the command ``calibrate``."""
    parser = commands.add_parser("calibrate", help="make a camera file from pictures of a chessboard")
    parser.add_argument("sources", nargs="+", metavar="FOLDER", help="of pictures; or pictures, or a glob")
    parser.add_argument("--board", required=True, metavar="10x7", help="how many squares the board has")
    parser.add_argument("--square", required=True, type=float, metavar="M", help="side of a square, in metres")
    parser.add_argument("--charuco", metavar="DICT", help="dictionary of a ChArUco board, as DICT_4X4_50")
    parser.add_argument("--marker", type=float, metavar="M", help="side of its markers (default: 3/4 of a square)")
    parser.add_argument("--lens", default="perspective", choices=LENSES, help="default: %(default)s")
    parser.add_argument("--format", default="dockpose", choices=FORMATS, help="of the file (default: %(default)s)")
    parser.add_argument("--out", default="camera.yaml", metavar="C.yaml", type=Path, help="default: %(default)s")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run ``dockpose calibrate``; returns the exit status. A line a picture and the outcome go to standard output."""
    board, paths = _board(arguments), expand(arguments.sources)
    try:
        done = calibrate(_pictures(paths), board, arguments.lens)
    except CalibrationError as error:
        raise UserError(f"{' '.join(arguments.sources)}: {error}") from error
    with writing(f"--out {arguments.out}"):
        save_camera(done.camera, arguments.out, arguments.format)
    for line in report(done, arguments.out):
        print(line)
    unreadable = any("cannot be read" in view.dropped for view in done.views)
    return EXIT_SOME_UNREADABLE if unreadable else EXIT_ALL_READ


def report(done: Calibration, out: Path) -> Iterator[str]:
    """Lines that tell what became of each picture, and what the camera is."""
    width = max(len(view.name) for view in done.views)
    for view in done.views:
        yield f"{view.name:{width}}  {_outcome(view)}"
    camera = done.camera
    used = sum(not view.dropped for view in done.views)
    across, down = np.degrees(camera.field_of_view_rad)
    yield (
        f"{used} of {len(done.views)} pictures used, error {done.error_px:.3f} px; "
        f"fx {camera.fx:.1f}, fy {camera.fy:.1f}, cx {camera.cx:.1f}, cy {camera.cy:.1f} px, "
        f"{across:.1f} x {down:.1f} degrees in air"
    )
    if done.counted_as == "corners":
        yield "The board's numbers were taken to count its inner corners, since no board of so many squares was found."
    yield f"The camera is in {out}."


def _outcome(view: BoardView) -> str:
    if view.dropped:
        return f"dropped: {view.dropped}"
    return f"{view.error_px:.3f} px over {view.corners} corners"


def _board(arguments: argparse.Namespace) -> Board:
    match = re.fullmatch(r"(\d+)\s*[xX×*]\s*(\d+)", arguments.board.strip())
    if match is None:
        raise UserError(f"--board {arguments.board}: must be columns x rows, as 10x7")
    with blaming(f"--board {arguments.board}, --square, --charuco, --marker: "):
        return Board(int(match[1]), int(match[2]), arguments.square, arguments.charuco, arguments.marker)


def _pictures(paths: Sequence[Path]) -> Iterator[tuple[str, np.ndarray | None]]:
    """Names and grey pictures of 8 bits, None for what cannot be read; with a progress bar on standard error."""
    console = Console(file=sys.stderr)
    for path in track(paths, "Looking for the board", console=console, disable=not console.is_terminal):
        try:
            yield path.name, to_levels(to_grey(decode(path.read_bytes(), str(path))))[0]
        except (OSError, ValueError):
            yield path.name, None
