"""Boards of squares for calibration: where their corners are in a picture, and how sharp it is."""

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any

import cv2
import numpy as np
from dockpose.checks import check_number, check_whole

FEWEST_SQUARES = 3
_FEWEST_CORNERS = 8  # of a partly hidden ChArUco board
_LONGEST_PX = 1400  # larger pictures are searched at half this size first, and in the end at this
_LARGEST_PX = 1800  # to which smaller ones are enlarged in the end, at most to twice their size
_FLAT_SHARE = 0.08  # of the picture's longer side: lighting that varies over more than this is evened out
_QUICK: Any = partial(cv2.findChessboardCornersSB, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
# Boards of at least a size: the first sees large ones whole, and misses small ones that the second sees.
_LARGER = [cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_LARGER | more for more in (cv2.CALIB_CB_EXHAUSTIVE, 0)]
_ENOUGH = 6  # pictures that show a board of one size
_EXHAUSTIVE: Any = partial(cv2.findChessboardCornersSB, flags=cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE)
# Sees rims and bent boards that the others don't.
_CLASSIC: Any = partial(
    cv2.findChessboardCorners,
    flags=cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_FAST_CHECK,
)
_WINDOW = 0.3  # of a square: half the window in which a corner is refined
_ALTERNATES = 0.6  # correlation with black and white squares, below which corners are no board
_GOES_ON = 0.5  # contrast, relative to the board's own, of squares beyond its edge
_BLURRED = 0.3  # width of an edge, relative to the smallest square, above which a picture is blurred
_STEPS = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 40, 1e-4)


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
        check_whole("columns", self.columns, least=FEWEST_SQUARES)
        check_whole("rows", self.rows, least=FEWEST_SQUARES)
        check_number("square_m", self.square_m, above=0)
        if self.marker_m is not None:
            check_number("marker_m", self.marker_m, above=0)
            if self.marker_m >= self.square_m:
                raise ValueError(f"marker_m is {self.marker_m!r}; it must be below the square's {self.square_m}")
        if self.dictionary is not None and not (
            self.dictionary.startswith("DICT_") and hasattr(cv2.aruco, self.dictionary)
        ):
            raise ValueError(f"dictionary is {self.dictionary!r}; it must be one of OpenCV's, such as DICT_4X4_50")

    def inner(self, counted_as: str = "squares") -> tuple[int, int]:
        """Inner corners across and down, where the board's numbers count ``"squares"`` or ``"corners"``."""
        return (self.columns - 1, self.rows - 1) if counted_as == "squares" else (self.columns, self.rows)


@dataclass(frozen=True)
class Sighting:
    """A board that was found in a picture."""

    name: str  # name of the picture
    board_m: np.ndarray  # (N, 3): its corners on the board
    picture_px: np.ndarray  # (N, 2): its corners in the picture
    edge_px: float = float("nan")  # how wide its edges are between 10 and 90 % of their height
    sigma: float = 1.0  # standard error of its corners, relative to that of other pictures' corners

    @cached_property
    def _to_picture(self) -> np.ndarray | None:
        return cv2.findHomography(self.board_m[:, :2].astype(float), self.picture_px.astype(float))[0]

    def seen_px(self, points_m: np.ndarray) -> np.ndarray:
        """Where points (N, 2) of the board, in metres, are in the picture, seen or not: (N, 2) in pixels."""
        if self._to_picture is None:
            return np.full((len(points_m), 2), np.inf)
        return cv2.perspectiveTransform(points_m[None].astype(float), self._to_picture)[0]

    @property
    def is_blurred(self) -> bool:
        """Whether its edges are wide for its squares."""
        off = self.picture_px[:, None] - self.picture_px[None]
        smallest_px = np.sqrt((off**2).sum(axis=2) + 1e18 * np.eye(len(off))).min()
        return bool(self.edge_px > _BLURRED * smallest_px)


