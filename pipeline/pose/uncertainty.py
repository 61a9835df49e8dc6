"""Uncertainty of a refined pose: the noise of the centroids, standard errors and where they come from, and odds."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from dockpose.pose.shared import SharedErrors

# For the choice between two candidates: prior precision of centroids, and its weight in measured numbers.
PRIOR_NOISE_PX = 0.02
PRIOR_NUMBERS = 0.5  # as much as half a residual: the choice is left to what was measured
# The noise of centroids is neither quite normal nor quite independent between lights, so the evidence is worth less
# than their number: by about this factor, measured on rendered and drawn docks (tests/bench/bench_choice.py).
WORTH_OF_EVIDENCE = 0.85
# Prior of the noise of centroids: uniform in its logarithm between that of a good lamp and a poor one. Below, it grows
# with the noise to the power _RISE; above, it falls with the power _FALL, since lights that are out of place on the
# dock leave residuals of pixels.
LIKELY_NOISE_PX, _RISE, _FALL = (0.05, 0.95), 0.5, 3.0
_SCALES_PX = np.geomspace(1e-3, 1e3, 240)  # noises over which is averaged: any a centroid can have
_LEAST_SQUARES_PX2 = 1e-8  # so that logarithms stay finite
_LOG_SQUARES = np.linspace(math.log(_LEAST_SQUARES_PX2), math.log(1e7), 100)  # at which the evidence is tabulated
_HOLD = 0.95  # coverage of 1.96 standard errors on either side
PARTS = ("picture", "camera", "diameter", "lights")
# Variance of an angle that may be anywhere in a full turn: (2 pi)^2 / 12.
UNKNOWN_ANGLE_RAD2 = math.pi**2 / 3
UNKNOWN_LENGTH_M2 = 1e6  # a kilometre, squared: farther than any camera sees under water
_MOST, _EYE = np.repeat([UNKNOWN_LENGTH_M2, UNKNOWN_ANGLE_RAD2], 3), np.eye(6)


def noise_px(squares_px2: float, numbers: int, parameters: int) -> float:
    """Standard deviation of a centroid in pixels, such that 1.96 of the standard errors by it cover 95 %."""
    freedom = max(0, numbers - parameters)
    if freedom == 0:
        return _prior_noise_px()
    return _quantile(freedom) * math.sqrt(max(squares_px2, _LEAST_SQUARES_PX2) / freedom)


@lru_cache(maxsize=64)
def _quantile(freedom: int) -> float:
    """The 97.5 % quantile of Student's distribution, over that of the normal one."""
    low, high = 0.0, math.pi / 2
    while (middle := (low + high) / 2) not in (low, high):
        low, high = (middle, high) if _held(middle, freedom) < _HOLD else (low, middle)
    return math.sqrt(freedom) * math.tan(middle) / 1.96


def _held(angle: float, freedom: int) -> float:
    """Share of Student's distribution within sqrt(freedom) tan(angle) (Abramowitz and Stegun 1964, 26.7.3-4)."""
    is_odd = freedom % 2
    term, total = (math.cos(angle) if is_odd else 1.0), 0.0
    for power in range(2 + is_odd, freedom + 1, 2):
        total += term
        term *= math.cos(angle) ** 2 * (power - 1) / power
    return (angle + math.sin(angle) * total) * 2 / math.pi if is_odd else math.sin(angle) * total


def log_evidence(squares_px2: np.ndarray, freedom: int) -> np.ndarray:
    """Log-likelihood of squares (K,) over all noises, but for a constant, of ``freedom`` residuals to spare."""
    return np.interp(np.log(np.maximum(squares_px2, _LEAST_SQUARES_PX2)), _LOG_SQUARES, _evidence(freedom))


def _log_prior() -> np.ndarray:
    """Logarithm of the prior of each of ``_SCALES_PX``, up to a constant."""
    low, high = LIKELY_NOISE_PX
    return np.minimum(0.0, _RISE * np.log(_SCALES_PX / low)) + np.minimum(0.0, _FALL * np.log(high / _SCALES_PX))


@lru_cache(maxsize=1)
def _prior_noise_px() -> float:
    """The noise whose normal interval covers 95 % of errors where the prior is all that is known."""
    weights = np.exp(_log_prior())
    within = 1.96 / math.sqrt(2) * _SCALES_PX[:, None] / _SCALES_PX
    held = np.vectorize(math.erf)(within) @ (weights / weights.sum())
    return math.exp(float(np.interp(_HOLD, held, np.log(_SCALES_PX))))


@lru_cache(maxsize=64)
def _evidence(freedom: int) -> np.ndarray:
    """For each of ``_LOG_SQUARES`` the logarithm of the evidence."""
    squares = np.exp(_LOG_SQUARES)[:, None]
    logs = _log_prior() - freedom * np.log(_SCALES_PX) - squares / (2 * _SCALES_PX**2)
    top = logs.max(axis=1, keepdims=True)
    return top[:, 0] + np.log(np.exp(logs - top).sum(axis=1))


def log_odds(first_px2: float, second_px2: float, numbers: int, least_px: float = 0.0) -> float:
    """Log-odds of the first of two candidates, over all noises (Gelman et al. 2013, section 3.2), tempered.

    Residuals that happen to be smaller than centres are known, ``least_px``, count as these errors.
    """
    spare = max(0, numbers - 6)
    prior = PRIOR_NUMBERS * PRIOR_NOISE_PX**2 + max(0.0, spare * least_px**2 - min(first_px2, second_px2))
    odds = 0.5 * WORTH_OF_EVIDENCE * (PRIOR_NUMBERS + spare) * math.log((prior + second_px2) / (prior + first_px2))
    return min(500.0, max(-500.0, odds))


