"""Camera calibration: pictures of a board in, a camera and how sure it is out."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

import numpy as np
from dockpose.camera.board import Board, Sighting, find_board
from dockpose.camera.bundle import Sigmas
from dockpose.camera.camera import Camera
from dockpose.camera.coverage import Coverage, coverage_of, first_alike, poses_of
from dockpose.camera.fitting import (
    FEWEST,
    LENSES,
    TERMS,
    TILT,
    UNDETERMINED,
    WORST_SHARE,
    CalibrationError,
    Fitted,
    Lens,
    Rung,
    adjust_camera,
    climb,
    fit,
    sigmas_of,
)
from dockpose.camera.image import to_grey, to_levels
from dockpose.camera.sigma import with_errors
from dockpose.checks import check_is, check_one_of
from numpy.typing import ArrayLike

LENS_CHOICES = ("auto", *LENSES)
FEWEST_PICTURES = 3
# A picture whose error exceeds both this multiple of the median error and this many pixels is an outlier.
_OUTLIER, _OUTLIER_PX = 3.0, 0.5
_UNEVEN = 1.5  # or, relative to the median error, by chance alone: with a larger one a picture counts less
_UNSURE = 0.1  # of the focal length: with a larger standard error it is not known
_SHARPER = 0.8  # width of the edges, relative to those of a like picture, that makes a picture take its place
NO_BOARD, UNREADABLE, ALIKE = "no board was found in it", "it cannot be read as a picture", "it is like another"


@dataclass(frozen=True)
class BoardView:
    """What became of one picture: its error, or why it was dropped."""

    name: str  # name of the picture
    error_px: float | None  # root mean square reprojection error of its corners
    corners: int  # number of corners found
    dropped: str = ""  # why it was left out


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
    lens, sigmas : Lens, Sigmas
        The lens model, and the standard errors of the camera's numbers.
    rungs : tuple of Rung
        How well each lens model sees pictures that it was not fitted to; empty where the model was asked for, or there
        are too few pictures to tell.
    coverage, used : Coverage, tuple of Sighting
        What the boards cover, and those that were used.
    distances_m : (float, float), metres
        The least and the largest distance of a board.
    """

    camera: Camera
    error_px: float
    views: tuple[BoardView, ...]
    counted_as: str
    lens: Lens
    sigmas: Sigmas
    rungs: tuple[Rung, ...]
    coverage: Coverage
    used: tuple[Sighting, ...]
    distances_m: tuple[float, float]

    @property
    def fixed(self) -> tuple[str, ...]:
        """Coefficients that were left at 0, by name."""
        return () if self.lens.fisheye else tuple(term for term in TERMS if term not in self.lens.terms)


@dataclass
class Gathering:
    """Boards gathered from pictures, one after another."""

    board: Board  # the board in the pictures
    # whether a board that lies as another one did is left out, unless it is sharper, then it takes its place: for
    # frames of a video or a live camera
    distinct: bool = False
    sightings: list[Sighting] = field(default_factory=list)  # the boards that count
    views: dict[str, BoardView] = field(default_factory=dict)  # what became of each picture, by its name
    size: tuple[int, int] | None = None  # pixels: width and height of the pictures with a board
    counted_as: str = "squares"  # what the board's columns and rows count

    def add(self, name: str, grey: ArrayLike | None, *, thorough: bool = True) -> Sighting | None:
        """Look for the board in one more picture, (H, W) or (H, W, 3) BGR; None where it could not be read."""
        dropped, found = self._look(name, None if grey is None else to_levels(to_grey(grey))[0], thorough)
        if found is not None and not dropped and self.distinct:
            dropped = self._alike(found)
        self.views[name] = BoardView(name, None, 0 if found is None else len(found.picture_px), dropped)
        if found is not None and not dropped:
            self.sightings.append(found)
        return found

    def _look(self, name: str, grey: np.ndarray | None, thorough: bool) -> tuple[str, Sighting | None]:
        if grey is None:
            return UNREADABLE, None
        size = (grey.shape[1], grey.shape[0])
        if self.size is not None and size != self.size:
            return f"it is {size[0]} x {size[1]} pixels, the others are {self.size[0]} x {self.size[1]}", None
        undecided = not self.sightings and self.board.dictionary is None
        for way in ("squares", "corners") if undecided else (self.counted_as,):
            # Every picture that shows no board at all would take twice as long.
            found = find_board(grey, self.board, way, name, thorough=thorough and way == self.counted_as)
            if found is not None:
                self.counted_as, self.size = way, size
                return "", found
        return NO_BOARD, None

    def _alike(self, found: Sighting) -> str:
        """Why a board adds nothing to the others; empty where it does, or takes the place of a less sharp one."""
        columns, rows = (self.board.square_m * (count - 1) for count in self.board.inner(self.counted_as))
        index = first_alike(found, self.sightings, (columns, rows), self.size or (0, 0))
        if index == len(self.sightings):
            return ""
        other = self.sightings[index]
        if not found.edge_px < _SHARPER * other.edge_px:
            return ALIKE
        self.drop(other.name, ALIKE)
        return ""

    def drop(self, name: str, why: str) -> None:
        """Leave out a board that counted so far, for a reason."""
        self.sightings = [each for each in self.sightings if each.name != name]
        self.views[name] = BoardView(name, None, self.views[name].corners, why)


