"""Camera calibration from pictures of a chessboard or ChArUco board, with OpenCV."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from dockpose.camera.camera import Camera
from dockpose.checks import check_number, check_whole

LENSES = ("perspective", "rational", "fisheye")
FEWEST_PICTURES = 3
# A picture whose error exceeds both this multiple of the median error and this many pixels is an outlier.
_OUTLIER, _OUTLIER_PX = 3.0, 0.5
_WORST_SHARE = 0.003  # of the picture's longer side (2 px of 640); a fit with a larger error is rejected
_FEWEST_CORNERS = 8  # of a partly hidden ChArUco board
_FEWEST_ROWS = 3
# OpenCV 4 keeps its fisheye model's flags apart, and 5 among all others.
_FLAGS: Any = cv2.fisheye if hasattr(cv2.fisheye, "CALIB_FIX_SKEW") else cv2
_FISHEYE_FLAGS: int = _FLAGS.CALIB_USE_INTRINSIC_GUESS | _FLAGS.CALIB_RECOMPUTE_EXTRINSIC | _FLAGS.CALIB_FIX_SKEW


class CalibrationError(ValueError):
    """The pictures do not determine a camera; the text says why."""


@dataclass(frozen=True)
class Board:
    """A flat board of black and white squares.

    Parameters
    ----------
    columns, rows : int
        Number of squares, at least 3. For a chessboard the number of inner corners is accepted too.
    square_m : float, metres
        Side of a square.
    dictionary : str, optional
        Name of the ArUco dictionary of a ChArUco board, such as ``"DICT_4X4_50"``; None for a chessboard.
    marker_m : float, metres, optional
        Side of the ArUco markers; None for three quarters of a square.

    Raises
    ------
    ValueError
        If a number is out of range or the dictionary is unknown.
    """

    columns: int
    rows: int
    square_m: float
    dictionary: str | None = None
    marker_m: float | None = None

    def __post_init__(self) -> None:
        check_whole("columns", self.columns, least=_FEWEST_ROWS)
        check_whole("rows", self.rows, least=_FEWEST_ROWS)
        check_number("square_m", self.square_m, above=0)
        if self.marker_m is not None:
            check_number("marker_m", self.marker_m, above=0)
            if self.marker_m >= self.square_m:
                raise ValueError(f"marker_m is {self.marker_m!r}; it must be below the square's {self.square_m}")
        if self.dictionary is not None and not (
            self.dictionary.startswith("DICT_") and hasattr(cv2.aruco, self.dictionary)
        ):
            raise ValueError(f"dictionary is {self.dictionary!r}; it must be one of OpenCV's, such as DICT_4X4_50")


@dataclass(frozen=True)
class BoardView:
    """What became of one picture: its error, or why it was dropped.

    Attributes
    ----------
    name : str
        Name of the picture.
    error_px : float or None, pixels
        Root mean square reprojection error of its corners; None where no board was found.
    corners : int
        Number of corners found.
    dropped : str
        Why it was left out; empty where it was used.
    """

    name: str
    error_px: float | None
    corners: int
    dropped: str = ""


@dataclass(frozen=True)
class Calibration:
    """The result of a calibration.

    Attributes
    ----------
    camera : Camera
        The calibrated camera.
    error_px : float, pixels
        Root mean square reprojection error over all corners that were used.
    views : tuple of BoardView
        One entry per picture, used or dropped.
    counted_as : {"squares", "corners"}
        What the board's columns and rows were taken to count.
    """

    camera: Camera
    error_px: float
    views: tuple[BoardView, ...]
    counted_as: str


@dataclass(frozen=True)
class _Sighting:
    """A detected board: its corners on the board (N, 3) in metres, and in the picture (N, 2) in pixels."""

    name: str
    board_m: np.ndarray
    picture_px: np.ndarray


def calibrate(
    pictures: Iterable[tuple[str, np.ndarray | None]], board: Board, lens: str = "perspective"
) -> Calibration:
    """Calibrate a camera from pictures of a board.

    Parameters
    ----------
    pictures : iterable of (str, (H, W) uint8 array or None)
        Name and grey picture; None for a picture that could not be read. They are consumed one at a time, so they
        need not fit in memory together.
    board : Board
        The board in the pictures.
    lens : {"perspective", "rational", "fisheye"}
        Lens model, with 5, 8 and 4 distortion coefficients respectively.

    Returns
    -------
    Calibration
        The camera, the overall error and what became of each picture.

    Raises
    ------
    ValueError
        If the lens model is unknown.
    CalibrationError
        If fewer than three pictures show the board, or they do not determine the camera.

    Notes
    -----
    Outliers are dropped one at a time, and the rest calibrated again, until none is left. Calibrating underwater behind
    a flat port is only valid at the board's distance: calibrate in air instead, and give the port in the camera file.

    References
    ----------
    Zhang 2000, "A flexible new technique for camera calibration", as implemented in OpenCV.
    """
    if lens not in LENSES:
        raise ValueError(f"lens is {lens!r}; it must be one of {', '.join(LENSES)}")
    views, sightings, counted_as, size = _find_boards(pictures, board)
    if len(sightings) < FEWEST_PICTURES or size is None:
        raise CalibrationError(
            f"the board was found in {len(sightings)} of {len(views)} pictures; {FEWEST_PICTURES} are needed, better 15"
        )
    while True:
        camera, errors = _solve(sightings, size, lens)
        limit = max(_OUTLIER * float(np.median(errors)), _OUTLIER_PX)
        worst = int(np.argmax(errors))
        if errors[worst] <= limit or len(sightings) == FEWEST_PICTURES:
            break
        name = sightings[worst].name
        why = f"its error of {errors[worst]:.2f} px stands out from the others' {np.median(errors):.2f} px"
        views[name] = BoardView(name, float(errors[worst]), len(sightings[worst].picture_px), why)
        del sightings[worst]
    for sighting, error in zip(sightings, errors, strict=True):
        views[sighting.name] = BoardView(sighting.name, float(error), len(sighting.picture_px))
    corners = np.array([len(sighting.picture_px) for sighting in sightings])
    overall = float(np.sqrt((corners * errors**2).sum() / corners.sum()))
    if not overall <= _WORST_SHARE * max(size):
        raise CalibrationError(
            f"no camera fits the corners (error {overall:.1f} px); is the board {board.columns} x {board.rows}?"
        )
    return Calibration(camera, overall, tuple(views.values()), counted_as)


def _find_boards(
    pictures: Iterable[tuple[str, np.ndarray | None]], board: Board
) -> tuple[dict[str, BoardView], list[_Sighting], str, tuple[int, int] | None]:
    """Detect the board in each picture; all pictures must have the size of the first in which it was found."""
    views: dict[str, BoardView] = {}
    sightings: list[_Sighting] = []
    counted_as, size = "squares", None
    for name, grey in pictures:
        if grey is None:
            views[name] = BoardView(name, None, 0, "it cannot be read as a picture")
            continue
        own_size = (grey.shape[1], grey.shape[0])
        if size is not None and own_size != size:
            why = f"it is {own_size[0]} x {own_size[1]} pixels, the others are {size[0]} x {size[1]}"
            views[name] = BoardView(name, None, 0, why)
            continue
        ways = ("squares", "corners") if not sightings and board.dictionary is None else (counted_as,)
        for way in ways:
            found = _find_charuco(grey, board) if board.dictionary else _find_chessboard(grey, board, way)
            if found is not None:
                counted_as, size = way, own_size
                views[name] = BoardView(name, None, len(found[1]))
                sightings.append(_Sighting(name, *found))
                break
        else:
            views[name] = BoardView(name, None, 0, "no board was found in it")
    return views, sightings, counted_as, size


def _find_chessboard(grey: np.ndarray, board: Board, counted_as: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Corners on the board and in the picture; ``counted_as`` says what the board's numbers count."""
    inner = (board.columns - 1, board.rows - 1) if counted_as == "squares" else (board.columns, board.rows)
    found, corners = cv2.findChessboardCornersSB(grey, inner, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not found:
        return None
    column, row = np.meshgrid(np.arange(inner[0]), np.arange(inner[1]))
    flat = board.square_m * np.column_stack([column.ravel(), row.ravel(), np.zeros(column.size)])
    return flat.astype(np.float32), corners.reshape(-1, 2).astype(np.float32)


def _find_charuco(grey: np.ndarray, board: Board) -> tuple[np.ndarray, np.ndarray] | None:
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary or ""))
    marker_m = board.marker_m or 0.75 * board.square_m
    pattern = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, marker_m, dictionary)
    corners, numbers, _, _ = cv2.aruco.CharucoDetector(pattern).detectBoard(grey)
    if corners is None or numbers is None or len(corners) < _FEWEST_CORNERS:
        return None
    seen = [int(number) for number in np.ravel(np.asarray(numbers))]
    across = board.columns - 1
    if len({number // across for number in seen}) < 2 or len({number % across for number in seen}) < 2:
        return None
    places = [list(corner) for corner in pattern.getChessboardCorners()]
    flat = np.array([places[number] for number in seen], dtype=np.float32)
    return flat, np.asarray(corners).reshape(-1, 2).astype(np.float32)


def _solve(sightings: Sequence[_Sighting], size: tuple[int, int], lens: str) -> tuple[Camera, np.ndarray]:
    """The camera, and the root mean square error (N,) of each picture."""
    board = [sighting.board_m for sighting in sightings]
    picture = [sighting.picture_px for sighting in sightings]
    try:
        if lens == "fisheye":
            # Start from a field of view of 180 degrees across the picture; OpenCV's own initial guess often fails.
            focal = max(size) / np.pi
            start = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
            answer = cv2.fisheye.calibrate(
                [points[None].astype(float) for points in board],
                [points[None].astype(float) for points in picture],
                *(size, start, np.zeros(4)),
                flags=_FISHEYE_FLAGS,
            )
        else:
            flags = cv2.CALIB_RATIONAL_MODEL if lens == "rational" else 0
            answer = cv2.calibrateCamera(board, picture, size, np.eye(3), np.zeros(5), flags=flags)
    except cv2.error as error:
        raise CalibrationError(
            "the pictures do not determine the camera; take more, with the board tilted and in the corners"
        ) from error
    _, K, distortion, turns, shifts = answer
    coefficients = tuple(np.asarray(distortion).ravel()[: {"fisheye": 4, "rational": 8}.get(lens, 5)].tolist())
    if not np.isfinite(K).all() or not np.isfinite(coefficients).all() or K[0, 0] <= 0 or K[1, 1] <= 0:
        raise CalibrationError("the pictures lead to no finite focal length; take more, with the board tilted")
    numbers = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    camera = Camera(*numbers, *size, distortion=coefficients, fisheye=lens == "fisheye")
    errors = []
    for flat, seen, turn, shift in zip(board, picture, turns, shifts, strict=True):
        points = flat @ cv2.Rodrigues(np.asarray(turn))[0].T + np.asarray(shift).ravel()
        errors.append(np.sqrt(((camera.project(points) - seen) ** 2).sum(axis=1).mean()))
    return camera, np.nan_to_num(np.array(errors), nan=np.inf)
