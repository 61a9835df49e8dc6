"""The zeroth-order Hankel transform of a modulation transfer function, on logarithmic grids (Hamilton 2000, FFTLog)."""

import math
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from scipy.interpolate import PPoly

_COUNT = 1536
_STEP = math.log(1e12) / _COUNT
# Water's own transfer function starts flat and falls like 1/x or more slowly. With this bias the transformed function
# is equally low at both ends, so that its periodic continuation does not ring. Functions that vanish need none.
_SLOW_BIAS = 0.7
# By SciPy's fhtoffset(_STEP, mu=0.0, bias=_SLOW_BIAS); SciPy takes a third of a second to import.
_OFFSET = 0.007278601109682185
_CENTRE_FREQUENCY = 30.0  # cycles/rad, about where water's modulation transfer functions fall

_SERIES_FROM, _SERIES_TERMS = 32.0, 12

_INDEX = np.arange(_COUNT) - (_COUNT - 1) / 2
FREQUENCIES = _CENTRE_FREQUENCY * np.exp(_STEP * _INDEX)
ANGLES = math.exp(_OFFSET) / (2 * math.pi * _CENTRE_FREQUENCY) * np.exp(_STEP * _INDEX)


def spread_of(transfer: np.ndarray) -> np.ndarray:
    """Point spread function (1/sr) on ``ANGLES`` of a modulation transfer function on ``FREQUENCIES``."""
    vanishes = abs(transfer[-1]) <= 1e-12 * abs(transfer[0])
    return _transform(transfer, FREQUENCIES, ANGLES, 0.0 if vanishes else _SLOW_BIAS)


def transfer_of(spread: np.ndarray) -> np.ndarray:
    """Modulation transfer function on ``FREQUENCIES`` of a point spread function (1/sr) on ``ANGLES``."""
    return _transform(spread, ANGLES, FREQUENCIES, 0.0)


def mean_bessel(x: np.ndarray) -> np.ndarray:
    """Mean of J0 from 0 up to each ``x`` above 0, exact to 1e-12; itj0y0 is wrong above 20 before SciPy 1.17."""
    from scipy.special import j0, j1

    result = np.empty_like(x, dtype=float)
    near = x < _SERIES_FROM
    result[near] = _integral_near()(x[near])
    far = x[~near]
    in_j1, in_j0 = np.zeros_like(far), np.zeros_like(far)
    for k in reversed(range(_SERIES_TERMS)):  # by Horner: 1 - 1/x^2 + 9/x^4 - ..., and 1/x - 3/x^3 + 45/x^5 - ...
        odd = math.prod(range(1, 2 * k, 2))
        in_j1 = (-1) ** k * odd**2 + in_j1 / far**2
        in_j0 = (-1) ** k * odd**2 * (2 * k + 1) + in_j0 / far**2
    result[~near] = 1 + j1(far) * in_j1 - j0(far) * in_j0 / far
    return result / x


@cache
def _integral_near() -> "PPoly":
    from scipy.interpolate import CubicSpline
    from scipy.special import j0

    knots = np.linspace(0, _SERIES_FROM, 8193)
    return CubicSpline(knots, j0(knots)).antiderivative()


def _transform(values: np.ndarray, x: np.ndarray, y: np.ndarray, bias: float) -> np.ndarray:
    from scipy.fft import fht

    # fht integrates over k = 2 pi y with an extra factor k; both cancel, except for a factor y.
    return fht(values * x, _STEP, mu=0.0, offset=_OFFSET, bias=bias) / y
