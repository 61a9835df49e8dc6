"""Cameras fitted to the corners of boards, by lens models of growing freedom."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from dockpose.camera.board import Sighting
from dockpose.camera.bundle import STEP, Shared, Sigmas, adjust, residuals, rms_px, settled_pose, sigmas
from dockpose.camera.camera import Camera
from dockpose.camera.coverage import poses_of
from msgspec.structs import replace

TERMS = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_SHORTEST = 0.05  # focal length of any lens, relative to the picture's longer side
# OpenCV 4 keeps its fisheye model's flags apart, and 5 among all others.
_FLAGS: Any = cv2.fisheye if hasattr(cv2.fisheye, "CALIB_FIX_SKEW") else cv2
_FISHEYE_FLAGS: int = _FLAGS.CALIB_USE_INTRINSIC_GUESS | _FLAGS.CALIB_RECOMPUTE_EXTRINSIC | _FLAGS.CALIB_FIX_SKEW
# Distortion of a pinhole in terms of a fisheye lens: tan(a) = a + a^3 / 3 + 2 a^5 / 15 + ...
_PINHOLE_AS_FISHEYE = (1 / 3, 2 / 15)
_FOLDS = 6
_SPECIAL = ("fisheye", "rational")  # models that must be clearly better, by this factor, than the others
_EARNS = 0.95
_BY_CHANCE = 2.0
_LEAST_PX2 = 1e-8
FEWEST = 6  # poses of the board; fewer are too few to leave any out
_FEW = 3  # poses, which hardly tell one coefficient


class CalibrationError(ValueError):
    """The pictures do not determine a camera; the text says why."""


TILT = "tilt the board by 20 to 40 degrees, another way in each picture, and show it in the corners too"
UNDETERMINED = f"the pictures do not determine the camera: {TILT}"


@dataclass(frozen=True)
class Lens:
    """A lens model."""

    name: str  # short name, as in ``--lens``
    terms: tuple[str, ...]  # its distortion coefficients that are fitted
    length: int  # how many coefficients the camera then has
    flags: int = 0  # for OpenCV's calibration
    fisheye: bool = False  # whether it is OpenCV's fisheye model

    @property
    def kept(self) -> list[int]:
        """Places of its terms among the camera's coefficients."""
        order = self.terms if self.fisheye else TERMS
        return [order.index(term) for term in self.terms]


_NO_K3 = cv2.CALIB_FIX_K3
_NO_P = cv2.CALIB_ZERO_TANGENT_DIST | _NO_K3
# From the stiffest to the freest: the order in which models are preferred while they fit equally well.
LADDER = (
    Lens("none", (), 0, _NO_P | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2),
    Lens("k1", TERMS[:1], 4, _NO_P | cv2.CALIB_FIX_K2),
    Lens("k2", TERMS[:2], 4, _NO_P),
    Lens("tangential", TERMS[:4], 4, _NO_K3),
    Lens("k3", TERMS[:5], 5),
    Lens("fisheye", ("k1", "k2", "k3", "k4"), 4, fisheye=True),
    Lens("rational", TERMS, 8, cv2.CALIB_RATIONAL_MODEL),
)
LENSES = {lens.name: lens for lens in LADDER}


@dataclass(frozen=True)
class Fitted:
    """A camera fitted to boards."""

    camera: Camera  # the camera
    lens: Lens  # its lens model
    # (N, 6): for each board the rotation vector (radians) and the position (metres) of its frame in the camera's
    poses: np.ndarray
    errors_px: np.ndarray  # (N,): root mean square reprojection error of each board's corners


def fit(sightings: Sequence[Sighting], size: tuple[int, int], lens: Lens) -> Fitted:
    """Fit a camera of one lens model to pictures of that size (Zhang 2000, as implemented in OpenCV)."""
    if lens.fisheye:
        return _fit_fisheye(sightings, size, lens)
    try:
        board, picture = _points(sightings)
        _, K, distortion, turns, shifts = cv2.calibrateCamera(
            board, picture, size, np.eye(3), np.zeros(5), flags=lens.flags
        )
    except cv2.error as error:
        raise CalibrationError(UNDETERMINED) from error
    return _checked(sightings, size, lens, K, np.ravel(distortion)[: lens.length], _poses(turns, shifts))


