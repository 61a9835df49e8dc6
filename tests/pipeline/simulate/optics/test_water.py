import math

import numpy as np
import pytest
from dockpose.simulate.optics import water as waters

# Derived from Petzold's table by others than this code: mean cosine and Wells' theta0 = median / sqrt(3).
MEAN_COSINE = {"clear": 0.8714, "coastal": 0.9468, "harbour": 0.9197}
WELLS_ANGLE_RAD = {"clear": 0.06277, "coastal": 0.02565, "harbour": 0.04716}


@pytest.mark.parametrize("name", waters.PHASE_FUNCTIONS)
def test_a_phase_function_integrates_to_one(name):
    angles, values = waters.phase_function(name)
    assert 2 * math.pi * np.trapezoid(values * np.sin(angles), angles) == pytest.approx(1, abs=2e-3)


@pytest.mark.parametrize("name", MEAN_COSINE)
def test_petzolds_waters_have_their_published_moments(name):
    angles, values = waters.phase_function(name)
    cosine = 2 * math.pi * np.trapezoid(values * np.sin(angles) * np.cos(angles), angles)
    assert cosine == pytest.approx(MEAN_COSINE[name], abs=2e-3)
    assert waters.scattering_angle_rad(name) == pytest.approx(WELLS_ANGLE_RAD[name], rel=0.01)


def test_the_measured_points_are_met():
    angles, values = waters.phase_function("harbour")
    for degrees, per_sr in ((0.1, 1788), (1, 72.86), (10, 1.157)):
        assert np.interp(math.radians(degrees), angles, values) == pytest.approx(per_sr, rel=0.02)


def test_attenuation_and_albedo_by_hand():
    water = waters.Water(0.1, 0.3)
    assert water.attenuation_per_m == pytest.approx(0.4)
    assert water.albedo == pytest.approx(0.75)
    assert waters.Water(0.0, 0.0).albedo == 0


def test_turbidity_runs_through_the_presets():
    for index, water in enumerate(waters.PRESETS.values()):
        found = waters.water_of_turbidity(index / 3)
        assert found.absorption_per_m == pytest.approx(water.absorption_per_m)
        assert found.scattering_per_m == pytest.approx(water.scattering_per_m)
        assert found.phase_function == water.phase_function
    attenuations = [waters.water_of_turbidity(t).attenuation_per_m for t in np.linspace(0, 1, 21)]
    assert (np.diff(attenuations) > 0).all()


def test_red_dies_first():
    water = waters.preset("coastal")
    red, green, blue = (water.in_band(band).absorption_per_m for band in ("red", "green", "blue"))
    assert red > 0.3 > green > blue
