import math

import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.camera.port import FlatPort
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import find_poses
from dockpose.study import budget as budgets
from dockpose.study.judge import judge_choice

CAMERA = Camera(700, 700, 319.5, 239.5, 640, 480)
BEHIND = Camera(700, 700, 319.5, 239.5, 640, 480, port=FlatPort(air_gap_m=0.02, glass_m=0.01))
DOCK = Dock(0.30, 10)
DRAWS = 400
# A standard deviation from so many draws is off by 1 / sqrt(2 draws) = 3.5 %; four times that, and a tenth for what
# the linear model leaves out.
CLOSE = 4 / math.sqrt(2 * DRAWS) + 0.1


def simulated(camera, dock, range_m, tilt_deg, noise_px=budgets.USUAL_NOISE_PX):
    """Errors as they come out, of lights whose centres have noise, and how often the right pose is chosen."""
    rng, errors, right = np.random.default_rng([round(1e6 * range_m), round(1e6 * tilt_deg)]), [], []
    position = np.array([0.0, 0.0, range_m])
    for _ in range(DRAWS):
        rotation = rotation_from_angles(0.0, math.radians(tilt_deg), rng.uniform(0, 2 * math.pi))
        lights_px = camera.project(position + dock.light_points() @ rotation.T)
        noisy = lights_px + rng.normal(0, noise_px, lights_px.shape)
        error, is_right = judge_choice(find_poses(noisy, camera, dock)[1], position, -rotation[:, 2])
        errors.append(error)
        right.append(is_right)
    return np.sqrt(np.mean(np.square(errors), axis=0)), np.mean(right)


def test_far_away_the_errors_are_those_of_a_mean_and_of_a_radius():
    # Ten centres with 0.3 px each: their mean is known to 0.3 / sqrt(10) px, and a semi-axis to sqrt(2) times that.
    x, _, z, *_ = budgets.budget(CAMERA, DOCK, 4.0, 20.0, 0.3).sigmas
    semi_axis_px = 700 * 0.15 / 4
    assert x == pytest.approx(0.3 / math.sqrt(10) * 4 / 700, rel=0.05)
    assert z / 4 == pytest.approx(0.3 * math.sqrt(2 / 10) / semi_axis_px, rel=0.05)


def test_errors_grow_as_the_noise_and_fall_as_the_resolution():
    twice = Camera(1400, 1400, 639.5, 479.5, 1280, 960)
    asked = (CAMERA, 0.1), (CAMERA, 0.2), (twice, 0.2)
    one, noisy, fine = (budgets.budget(camera, DOCK, 2.0, 30.0, px).sigmas for camera, px in asked)
    assert noisy == pytest.approx(2 * one)
    assert fine == pytest.approx(one)


def test_what_the_files_let_be_off_is_in_the_total():
    # A diameter known to 1 % makes 1 % of the range, beside what the noise does.
    known, rough = (budgets.budget(CAMERA, Dock(0.30, 10, diameter_sigma_m=m), 2.0, 20.0) for m in (1e-9, 0.003))
    assert rough.sigmas == pytest.approx(known.sigmas)
    assert math.hypot(known.totals[2], 0.02) == pytest.approx(rough.totals[2], rel=0.02)


@pytest.mark.parametrize(("camera", "lights", "range_m", "tilt_deg", "close"), [
    (CAMERA, 6, 2, 30, CLOSE),
    # Square on the bound is by an order of magnitude's argument; a third is what an operator can live with.
    *((CAMERA, 10, range_m, 0, 1 / 3) for range_m in (1, 4, 8)),
    *(
        pytest.param(*case, CLOSE, marks=pytest.mark.slow)
        for case in ((CAMERA, 4, 0.6, 15), (CAMERA, 10, 4, 20), (CAMERA, 24, 2, 30), (BEHIND, 10, 1.5, 25))
    ),
])  # fmt: skip
def test_simulated_lights_have_the_expected_errors(camera, lights, range_m, tilt_deg, close):
    dock = Dock(0.30, lights)
    expected = budgets.budget(camera, dock, range_m, tilt_deg)
    assert simulated(camera, dock, range_m, tilt_deg)[0] == pytest.approx(expected.sigmas, rel=close)
    assert (expected.tells_apart is None) == (tilt_deg == 0)


@pytest.mark.parametrize(("noise_px", "tilt_deg"), [(0.3, 15), pytest.param(0.8, 25, marks=pytest.mark.slow)])
def test_the_poses_are_told_apart_as_often_as_expected(noise_px, tilt_deg):
    expected = budgets.budget(CAMERA, DOCK, 3.5, tilt_deg, noise_px).tells_apart
    _, found = simulated(CAMERA, DOCK, 3.5, tilt_deg, noise_px)
    assert expected is not None
    # Three standard errors of a share, and two per cent for the lights' roll, which the expected value has at 0.
    assert found == pytest.approx(expected, abs=3 * math.sqrt(expected * (1 - expected) / DRAWS) + 0.02)


def test_how_far():
    assert budgets.nearest_m(CAMERA, DOCK) == pytest.approx(700 / 480 * 0.30 / 0.9)
    apart_m, chord_m = budgets.farthest_apart_m(CAMERA, DOCK), 0.30 * math.sin(math.pi / 10)
    assert apart_m == pytest.approx(700 * chord_m / budgets.LEAST_APART_PX)
    # Water magnifies; the port stands some centimetres before the camera, of the 21 m.
    behind_m = budgets.farthest_apart_m(BEHIND, DOCK)
    assert behind_m == pytest.approx(1.333 * apart_m)
    assert budgets.budget(BEHIND, DOCK, behind_m, 0.0).apart_px == pytest.approx(budgets.LEAST_APART_PX, rel=0.005)
    for share, wanted_m in ((1e-6, 0.0), (0.5, apart_m), (0.002, None)):
        far_m = budgets.farthest_m(CAMERA, DOCK, 20, 0.3, lambda one, share=share: one.sigmas[2] / one.range_m - share)
        if wanted_m is None:
            assert budgets.budget(CAMERA, DOCK, far_m, 20.0).sigmas[2] == pytest.approx(share * far_m, rel=0.01)
        else:
            assert far_m == pytest.approx(wanted_m)


@pytest.mark.parametrize(("range_m", "in_view", "apart"), [(1.0, True, True), (0.3, False, True), (20.0, True, False)])
def test_what_is_in_view_and_apart(range_m, in_view, apart):
    found = budgets.budget(CAMERA, DOCK, range_m, 0.0)
    assert (found.in_view, found.lights_apart) == (in_view, apart)


def test_a_dock_of_unknown_lights_has_no_budget():
    with pytest.raises(ValueError, match="an unknown number of lights"):
        budgets.budget(CAMERA, Dock(0.30), 1.0, 10.0)