def _fit_fisheye(sightings: Sequence[Sighting], size: tuple[int, int], lens: Lens) -> Fitted:
    """The better of two fits: from the best perspective lens, and OpenCV's own from a view of 180 degrees."""
    fits = []
    try:
        seen = min((fit(sightings, size, LENSES[name]) for name in ("k2", "k3")), key=lambda each: each.errors_px.max())
        k1, k2 = (*seen.camera.distortion, 0.0, 0.0)[:2]
        start = (_PINHOLE_AS_FISHEYE[0] + k1, _PINHOLE_AS_FISHEYE[1] + k1 + k2, 0.0, 0.0)
        bent = [replace(seen.camera, distortion=each, fisheye=True) for each in (start, (0.0,) * 4)]
        fits += [adjust_camera(sightings, Fitted(camera, lens, seen.poses, seen.errors_px)) for camera in bent]
    except (CalibrationError, np.linalg.LinAlgError):
        pass
    focal = max(size) / np.pi
    K = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
    board, picture = ([each[None].astype(float) for each in kind] for kind in _points(sightings))
    try:
        _, K, distortion, turns, shifts = cv2.fisheye.calibrate(
            board, picture, size, K, np.zeros(4), flags=_FISHEYE_FLAGS
        )
        fits.append(_checked(sightings, size, lens, K, np.ravel(distortion)[:4], _poses(turns, shifts)))
    except (cv2.error, CalibrationError):
        pass
    if not fits:
        raise CalibrationError(UNDETERMINED)
    return min(fits, key=lambda each: rms_px(each.errors_px[:, None]))


