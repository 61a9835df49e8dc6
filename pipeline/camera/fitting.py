"""Cameras fitted to the corners of boards, by lens models of growing freedom; and the flat port before one."""

import contextlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from dockpose.camera.board import Sighting
from dockpose.camera.bundle import PORT_STEP_M, Sigmas, adjust, errors_px, residuals, rms_px, settled_pose, sigmas
from dockpose.camera.camera import Camera
from dockpose.camera.coverage import poses_of
from dockpose.camera.port import FlatPort
from dockpose.camera.sigma import numbers_of, with_numbers, with_port_errors
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
WORST_SHARE = 0.003  # of the picture's longer side (2 px of 640); a fit with a larger error is rejected
LIKELY_PORT = FlatPort(air_gap_m=0.020, glass_m=0.010)
_LENGTHS = ("air_gap_m", "glass_m")  # that are fitted
_TOLD_M = 0.002  # standard error of the glass, above which its thickness is not known
_UNTOLD_M = 0.010  # of the air gap, above which the pictures tell nothing


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
    def names(self) -> list[str]:
        """The numbers that it leaves free, as dockpose.camera.sigma names them; its terms are a camera's first."""
        return ["fx", "fy", "cx", "cy", *(f"distortion[{index}]" for index in range(len(self.terms)))]


_NO_K3 = cv2.CALIB_FIX_K3
_NO_P = cv2.CALIB_ZERO_TANGENT_DIST | _NO_K3
# From the stiffest to the freest: the order in which models are preferred while they fit equally well.
LADDER = (
    Lens("none", (), 0, _NO_P | cv2.CALIB_FIX_K1 | cv2.CALIB_FIX_K2),
    Lens("k1", TERMS[:1], 4, _NO_P | cv2.CALIB_FIX_K2),
    Lens("k2", TERMS[:2], 4, _NO_P),
    Lens("tangential", TERMS[:4], 4, _NO_K3),
    Lens("k3", TERMS[:5], 5),
    Lens("fisheye", ("k1", "k2", "k3", "k4"), 4, _FISHEYE_FLAGS, fisheye=True),
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
    """Fit a camera of one lens model to pictures of that size; of a fisheye lens the best of three fits."""
    if not lens.fisheye:
        return _by_opencv(sightings, size, lens)
    fits = []
    with contextlib.suppress(CalibrationError, np.linalg.LinAlgError):  # from the best perspective lens
        seen = min((fit(sightings, size, LENSES[name]) for name in ("k2", "k3")), key=lambda each: each.errors_px.max())
        k1, k2 = (*seen.camera.distortion, 0.0, 0.0)[:2]
        start = (_PINHOLE_AS_FISHEYE[0] + k1, _PINHOLE_AS_FISHEYE[1] + k1 + k2, 0.0, 0.0)
        bent = [replace(seen.camera, distortion=each, fisheye=True) for each in (start, (0.0,) * 4)]
        fits += [adjust_camera(sightings, Fitted(camera, lens, seen.poses, seen.errors_px)) for camera in bent]
    with contextlib.suppress(CalibrationError):
        fits.append(_by_opencv(sightings, size, lens))
    if not fits:
        raise CalibrationError(UNDETERMINED)
    return min(fits, key=lambda each: rms_px(each.errors_px[:, None]))


def _by_opencv(sightings: Sequence[Sighting], size: tuple[int, int], lens: Lens) -> Fitted:
    """OpenCV's fit (Zhang 2000), of a fisheye lens from a view of 180 degrees; CalibrationError where it fails."""
    calibrate: Any = cv2.fisheye.calibrate if lens.fisheye else cv2.calibrateCamera
    kind, focal = np.float64 if lens.fisheye else np.float32, max(size) / np.pi
    start = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal, (size[1] - 1) / 2], [0, 0, 1]])
    boards, pictures = zip(*((each.board_m, each.picture_px) for each in sightings), strict=True)
    corners = ([each[None].astype(kind) for each in seen] for seen in (boards, pictures))
    try:
        _, K, bent, *poses = calibrate(*corners, size, start, np.zeros(4 if lens.fisheye else 5), flags=lens.flags)
    except cv2.error as error:
        raise CalibrationError(UNDETERMINED) from error
    bent = np.ravel(bent)[: lens.length]
    if not np.isfinite(K).all() or not np.isfinite(bent).all() or min(K[0, 0], K[1, 1]) < _SHORTEST * max(size):
        raise CalibrationError(f"the pictures lead to no focal length: {TILT}")
    numbers = (float(K[0, 0]), float(K[1, 1]), float(K[0, 2]), float(K[1, 2]))
    try:
        camera = Camera(*numbers, *size, distortion=tuple(bent.tolist()), fisheye=lens.fisheye)
    except ValueError as error:  # numbers that no camera has
        raise CalibrationError(UNDETERMINED) from error
    turns_and_shifts = np.hstack([np.reshape(each, (-1, 3)) for each in poses])
    return Fitted(camera, lens, turns_and_shifts, errors_px(camera, sightings, turns_and_shifts))


