"""``dockpose calibrate``: pictures of a board in, a camera file out."""

from __future__ import annotations

import re
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from dockpose.app.errors import UserError
from dockpose.app.inputs.expand import expand
from dockpose.camera.calibrate import Board, BoardView, Calibration, CalibrationError, calibrate
from dockpose.camera.files import save_camera
from dockpose.camera.image import decode, to_grey, to_levels
from rich.console import Console
from rich.progress import track


def calibrate_folder(
    sources: Sequence[str],
    board: str,
    square_m: float,
    *,
    charuco: str | None = None,
    marker_m: float | None = None,
    lens: str = "perspective",
    out: Path = Path("camera.yaml"),
    file_format: str = "dockpose",
) -> int:
    """Calibrate a camera from pictures and write its file; a line a picture and the outcome go to standard output.

    Parameters
    ----------
    sources : folders, globs or pictures.
    board : columns x rows, as "10x7".
    square_m, marker_m : sides of its squares, and of a ChArUco board's markers, in metres.
    charuco : name of a ChArUco board's dictionary; None for a chessboard.
    lens : one of ``dockpose.camera.calibrate.LENSES``.
    out, file_format : the camera file; an existing one is replaced.

    Returns
    -------
    Exit status: 0, or 1 where a picture could not be read.

    Raises
    ------
    UserError
        if the board is no board, the pictures determine no camera, or the file cannot be written.
    """
    pattern = _board(board, square_m, charuco, marker_m)
    paths = expand(sources)
    try:
        done = calibrate(_pictures(paths), pattern, lens)
    except CalibrationError as error:
        raise UserError(f"{' '.join(sources)}: {error}") from error
    try:
        save_camera(done.camera, out, file_format)
    except OSError as error:
        raise UserError(f"--out {out}: cannot be written ({error.strerror or error})") from error
    for line in report(done, out):
        print(line)
    return 1 if any("cannot be read" in view.dropped for view in done.views) else 0


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


def _board(text: str, square_m: float, charuco: str | None, marker_m: float | None) -> Board:
    match = re.fullmatch(r"(\d+)\s*[xX×*]\s*(\d+)", text.strip())
    if match is None:
        raise UserError(f"--board {text}: must be columns x rows, as 10x7")
    try:
        return Board(int(match[1]), int(match[2]), square_m, charuco, marker_m)
    except ValueError as error:
        raise UserError(f"--board {text}, --square, --charuco, --marker: {error}") from error


def _pictures(paths: Sequence[Path]) -> Iterator[tuple[str, np.ndarray | None]]:
    """Names and grey pictures of 8 bits, None for what cannot be read; with a progress bar on standard error."""
    console = Console(file=sys.stderr)
    for path in track(paths, "Looking for the board", console=console, disable=not console.is_terminal):
        try:
            yield path.name, to_levels(to_grey(decode(path.read_bytes(), str(path))))[0]
        except (OSError, ValueError):
            yield path.name, None
