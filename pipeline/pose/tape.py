"""Measured places beside estimated ones: how the tank lies to the camera, a common scale, and what is left over."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import cv2
import numpy as np

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

FEWEST = 3  # rows with a measured number
TAPE_M = 0.002  # how well a tape tells a length
# Standard deviations of what is looked for, before a row is seen: of the scale, the turn about each axis (radians), the
# shift along each and the tape's zero (metres), and of the growth to the edge.
_PRIORS = np.array([0.1, *[0.1] * 3, *[1.0] * 3, 1.0, 1.0])
_SLIPPED = 5.0  # standard deviations: a row so far off was mistyped, or shows another place
_SURE = 3.0


@dataclass(frozen=True)
class Place:
    """A dock as estimated, in the camera's frame, and as measured, in the tank's; nan: not measured."""

    estimated_m: np.ndarray  # (3,)
    sigma_m: np.ndarray  # (3,): standard errors of this picture alone
    measured_m: np.ndarray  # (3,)
    distance_m: float = np.nan


@dataclass(frozen=True)
class TapeFit:
    """What turns estimated places into measured ones, with standard errors, and what it leaves."""

    scale: float  # measured over estimated lengths
    scale_sigma: float
    turn_rad: np.ndarray  # (3,): rotation vector of the tank's axes against the camera's
    turn_sigma_rad: np.ndarray  # (3,)
    shift_m: np.ndarray  # (3,): the camera in the tank's frame
    shift_sigma_m: np.ndarray  # (3,)
    zero_m: float  # of the tape for distances: where it begins, before the camera's centre
    zero_sigma_m: float
    edge: float  # share by which places across grow at 45 degrees off the axis, as the square of the tangent
    edge_sigma: float
    residuals_m: np.ndarray  # (N, 4): of x, y, z and the distance; nan where not measured
    sigmas_m: np.ndarray  # (N, 4): standard errors of these
    slipped: tuple[int, ...]  # rows that were left out

    @staticmethod
    def is_sure(value: float, sigma: float) -> bool:
        """Whether a value is more than chance."""
        return abs(value) > _SURE * sigma


def fit_tape(places: Sequence[Place], tape_m: float = TAPE_M) -> TapeFit:
    """Fit rotation, shift, scale and growth to the edge between estimated places and those that a tape measured.

    Least squares with weak priors, so that what the rows leave open stays as it is, with a large standard error. Rows
    off by more than five standard deviations are left out, one after another. ValueError where fewer than three have
    something measured; ``tape_m`` is the tape's standard deviation in metres.
    """
    measured = np.array([[*one.measured_m, one.distance_m] for one in places]).reshape(-1, 4)
    has_tape = np.isfinite(measured).any(axis=1)
    if has_tape.sum() < FEWEST:
        raise ValueError(f"{FEWEST} rows with a pose and measured values are needed, and there are {has_tape.sum()}")
    estimated, own = np.array([(one.estimated_m, one.sigma_m) for one in places]).transpose(1, 0, 2)
    along = (own * np.abs(estimated)).sum(axis=1) / np.linalg.norm(estimated, axis=1)
    sigmas = np.hypot(np.column_stack([own, along]), tape_m)
    slipped: list[int] = []
    while True:
        kept = measured.copy()
        kept[slipped] = np.nan
        fit = _least_squares(estimated, kept, sigmas)
        left = _measurable(fit.x, estimated) - measured
        beyond = np.nan_to_num(np.abs(left) / sigmas).max(axis=1)
        beyond[slipped] = 0
        typical = max(1.0, 1.4826 * float(np.nanmedian(np.abs(left / sigmas))))  # a few large ones hardly move it
        if beyond.max() <= _SLIPPED * typical or has_tape.sum() - len(slipped) <= FEWEST:
            break
        slipped.append(int(beyond.argmax()))
    errors = _errors(fit, int(np.isfinite(kept).sum()))
    return TapeFit(
        scale=1 + fit.x[0],
        scale_sigma=errors[0],
        turn_rad=fit.x[1:4],
        turn_sigma_rad=errors[1:4],
        shift_m=fit.x[4:7],
        shift_sigma_m=errors[4:7],
        zero_m=fit.x[7],
        zero_sigma_m=errors[7],
        edge=fit.x[8],
        edge_sigma=errors[8],
        residuals_m=left,
        sigmas_m=sigmas,
        slipped=tuple(sorted(slipped)),
    )


def _least_squares(estimated: np.ndarray, measured: np.ndarray, sigmas: np.ndarray) -> "OptimizeResult":
    """Scale less 1, turn, shift, zero and edge (9,) with which places (N, 3) are as measured (N, 4); nan: not."""
    from scipy.optimize import least_squares  # takes half a second to import

    known = np.isfinite(measured)

    def off(numbers: np.ndarray) -> np.ndarray:
        return np.r_[((_measurable(numbers, estimated) - measured) / sigmas)[known], numbers / _PRIORS]

    return least_squares(off, np.zeros(9), method="lm", x_scale=_PRIORS)


def _errors(fit: "OptimizeResult", count: int) -> np.ndarray:
    """Standard errors (9,), larger where what is left is larger than the standard errors of what was measured."""
    squares = float((fit.fun[:count] ** 2).sum())
    spread = max(1.0, math.sqrt(squares / max(1, count - 9)))
    return spread * np.sqrt(np.diag(np.linalg.inv(fit.jac.T @ fit.jac)))


def _measurable(numbers: np.ndarray, estimated_m: np.ndarray) -> np.ndarray:
    """What a tape should say (N, 4) of places (N, 3) in the camera's frame: x, y, z and the distance."""
    scale, turn, shift, zero, edge = 1 + numbers[0], numbers[1:4], numbers[4:7], numbers[7], numbers[8]
    straight = estimated_m.copy()
    tangents2 = (estimated_m[:, :2] ** 2).sum(axis=1) / estimated_m[:, 2] ** 2
    straight[:, :2] *= (1 + edge * tangents2)[:, None]
    in_tank = scale * straight @ cv2.Rodrigues(turn)[0].T + shift
    return np.column_stack([in_tank, scale * np.linalg.norm(straight, axis=1) + zero])
