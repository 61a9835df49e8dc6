"""The zeroth-order Hankel transform between a modulation transfer function and its point spread function.

A radially symmetric picture and its spectrum are each other's transform: F(y) = 2 pi int f(x) J0(2 pi x y) x dx, with
x an angle in radians and y a frequency in cycles per radian. The grids are logarithmic, since both span many decades
(Hamilton 2000, FFTLog, by way of scipy.fft.fht).
"""

from __future__ import annotations

import math

import numpy as np
from scipy.fft import fht, fhtoffset

_COUNT = 1536
_STEP = math.log(1e12) / _COUNT
# Water's own transfer function starts flat and falls like 1/x or more slowly: with this bias what is transformed ends
# equally low on both sides, so that its periodic continuation does not ring. Functions that vanish need none.
_SLOW_BIAS = 0.7
_OFFSET = fhtoffset(_STEP, mu=0.0, bias=_SLOW_BIAS)
_CENTRE_FREQUENCY = 30.0  # cycles/rad, about where water's modulation transfer functions fall

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


def _transform(values: np.ndarray, x: np.ndarray, y: np.ndarray, bias: float) -> np.ndarray:
    # fht integrates with k = 2 pi y and an extra factor k; both cancel but for y.
    return fht(values * x, _STEP, mu=0.0, offset=_OFFSET, bias=bias) / y