def adjust_camera(sightings: Sequence[Sighting], start: Fitted) -> Fitted:
    """Adjust the intrinsics and all poses of a fit until the reprojection error is least."""
    numbers, poses = adjust(sightings, start.poses, start.camera, start.lens.names)
    camera = with_numbers(start.camera, start.lens.names, numbers)
    return Fitted(camera, start.lens, poses, errors_px(camera, sightings, poses))


def sigmas_of(fitted: Fitted, sightings: Sequence[Sighting]) -> Sigmas:
    """Standard errors of the intrinsics of a fitted camera, those of coefficients by their terms' names."""
    camera, names = fitted.camera, fitted.lens.names
    found = sigmas(sightings, fitted.poses, camera, names, numbers_of(camera, names))
    values = dict(zip((*names[:4], *fitted.lens.terms), found.values.values(), strict=True))
    return Sigmas(values, found.covariance, found.noise_px)


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


@dataclass(frozen=True)
class FittedPort:
    """A port that was fitted."""

    camera: Camera  # the camera with its port
    sigmas: Sigmas  # standard errors in metres: of the air gap and, where it was fitted, the glass
    glass_sigma_m: float  # standard error of the glass's thickness when it is fitted too
    gap_per_glass: float  # by how much the air gap grows with the thickness that is assumed for the glass
    errors_px: np.ndarray  # (N,): root mean square reprojection error of each board
    without_px: float  # error over all boards with no port, of a camera seen as a pinhole in the water
    distances_m: tuple[float, float]  # the least and the largest distance of a board


def fit_port(sightings: Sequence[Sighting], camera: Camera) -> FittedPort:
    """Fit the air gap, and where the pictures tell it the glass, of a flat port (Treibitz et al. 2012)."""
    if len(sightings) < 3:
        raise CalibrationError(f"{len(sightings)} boards do not determine a port; 3 are needed, better 12")
    known = camera.port or LIKELY_PORT
    bare = replace(camera, port=replace(known, air_gap_m=0.0, glass_m=0.0))
    start = replace(camera, port=known)
    poses = np.array([_pose(each, start, known.water_index) for each in sightings])
    glass_sigma, slope = _glass(sightings, poses, start)
    names = _LENGTHS if glass_sigma < _TOLD_M else _LENGTHS[:1]
    numbers, poses = adjust(sightings, poses, start, names)
    found = sigmas(sightings, poses, start, names, numbers)
    if not found.values["air_gap_m"] < _UNTOLD_M:
        raise CalibrationError(
            f"the pictures cannot determine the port's air gap (to {1000 * found.values['air_gap_m']:.0f} mm at best); "
            "take more, with the board near the window and reaching into the picture's corners"
        )
    with_port = with_numbers(start, names, numbers)
    errors = errors_px(with_port, sightings, poses)
    if not np.sqrt((errors**2).mean()) < WORST_SHARE * max(camera.width, camera.height):
        text = f"no flat port explains the boards (error {np.sqrt((errors**2).mean()):.1f} px); is the window at right "
        raise CalibrationError(f"{text}angles to the camera, and was the camera calibrated in air?")
    pinhole = np.array([settled_pose(bare, each, pose) for each, pose in zip(sightings, poses, strict=True)])
    without = float(np.sqrt((errors_px(bare, sightings, pinhole) ** 2).mean()))
    away = np.linalg.norm(poses[:, 3:], axis=1)
    with_port = with_port_errors(with_port, names, found.covariance)
    return FittedPort(with_port, found, glass_sigma, slope, errors, without, (float(away.min()), float(away.max())))


def _glass(sightings: Sequence[Sighting], poses: np.ndarray, camera: Camera) -> tuple[float, float]:
    """Standard error of the glass, fitted with the gap; and how the gap grows with it, from two fits of the gap."""
    numbers, settled = adjust(sightings, poses, camera, _LENGTHS)
    sigma = sigmas(sightings, settled, camera, _LENGTHS, np.maximum(numbers, 2 * PORT_STEP_M)).values["glass_m"]
    gaps = []
    for glass_m in (0.005, 0.015):
        alone = with_numbers(camera, _LENGTHS[1:], np.array([glass_m]))
        gaps.append(float(adjust(sightings, poses, alone, _LENGTHS[:1])[0][0]))
    return sigma, (gaps[1] - gaps[0]) / 0.010


def _pose(sighting: Sighting, camera: Camera, water_index: float) -> np.ndarray:
    """Pose (6,) of a board behind a port: first as by a longer lens, for water magnifies, then behind a likely port."""
    K = camera.matrix @ np.diag([water_index, water_index, 1.0])
    pixels = replace(camera, port=None).undistort(sighting.picture_px.astype(float))
    _, turn, shift = cv2.solvePnP(sighting.board_m.astype(float), pixels, K, None, flags=cv2.SOLVEPNP_ITERATIVE)
    return settled_pose(camera, sighting, np.r_[turn.ravel(), shift.ravel()])
