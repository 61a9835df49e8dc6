import math

import numpy as np
import pytest
from dockpose.pose.uncertainty import _prior_noise_px, _quantile
from scipy.special import erf, stdtrit


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 5, 10, 15, 122, 123, 1000])
def test_the_quantile_of_students_distribution_is_scipys(freedom):
    assert _quantile(freedom) * 1.96 == pytest.approx(stdtrit(freedom, 0.975), rel=1e-12)


def test_the_quantile_of_one_and_two_degrees_by_hand():
    assert _quantile(1) * 1.96 == pytest.approx(math.tan(0.475 * math.pi))
    assert _quantile(2) * 1.96 == pytest.approx(0.95 * math.sqrt(2 / (1 - 0.95**2)))


def test_the_noise_by_the_prior_alone_covers_as_it_should():
    noises = np.geomspace(1e-3, 1e3, 240)
    rising, falling = np.minimum(0, 0.5 * np.log(noises / 0.05)), np.minimum(0, 3 * np.log(0.95 / noises))
    weights = np.exp(rising + falling)
    held = (erf(1.96 * _prior_noise_px() / noises / math.sqrt(2)) * weights).sum() / weights.sum()
    assert held == pytest.approx(0.95, abs=1e-3)
