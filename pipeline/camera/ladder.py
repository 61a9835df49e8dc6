"""Which lens model the pictures can tell: the stiffest one that sees pictures it was not fitted to as well as any."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from dockpose.camera.board import Sighting
from dockpose.camera.bundle import residuals, rms_px, settled_pose
from dockpose.camera.coverage import poses_of
from dockpose.camera.fitting import LADDER, LENSES, UNDETERMINED, CalibrationError, Fitted, Lens, fit

_FOLDS = 6
_SPECIAL = ("fisheye", "rational")  # models that must be clearly better, by this factor, than the others
_EARNS = 0.95
_BY_CHANCE = 2.0
_LEAST_PX2 = 1e-8
FEWEST = 6  # poses of the board; fewer are too few to leave any out
_FEW = 3  # poses, which hardly tell one coefficient


@dataclass(frozen=True)
class Rung:
    """How well a lens model sees pictures that it was not fitted to."""

    lens: Lens  # the model
    held_out_px: float  # root mean square reprojection error of the pictures left out
    # mean logarithm of its squared errors over the best model's, picture by picture, and the standard error of that
    worse: float
    # mean logarithm of its squared errors over the best model's, picture by picture, and the standard error of that
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
