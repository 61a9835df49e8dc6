import math

import pytest
from dockpose import Camera, Dock
from dockpose.camera.port import FlatPort
from dockpose.study import budget as budgets

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
DOCK = Dock(0.30, 10)
DRAWS = 400
# A standard deviation from so many draws is off by 1 / sqrt(2 draws) = 3.5 %; four times that, and a tenth for what
# the linear model leaves out.
CLOSE = 4 / math.sqrt(2 * DRAWS) + 0.1


def test_far_away_the_errors_are_those_of_a_mean_and_of_a_radius():
    # Ten centres with 0.3 px each: their mean is known to 0.3 / sqrt(10) px, and a semi-axis to sqrt(2) times that.
    found = budgets.budget(CAMERA, DOCK, 4.0, 20.0, 0.3)
    assert found.sigma_position_m[0] == pytest.approx(0.3 / math.sqrt(10) * 4 / 700, rel=0.05)
    semi_axis_px = 700 * 0.15 / 4
    assert found.sigma_position_m[2] / 4 == pytest.approx(0.3 * math.sqrt(2 / 10) / semi_axis_px, rel=0.05)


def test_errors_grow_as_the_noise_and_fall_as_the_resolution():
    twice = Camera(1400, 1400, 639.5, 479.5, 1280, 960)
    asked = (CAMERA, 0.1), (CAMERA, 0.2), (twice, 0.2)
    one, noisy, fine = (budgets.budget(camera, DOCK, 2.0, 30.0, px).sigma_position_m for camera, px in asked)
    assert noisy == pytest.approx([2 * each for each in one])
    assert fine == pytest.approx(one)


@pytest.mark.slow
@pytest.mark.parametrize("lights", [4, 6, 10, 24])
@pytest.mark.parametrize(("range_m", "tilt_deg"), [(0.6, 15), (2, 30), (4, 20)])
def test_simulated_lights_have_the_expected_errors(lights, range_m, tilt_deg):
    dock = Dock(0.30, lights)
    expected = budgets.budget(CAMERA, dock, range_m, tilt_deg)
    found = budgets.simulated_budget(CAMERA, dock, range_m, tilt_deg, draws=DRAWS)
    assert found.sigma_position_m == pytest.approx(expected.sigma_position_m, rel=CLOSE)
    assert found.sigma_theta_rad == pytest.approx(expected.sigma_theta_rad, rel=CLOSE)


@pytest.mark.parametrize("range_m", [1, 4, 8])
def test_square_on_the_errors_stay_bounded_as_simulated(range_m):
    # The bound is by an order of magnitude's argument; a third is what an operator can live with.
    expected = budgets.budget(CAMERA, DOCK, range_m, 0.0)
    found = budgets.simulated_budget(CAMERA, DOCK, range_m, 0.0, draws=DRAWS)
    assert expected.tells_apart is None
    assert found.tells_apart is None
    assert found.sigma_theta_rad == pytest.approx(expected.sigma_theta_rad, rel=1 / 3)
    assert found.sigma_position_m == pytest.approx(expected.sigma_position_m, rel=1 / 3)


@pytest.mark.slow
@pytest.mark.parametrize("noise_px", [0.3, 0.5, 0.8])
@pytest.mark.parametrize("tilt_deg", [15, 25])
def test_the_poses_are_told_apart_as_often_as_expected(noise_px, tilt_deg):
    expected = budgets.budget(CAMERA, DOCK, 3.5, tilt_deg, noise_px).tells_apart
    found = budgets.simulated_budget(CAMERA, DOCK, 3.5, tilt_deg, noise_px, draws=DRAWS).tells_apart
    assert expected is not None
    # Three standard errors of a share, and two per cent for the lights' roll, which the expected value has at 0.
    assert found == pytest.approx(expected, abs=3 * math.sqrt(expected * (1 - expected) / DRAWS) + 0.02)


@pytest.mark.slow
def test_behind_a_port_as_simulated():
    camera = Camera(700, 700, 319.5, 239.5, 640, 480, port=FlatPort(air_gap_m=0.02, glass_m=0.01))
    expected = budgets.budget(camera, DOCK, 1.5, 25)
    found = budgets.simulated_budget(camera, DOCK, 1.5, 25, draws=DRAWS)
    assert found.sigma_position_m == pytest.approx(expected.sigma_position_m, rel=CLOSE)
    # Water magnifies by a third, so that range and noise count less.
    assert expected.sigma_position_m[2] < 0.9 * budgets.budget(CAMERA, DOCK, 1.5, 25).sigma_position_m[2]


def test_how_far():
    assert budgets.nearest_m(CAMERA, DOCK) == pytest.approx(700 / 480 * 0.30 / 0.9)
    chord_m = 0.30 * math.sin(math.pi / 10)
    assert budgets.farthest_apart_m(CAMERA, DOCK) == pytest.approx(700 * chord_m / budgets.LEAST_APART_PX)
    good_m = budgets.farthest_within_m(CAMERA, DOCK, 0.002)
    assert budgets.budget(CAMERA, DOCK, good_m, 20.0).sigma_position_m[2] == pytest.approx(0.002 * good_m, rel=0.01)
    told_m = budgets.farthest_told_m(CAMERA, DOCK, 0.95, 20.0)
    assert budgets.budget(CAMERA, DOCK, told_m, 20.0).tells_apart == pytest.approx(0.95, abs=0.002)
    assert budgets.farthest_within_m(CAMERA, DOCK, 1e-6) == 0
    assert budgets.farthest_within_m(CAMERA, DOCK, 0.5) == pytest.approx(budgets.farthest_apart_m(CAMERA, DOCK))


def test_behind_a_port_lights_are_seen_apart_from_farther_away():
    behind = Camera(700, 700, 319.5, 239.5, 640, 480, port=FlatPort(air_gap_m=0.02, glass_m=0.01))
    farthest_m = budgets.farthest_apart_m(behind, DOCK)
    assert farthest_m == pytest.approx(1.333 * budgets.farthest_apart_m(CAMERA, DOCK))
    # The port stands some centimetres before the camera, of the 21 m.
    assert budgets.budget(behind, DOCK, farthest_m, 0.0).apart_px == pytest.approx(budgets.LEAST_APART_PX, rel=0.005)


def test_what_is_in_view_and_apart():
    assert budgets.budget(CAMERA, DOCK, 1.0, 0.0).in_view
    assert not budgets.budget(CAMERA, DOCK, 0.3, 0.0).in_view
    assert budgets.budget(CAMERA, DOCK, 1.0, 0.0).lights_apart
    assert not budgets.budget(CAMERA, DOCK, 20.0, 0.0).lights_apart


@pytest.mark.parametrize(
    ("dock", "range_m", "tilt_deg", "noise_px", "words"),
    [
        (Dock(0.30), 1.0, 10.0, 0.3, "an unknown number of lights"),
        (Dock(0.30, 3), 1.0, 10.0, 0.3, "the dock has 3 lights"),
        (DOCK, 0.0, 10.0, 0.3, "range_m is 0.0"),
        (DOCK, 1.0, 86.0, 0.3, "tilt_deg is 86.0"),
        (DOCK, 1.0, -1.0, 0.3, "tilt_deg is -1.0"),
        (DOCK, 1.0, 10.0, math.nan, "noise_px is nan"),
    ],
)
def test_impossible_questions_are_refused(dock, range_m, tilt_deg, noise_px, words):
    for ask in (budgets.budget, budgets.simulated_budget):
        with pytest.raises(ValueError, match=words):
            ask(CAMERA, dock, range_m, tilt_deg, noise_px)