def calibrate_pictures(
    pictures: Iterable[tuple[str, ArrayLike | None]], board: Board, lens: str = "auto"
) -> Calibration:
    """Calibrate a camera from pictures (H, W) or (H, W, 3), None for one that cannot be read, each with its name."""
    check_one_of("lens", lens, LENS_CHOICES)
    check_is("board", board, Board)
    gathering = Gathering(board)
    for name, grey in pictures:
        gathering.add(name, grey)
    return calibrate_gathered(gathering, lens)


def calibrate_gathered(gathering: Gathering, lens: str = "auto") -> Calibration:
    """Calibrate a camera from gathered boards, by their residuals: outliers are dropped one at a time."""
    kept = replace(gathering, distinct=False, sightings=list(gathering.sightings), views=dict(gathering.views))
    if len(kept.sightings) < FEWEST_PICTURES or kept.size is None:
        count = "" if kept.sightings else ". Count its squares, those at the rim too, and show all of it"
        raise CalibrationError(
            f"a board of {kept.board.columns} x {kept.board.rows} squares was found in {len(kept.sightings)} of "
            f"{len(kept.views)} pictures; {FEWEST_PICTURES} are needed, better {2 * FEWEST} to 20{count}"
        )
    size, rungs = kept.size, ()
    _check_poses(kept, size)
    model = LENSES["k2" if lens == "auto" else lens]
    fitted = _without_outliers(kept, size, model)
    if lens == "auto":
        model, rungs = climb(kept.sightings, size)
        fitted = _without_outliers(kept, size, model)
    _check_poses(kept, size)
    fitted = _weighed(kept, fitted)
    for sighting, error in zip(kept.sightings, fitted.errors_px.tolist(), strict=True):
        kept.views[sighting.name] = BoardView(sighting.name, error, len(sighting.picture_px))
    corners = np.array([len(sighting.picture_px) for sighting in kept.sightings])
    overall = float(np.sqrt((corners * fitted.errors_px**2).sum() / corners.sum()))
    if not overall <= WORST_SHARE * max(size):
        board = kept.board
        text = f"no camera fits the corners (error {overall:.1f} px); is the board {board.columns} x {board.rows}, "
        raise CalibrationError(f"{text}and is it flat?")
    try:
        known = sigmas_of(fitted, kept.sightings)
    except ValueError as error:  # at the limit of what a camera can be
        raise CalibrationError(UNDETERMINED) from error
    unsure = max(known.values["fx"] / fitted.camera.fx, known.values["fy"] / fitted.camera.fy)
    if not unsure < _UNSURE:
        text = "the pictures cannot tell the focal length from the distance, since the board lies too much alike in "
        raise CalibrationError(f"{text}all: {TILT}")
    distances_m = np.linalg.norm(fitted.poses[:, 3:], axis=1)
    return Calibration(
        camera=with_errors(fitted.camera, model.names, known.covariance),
        error_px=overall,
        views=tuple(kept.views.values()),
        counted_as=kept.counted_as,
        lens=model,
        sigmas=known,
        rungs=rungs,
        coverage=coverage_of(kept.sightings, size, fitted.camera.fx),
        used=tuple(kept.sightings),
        distances_m=(float(distances_m.min()), float(distances_m.max())),
    )


def _check_poses(gathering: Gathering, size: tuple[int, int]) -> None:
    """Raise CalibrationError where boards lie alike, so that there are fewer poses than are needed."""
    count = int(poses_of(gathering.sightings, size).max()) + 1
    if count < FEWEST_PICTURES:
        alike = "alike" if count == 1 else f"in {count} ways only"
        text = f"the board lies {alike} in {len(gathering.sightings)} pictures; {FEWEST_PICTURES} poses are needed, "
        raise CalibrationError(f"{text}better {2 * FEWEST} to 20: {TILT}")


def _without_outliers(gathering: Gathering, size: tuple[int, int], lens: Lens) -> Fitted:
    """The fit to the gathered boards, after those that stand out were dropped."""
    while True:
        fitted = fit(gathering.sightings, size, lens)
        errors = fitted.errors_px
        limit = max(_OUTLIER * float(np.median(errors)), _OUTLIER_PX)
        worst = int(np.argmax(errors))
        if errors[worst] <= limit or len(gathering.sightings) == FEWEST_PICTURES:
            return fitted
        why = f"its error of {errors[worst]:.2f} px stands out from the others' {np.median(errors):.2f} px"
        gathering.drop(gathering.sightings[worst].name, why)


def _weighed(gathering: Gathering, fitted: Fitted) -> Fitted:
    """The fit in which boards whose errors stand out, as of blurred ones, count by these errors."""
    sigmas = fitted.errors_px / np.median(fitted.errors_px)
    if sigmas.max() < _UNEVEN:
        return fitted
    weighed = zip(gathering.sightings, np.maximum(1.0, sigmas).tolist(), strict=True)
    gathering.sightings = [replace(sighting, sigma=sigma) for sighting, sigma in weighed]
    return adjust_camera(gathering.sightings, fitted)