def count_squares(greys: Iterable[np.ndarray]) -> tuple[int, int] | None:
    """Columns and rows of squares of the chessboard that most pictures (H, W) of 8 bits show; None where none do."""
    found: Counter[tuple[int, int]] = Counter()
    for grey in greys:
        size = min(1.0, _LONGEST_PX / max(grey.shape))
        seen = cv2.resize(grey, None, fx=size, fy=size, interpolation=cv2.INTER_AREA)
        found_by = (cv2.findChessboardCornersSBWithMeta(seen, (FEWEST_SQUARES,) * 2, way) for way in _LARGER)
        meta = next((meta for is_there, _, meta in found_by if is_there), None)
        if meta is not None:  # which way it lies differs from picture to picture
            found[max(meta.shape) + 1, min(meta.shape) + 1] += 1
            if max(found.values()) >= _ENOUGH and max(found.values()) > found.total() / 2:
                break
    return max(found, key=lambda counts: (found[counts], counts), default=None)


def find_board(
    grey: np.ndarray, board: Board, counted_as: str = "squares", name: str = "", *, thorough: bool = True
) -> Sighting | None:
    """Find a board in a picture (H, W) (Duda and Frese 2018, "Accurate detection ... of checkerboard corners")."""
    if board.dictionary is not None:
        return _find_charuco(grey, board, name)
    inner = board.inner(counted_as)
    if min(inner) < FEWEST_SQUARES:
        return None
    even = _evened(grey)
    column, row = np.meshgrid(np.arange(inner[0]), np.arange(inner[1]))
    places = np.column_stack([column.ravel(), row.ravel()]).astype(float)
    for corners in _candidate_corners(grey, even, inner, thorough):
        if _is_whole_board(even, places, corners, inner):
            flat = board.square_m * np.column_stack([places, np.zeros(len(places))])
            return Sighting(name, flat.astype(np.float32), corners, _edge_px(even, corners, inner))
    return None


def _candidate_corners(
    grey: np.ndarray, even: np.ndarray, inner: tuple[int, int], thorough: bool
) -> Iterator[np.ndarray]:
    """Corners (N, 2) of what may be the chessboard, row by row, by ever slower searches; after one only the classic."""
    longest = max(grey.shape)
    scale = min(1.0, _LONGEST_PX / 2 / longest) if longest > _LONGEST_PX else 1.0
    searches = [(grey, scale, _QUICK), (even, scale, _CLASSIC), (even, scale / 2, _EXHAUSTIVE)]
    if thorough:
        searches.append((even, min(2 * scale, _LARGEST_PX / longest), _EXHAUSTIVE))
    was_seen = False
    for image, size, find in searches:
        if was_seen and find is not _CLASSIC:
            continue
        how = cv2.INTER_AREA if size < 1 else cv2.INTER_CUBIC
        seen = image if size == 1 else cv2.resize(image, None, fx=size, fy=size, interpolation=how)
        found, corners = find(seen, inner)
        if found:
            # Pixel centres are at integers, in both pictures.
            ratio = np.array(grey.shape[::-1]) / seen.shape[::-1]
            yield _refined(grey, ((corners.reshape(-1, 2) + 0.5) * ratio - 0.5).astype(np.float32), inner)
            was_seen = True


def _evened(grey: np.ndarray) -> np.ndarray:
    """The picture with the same brightness and contrast everywhere: lamps and haze under water vary them."""
    size = _FLAT_SHARE * max(grey.shape)
    # Means over large windows cost little on a small copy.
    few = 4 if min(grey.shape) >= 64 else 1
    picture = cv2.GaussianBlur(grey, (0, 0), 1.0).astype(np.float32)
    small = cv2.resize(picture, None, fx=1 / few, fy=1 / few, interpolation=cv2.INTER_AREA)
    mean = cv2.GaussianBlur(small, (0, 0), size / few)
    spread = np.sqrt(cv2.GaussianBlur((small - mean) ** 2, (0, 0), size / few)) + 1
    shape = grey.shape[::-1]
    return np.clip(128 + 50 * (picture - cv2.resize(mean, shape)) / cv2.resize(spread, shape), 0, 255).astype(np.uint8)