def nearer(
    probabilities: Sequence[float], gap_rad: tuple[float, float], sigmas_rad: tuple[tuple[float, float], ...]
) -> tuple[float, float]:
    """Probabilities that the truth, normal about each of two candidates, is nearer to each."""
    length = math.hypot(*gap_rad)
    if length == 0:
        half = sum(probabilities) / 2
        return half, half
    x, y = gap_rad[0] / length, gap_rad[1] / length
    beyond = [
        0.5 * math.erfc(length / (math.sqrt(8) * max(math.hypot(x * sigma_x, y * sigma_y), 1e-12)))
        for sigma_x, sigma_y in sigmas_rad
    ]
    moved = probabilities[1] * beyond[1] - probabilities[0] * beyond[0]
    return probabilities[0] + moved, probabilities[1] - moved


def deviations(
    covariance: np.ndarray, rotation: np.ndarray, noise: float
) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """Standard errors of x, y, z in metres, and of theta_x and theta_y in radians, by a covariance (6, 6) in pixels."""
    a, b, c = covariance[3, 3].item(), covariance[3, 4].item(), covariance[4, 4].item()
    (right_x, right_y, back_x), (_, _, back_y), (ahead_x, ahead_y, back_z) = rotation.tolist()
    # Direction, in the dock's own frame, of its x axis before the roll.
    level = max(math.hypot(back_x, back_z), 1e-12)
    x = (right_x * back_z - ahead_x * back_x) / level
    y = (right_y * back_z - ahead_y * back_x) / level
    about_x = max(0.0, a * x * x + 2 * b * x * y + c * y * y)
    about_y = max(0.0, a * y * y - 2 * b * x * y + c * x * x)
    cos_x = math.sqrt(max(1e-12, 1 - back_y * back_y))
    sigma_x, sigma_y, sigma_z = (noise * math.sqrt(max(0.0, covariance[axis, axis].item())) for axis in range(3))
    sigma_theta_x = min(math.pi, noise * math.sqrt(about_x))
    return (sigma_x, sigma_y, sigma_z), (sigma_theta_x, min(math.pi, noise * math.sqrt(about_y) / cos_x))


def cross(vectors: np.ndarray) -> np.ndarray:
    """Matrices (N, 3, 3) that take the cross product of vectors (N, 3) with another."""
    x, y, z = vectors.T
    o = np.zeros_like(x)
    return np.stack([o, -z, y, z, o, -x, -y, x, o], axis=1).reshape(-1, 3, 3)


@dataclass(frozen=True)
class PoseErrors:
    """Covariance of a pose's errors, kept as the fit gives it."""

    # (6, 6): of a step of the position along the camera's axes (metres), and of a rotation about the dock's own axes
    # (radians), for lights known to one pixel
    covariance: np.ndarray
    rotation: np.ndarray  # (3, 3): from the dock's frame to the camera's, with any roll
    noise: float = 1.0  # standard deviation of a light's centroid, in pixels
    # what this picture has in common with all others, or its roots, carried over from another pose
    shared: SharedErrors | dict[str, np.ndarray] | None = None

    @cached_property
    def parts(self) -> dict[str, np.ndarray]:
        """Covariances (6, 6), in m and rad as above, of what comes from this picture and of what all share."""
        shared = {name: root @ root.T for name, root in self.roots.items()}
        return {"picture": self.noise**2 * self.covariance, **shared}

    @cached_property
    def roots(self) -> dict[str, np.ndarray]:
        """Roots (6, K) of the covariances of what all pictures share, a column for each cause."""
        if isinstance(self.shared, SharedErrors):
            return self.shared.roots(self.rotation, self.noise)
        return self.shared or {}

    @cached_property
    def total(self) -> np.ndarray:
        """Sum (6, 6) of all parts."""
        return sum(self.parts.values(), np.zeros((6, 6)))

    @cached_property
    def sigmas(self) -> dict[str | None, tuple[tuple[float, float, float], tuple[float, float]]]:
        """Standard errors of x, y, z in metres and of theta_x, theta_y in radians, of each part; None: in all."""
        each: dict[str | None, np.ndarray] = {None: self.total, **self.parts}
        return {part: deviations(covariance, self.rotation, 1.0) for part, covariance in each.items()}

    def in_camera(self, *, total: bool) -> np.ndarray:
        """See :attr:`CirclePose.covariance` and :attr:`CirclePose.covariance_total`."""
        covariance = (self.total if total else self.parts["picture"]).copy()
        covariance[5], covariance[:, 5] = 0.0, 0.0
        covariance[5, 5] = UNKNOWN_ANGLE_RAD2
        shrunk = np.sqrt(np.minimum(1.0, _MOST / np.maximum(covariance.diagonal(), 1e-300)))
        turned = _EYE * shrunk
        turned[3:, 3:] = self.rotation * shrunk[3:]
        return turned @ covariance @ turned.T

    def carried(self, lever_m: np.ndarray, rotation: np.ndarray) -> "PoseErrors":
        """Errors of what is fixed to the dock at a lever (3,) from its centre, in metres along the camera's axes."""
        by = np.zeros((6, 6))
        by[:3, :3] = np.eye(3)
        by[:3, 3:] = -cross(lever_m[None])[0] @ self.rotation  # w x lever, of a rotation w about the dock's own axes
        by[3:, 3:] = rotation.T @ self.rotation
        shared = {name: by @ root for name, root in self.roots.items()}
        return PoseErrors(by @ self.covariance @ by.T, rotation, self.noise, shared)
