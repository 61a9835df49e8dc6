import numpy as np
import pytest
from dockpose.simulate.optics import hankel
from dockpose.simulate.optics.hankel import ANGLES, FREQUENCIES, mean_bessel, spread_of, transfer_of
from numpy.polynomial.legendre import leggauss
from scipy.fft import fhtoffset
from scipy.special import j0

NODES, WEIGHTS = leggauss(20)


def mean_by_quadrature(x):
    """Gauss and Legendre's rule with twenty nodes on each stretch of at most 1, over which J0 is almost a parabola."""
    edges = np.linspace(0, x, int(np.ceil(x)) + 1)
    half, middle = np.diff(edges)[:, None] / 2, (edges[1:] + edges[:-1])[:, None] / 2
    return float(np.sum(half * WEIGHTS * j0(middle + half * NODES))) / x


@pytest.mark.parametrize("x", [1e-9, 0.01, 1.0, 2.4048, 19.9, 20.1, 31.999, 32.0, 32.001, 50.0, 100.0, 1234.5, 1e5])
def test_mean_of_the_bessel_function(x):
    assert mean_bessel(np.array([x]))[0] == pytest.approx(mean_by_quadrature(x), rel=1e-10)


def test_far_out_the_mean_is_that_of_the_whole_integral_which_is_1():
    x = np.geomspace(1e6, 1e9, 50)
    assert mean_bessel(x) * x == pytest.approx(1, abs=1e-3)


def test_a_gaussian_comes_back_as_a_gaussian():
    sigma = 0.01
    transfer = np.exp(-2 * (np.pi * sigma * FREQUENCIES) ** 2)
    spread = np.exp(-0.5 * (ANGLES / sigma) ** 2) / (2 * np.pi * sigma**2)
    seen = ANGLES > 1e-5
    assert spread_of(transfer)[seen] == pytest.approx(spread[seen], abs=1e-6 * spread.max())
    fast = FREQUENCIES > 0.1  # at slower ones the transform, which goes on periodically, loses a little
    assert transfer_of(spread)[fast] == pytest.approx(transfer[fast], abs=1e-9)


def test_the_offset_is_scipys():
    assert pytest.approx(fhtoffset(hankel._STEP, mu=0.0, bias=hankel._SLOW_BIAS), abs=1e-15) == hankel._OFFSET