def _points(sightings: Sequence[Sighting]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Corners on the boards and in the pictures, as OpenCV takes them."""
    return [each.board_m.astype(np.float32) for each in sightings], [
        each.picture_px.astype(np.float32) for each in sightings
    ]


def _poses(turns: Sequence[np.ndarray], shifts: Sequence[np.ndarray]) -> np.ndarray:
    return np.array([np.r_[np.ravel(turn), np.ravel(shift)] for turn, shift in zip(turns, shifts, strict=True)])


def _checked(
    sightings: Sequence[Sighting], size: tuple[int, int], lens: Lens, K: np.ndarray, bent: np.ndarray, poses: np.ndarray
) -> Fitted:
    """The fit with these numbers. Raises CalibrationError where they are no camera's."""
    if not np.isfinite(K).all() or not np.isfinite(bent).all() or min(K[0, 0], K[1, 1]) < _SHORTEST * max(size):
        raise CalibrationError(f"the pictures lead to no focal length: {TILT}")
    numbers = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    try:
        camera = Camera(*numbers, *size, distortion=tuple(bent.tolist()), fisheye=lens.fisheye)
    except ValueError as error:  # numbers that no camera has
        raise CalibrationError(UNDETERMINED) from error
    return Fitted(camera, lens, poses, _errors_px(camera, sightings, poses))


def _errors_px(camera: Camera, sightings: Sequence[Sighting], poses: np.ndarray) -> np.ndarray:
    errors = [rms_px(residuals(camera, sighting, pose)) for sighting, pose in zip(sightings, poses, strict=True)]
    return np.nan_to_num(np.array(errors), nan=np.inf)


def intrinsics_of(camera: Camera, lens: Lens) -> Shared:
    """The intrinsics of a camera that its lens model leaves free: fx, fy, cx, cy and coefficients."""
    kept = lens.kept

    def camera_of(each: np.ndarray) -> Camera:
        distortion = np.zeros(lens.length)
        distortion[kept] = each[4:]
        fx, fy, cx, cy = each[:4].tolist()
        return replace(camera, fx=fx, fy=fy, cx=cx, cy=cy, distortion=tuple(distortion.tolist()))

    numbers = np.array([camera.fx, camera.fy, camera.cx, camera.cy, *(camera.distortion[i] for i in kept)])
    steps = np.r_[np.full(4, STEP * camera.fx), np.full(len(kept), STEP)]
    return Shared(("fx", "fy", "cx", "cy", *lens.terms), numbers, steps, camera_of)


def adjust_camera(sightings: Sequence[Sighting], start: Fitted) -> Fitted:
    """Adjust the intrinsics and all poses of a fit until the reprojection error is least."""
    shared = intrinsics_of(start.camera, start.lens)
    numbers, poses = adjust(sightings, start.poses, shared)
    camera = shared.camera_of(numbers)
    return Fitted(camera, start.lens, poses, _errors_px(camera, sightings, poses))


def sigmas_of(fitted: Fitted, sightings: Sequence[Sighting]) -> Sigmas:
    """Standard errors of the intrinsics of a fitted camera, see :func:`sigmas`."""
    return sigmas(sightings, fitted.poses, intrinsics_of(fitted.camera, fitted.lens))


@dataclass(frozen=True)
class Rung:
    """How well a lens model sees pictures that it was not fitted to."""

    lens: Lens  # the model
    held_out_px: float  # root mean square reprojection error of the pictures left out
    # mean logarithm of its squared errors over the best model's, picture by picture, and the standard error of that
    worse: float
    sigma: float

    @property
    def is_as_good(self) -> bool:
        """Whether no other model is better by more than chance: two standard errors."""
        return self.worse <= _BY_CHANCE * self.sigma


def climb(sightings: Sequence[Sighting], size: tuple[int, int]) -> tuple[Lens, tuple[Rung, ...]]:
    """Choose the lens model by cross-validation over pictures of that size (Breiman et al. 1984, section 3.4.3)."""
    poses = poses_of(sightings, size)
    count = int(poses.max()) + 1
    if count < FEWEST:
        return LADDER[1 if count <= _FEW else 2], ()
    errors = {lens.name: _held_out_px2(sightings, poses, size, lens) for lens in LADDER if lens.name not in _SPECIAL}
    best = min(errors, key=lambda name: float(np.log(np.maximum(errors[name], _LEAST_PX2)).mean()))
    if not np.isfinite(errors[best].mean()):
        raise CalibrationError(UNDETERMINED)
    rungs = [_rung(LENSES[name], own, errors[best]) for name, own in errors.items()]
    chosen = next(rung for rung in rungs if rung.is_as_good)
    for name in _SPECIAL:
        own = _held_out_px2(sightings, poses, size, LENSES[name], chosen.held_out_px)
        rung = _rung(LENSES[name], own, errors[chosen.lens.name])
        rungs.append(rung)
        earned = rung.held_out_px < _EARNS * chosen.held_out_px
        if earned and rung.worse + _BY_CHANCE * rung.sigma < 0:
            chosen, errors[name] = rung, own
    return chosen.lens, tuple(rungs)


def _rung(lens: Lens, errors_px2: np.ndarray, best_px2: np.ndarray) -> Rung:
    held_out = float(np.sqrt(errors_px2.mean()))
    if not np.isfinite(held_out):
        return Rung(lens, np.inf, np.inf, 0.0)
    worse = np.log(np.maximum(errors_px2, _LEAST_PX2) / np.maximum(best_px2, _LEAST_PX2))
    # The same pictures are hard for all models, so that only differences count.
    return Rung(lens, held_out, float(worse.mean()), float(worse.std(ddof=1) / np.sqrt(len(worse))))


def _held_out_px2(
    sightings: Sequence[Sighting], poses: np.ndarray, size: tuple[int, int], lens: Lens, to_beat_px: float = np.inf
) -> np.ndarray:
    """Mean squared error of each pose's pictures, left out of the fit; infinite for one that does not beat others."""
    pictures = np.bincount(poses)
    nothing = np.full(len(pictures), np.inf)
    try:
        start = fit(sightings, size, lens)
    except CalibrationError:
        return nothing
    if not rms_px(start.errors_px[:, None]) < _EARNS * to_beat_px:
        return nothing
    errors = np.zeros(len(sightings))
    folds = poses % min(_FOLDS, len(pictures))
    for fold in range(int(folds.max()) + 1):
        kept = [sighting for sighting, number in zip(sightings, folds, strict=True) if number != fold]
        try:
            fitted: Fitted = fit(kept, size, lens)
        except CalibrationError:
            return nothing
        for index in np.flatnonzero(folds == fold).tolist():
            pose = settled_pose(fitted.camera, sightings[index], start.poses[index])
            error = rms_px(residuals(fitted.camera, sightings[index], pose)) ** 2
            errors[index] = error if np.isfinite(error) else np.inf
    return np.bincount(poses, errors) / pictures
