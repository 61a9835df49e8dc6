"""Uncertainty of a refined pose: the noise of the centroids, standard errors, and the odds of two candidates."""

import math
from collections.abc import Sequence
from functools import lru_cache

import numpy as np
from dockpose.compiled import compiled

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


def log_odds(first_px2: float, second_px2: float, numbers: int) -> float:
    """Log-odds of the first of two candidates, over all noises (Gelman et al. 2013, section 3.2), tempered."""
    prior = PRIOR_NUMBERS * PRIOR_NOISE_PX**2
    freedom = PRIOR_NUMBERS + max(0, numbers - 6)
    return min(
        500.0, max(-500.0, 0.5 * WORTH_OF_EVIDENCE * freedom * math.log((prior + second_px2) / (prior + first_px2)))
    )


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


@compiled
def deviations(
    covariance: np.ndarray, rotation: np.ndarray, noise: float
) -> tuple[tuple[float, float, float], tuple[float, float]]:
    """Standard errors of x, y, z in metres, and of theta_x and theta_y in radians, by a covariance (6, 6) in pixels."""
    a, b, c = covariance[3, 3], covariance[3, 4], covariance[4, 4]
    back_x, back_y, back_z = rotation[0, 2], rotation[1, 2], rotation[2, 2]
    # Direction, in the dock's own frame, of its x axis before the roll.
    level = max(math.hypot(back_x, back_z), 1e-12)
    x = (rotation[0, 0] * back_z - rotation[2, 0] * back_x) / level
    y = (rotation[0, 1] * back_z - rotation[2, 1] * back_x) / level
    about_x = max(0.0, a * x * x + 2 * b * x * y + c * y * y)
    about_y = max(0.0, a * y * y - 2 * b * x * y + c * x * x)
    cos_x = math.sqrt(max(1e-12, 1 - back_y * back_y))
    sigma_x = noise * math.sqrt(max(0.0, covariance[0, 0]))
    sigma_y = noise * math.sqrt(max(0.0, covariance[1, 1]))
    sigma_z = noise * math.sqrt(max(0.0, covariance[2, 2]))
    sigma_theta_x = min(math.pi, noise * math.sqrt(about_x))
    return (sigma_x, sigma_y, sigma_z), (sigma_theta_x, min(math.pi, noise * math.sqrt(about_y) / cos_x))