def _refined(grey: np.ndarray, corners: np.ndarray, inner: tuple[int, int]) -> np.ndarray:
    """Corners (N, 2) moved to the saddle points of brightness, where they are not so near that they would jump."""
    grid = corners.reshape(inner[1], inner[0], 2)
    nearest = min(np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1))
    half = int(np.clip(round(_WINDOW * float(nearest)), 2, 15))
    moved = cv2.cornerSubPix(grey, corners.copy().reshape(-1, 1, 2), (half, half), (-1, -1), _STEPS).reshape(-1, 2)
    far = np.linalg.norm(moved - corners, axis=1) > half / 2
    return np.where(far[:, None], corners, moved)


def _is_whole_board(even: np.ndarray, places: np.ndarray, corners: np.ndarray, inner: tuple[int, int]) -> bool:
    """Whether the board's squares are dark and bright in turn, and those beyond are not, as of a larger board."""
    to_picture, _ = cv2.findHomography(places, corners)
    if to_picture is None:
        return False
    across, down = inner
    own = _checks(even, to_picture, range(-1, across), range(-1, down))
    if own is None or abs(own[0]) < _ALTERNATES:
        return False
    sides = (
        (range(-2, -1), range(-1, down)),
        (range(across, across + 1), range(-1, down)),
        (range(-1, across), range(-2, -1)),
        (range(-1, across), range(down, down + 1)),
    )
    beyond = [_checks(even, to_picture, *side) for side in sides]
    # A rim of longer squares alternates there too, but the other way round.
    way = np.sign(own[0])
    return not any(side is not None and way * side[0] > _ALTERNATES and side[1] > _GOES_ON * own[1] for side in beyond)


def _checks(grey: np.ndarray, to_picture: np.ndarray, columns: range, rows: range) -> tuple[float, float] | None:
    """How like white and black squares in turn these are: correlation and contrast; None where few are in view."""
    column, row = (grid.ravel() for grid in np.meshgrid(np.array(columns), np.array(rows)))
    middles = np.column_stack([column + 0.5, row + 0.5])[None].astype(float)
    x, y = np.rint(cv2.perspectiveTransform(middles, to_picture)[0]).T
    seen = (x >= 0) & (y >= 0) & (x < grey.shape[1]) & (y < grey.shape[0])
    if seen.sum() < FEWEST_SQUARES:
        return None
    values = grey[y[seen].astype(int), x[seen].astype(int)].astype(float)
    signs = 1.0 - 2.0 * ((column + row)[seen] % 2)
    values, signs = values - values.mean(), signs - signs.mean()
    length = float(np.sqrt((values**2).sum() * (signs**2).sum()))
    if length == 0:
        return 0.0, 0.0
    return float(values @ signs) / length, abs(float(values @ signs / (signs @ signs)))


def _edge_px(grey: np.ndarray, corners: np.ndarray, inner: tuple[int, int]) -> float:
    """Width of the board's edges, those along or those across the board, whichever are more blurred (by motion)."""
    grid = corners.reshape(-1, 1, 2).astype(np.float32)
    widths = []
    for vertical in (False, True):
        try:
            measured, _ = cv2.estimateChessboardSharpness(grey, inner, grid, 0.8, vertical)
        except cv2.error:  # too small a board to measure
            continue
        width = float(np.ravel(measured)[0])
        if 0 < width < max(grey.shape):
            widths.append(width)
    return max(widths, default=float("nan"))


def _find_charuco(grey: np.ndarray, board: Board, name: str) -> Sighting | None:
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, board.dictionary or ""))
    marker_m = board.marker_m or 0.75 * board.square_m
    pattern = cv2.aruco.CharucoBoard((board.columns, board.rows), board.square_m, marker_m, dictionary)
    detector = cv2.aruco.CharucoDetector(pattern)
    for image in (grey, _evened(grey)):
        corners, numbers, _, _ = detector.detectBoard(image)
        if corners is None or numbers is None or len(corners) < _FEWEST_CORNERS:
            continue
        seen = np.ravel(numbers).astype(int)
        if min(len(np.unique(each)) for each in np.divmod(seen, board.columns - 1)) < 2:
            continue
        flat = np.array(pattern.getChessboardCorners(), dtype=np.float32)[seen]
        return Sighting(name, flat, np.asarray(corners).reshape(-1, 2).astype(np.float32))
    return None
