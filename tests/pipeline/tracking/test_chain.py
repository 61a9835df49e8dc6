import math

import numpy as np
import pytest
from dockpose import Camera, Dock, Settings
from dockpose.pose.circle import CirclePose
from dockpose.tracking.chain import Chain, reach_m, speed_sigmas
from scipy.spatial.transform import Rotation

CAMERA, DOCK = Camera(500, 500, 320, 240, 640, 480), Dock(0.5, 8)
SETTINGS = Settings(max_speed_m_per_s=0.9, max_turn_deg_per_s=30.0)
PLACE, NORMAL = np.array([0.3, -0.4, 1.2]), np.array([0.6, 0.0, -0.8])  # 1.3 m away


def pose(place=PLACE, normal=NORMAL, sigma_m=0.01, sigma_rad=(0.02, 0.03)):
    return CirclePose.at(place, normal, CAMERA, sigma_position_m=(sigma_m,) * 3, sigma_theta_rad=sigma_rad)


def test_a_vehicle_reaches_what_its_speed_and_its_turn_bring_it_to():
    assert reach_m(SETTINGS, 2.0, 3.0) == pytest.approx((0.9 + math.pi / 6 * 2) * 3)
    # A third of the top speeds; a turn moves what is 1.3 m away.
    turn = math.pi / 6
    expected = np.repeat([math.hypot(0.9, turn * 1.3), turn], 3) / 3
    np.testing.assert_allclose(speed_sigmas(np.concatenate([PLACE, NORMAL]), SETTINGS), expected)


def test_a_chain_begins_with_a_poses_own_errors_and_unknown_speed():
    chain = Chain.begin(pose(), SETTINGS)
    np.testing.assert_array_equal(chain.position_m, PLACE)
    np.testing.assert_array_equal(chain.normal, NORMAL)
    assert not chain.rates.any()
    # Errors that lights do not show come on top: a thousandth of the range, and .2 degrees; of both tilts the larger.
    np.testing.assert_allclose(chain.variances[0, :3], 0.01**2 + 0.0013**2)
    np.testing.assert_allclose(chain.variances[0, 3:], 0.03**2 + math.radians(0.2) ** 2)
    assert not chain.variances[1].any()
    np.testing.assert_allclose(chain.variances[2], speed_sigmas(chain.state, SETTINGS) ** 2)
    # Where nothing is known of them they are 3 % of the range, and 5 degrees.
    unknown = Chain.begin(CirclePose.at(PLACE, NORMAL, CAMERA), SETTINGS)
    np.testing.assert_allclose(np.sqrt(unknown.variances[0]), [0.039] * 3 + [math.radians(5)] * 3)


def test_speeds_carry_on_and_fade_within_a_second():
    chain = Chain.begin(pose(), SETTINGS)
    moving = Chain(chain.state, np.array([0.1, 0, -0.2, 0, 0.3, 0]), chain.variances)
    later = moving.predict(0.5, SETTINGS)
    kept = math.exp(-0.5)
    np.testing.assert_allclose(later.rates, kept * moving.rates)
    np.testing.assert_allclose(later.position_m, PLACE + (1 - kept) * moving.rates[:3])
    normal = NORMAL + (1 - kept) * moving.rates[3:]
    np.testing.assert_allclose(later.normal, normal / np.linalg.norm(normal))


def test_variances_grow_as_those_of_a_rate_that_fades_at_random():
    # Of a speed of variance r that fades as exp(-t) the state gets (1 - exp(-t))^2 r, of new speeds t^2 / 3 of theirs.
    chain, t = Chain.begin(pose(), SETTINGS), 0.3
    value, _, rate = chain.variances
    kept = math.exp(-t)
    added = speed_sigmas(chain.state, SETTINGS) ** 2 * (1 - kept**2)
    later = chain.predict(t, SETTINGS)
    np.testing.assert_allclose(later.variances[0], value + (1 - kept) ** 2 * rate + added * t**2 / 3)
    np.testing.assert_allclose(later.variances[1], kept * (1 - kept) * rate + added * t / 2)
    np.testing.assert_allclose(later.variances[2], kept**2 * rate + added)
    # Covariances of the step before grow into the state.
    again = later.predict(t, SETTINGS)
    value, both, rate = later.variances
    rate = np.minimum(rate, speed_sigmas(later.state, SETTINGS) ** 2)
    np.testing.assert_allclose(
        again.variances[0], value + 2 * (1 - kept) * both + (1 - kept) ** 2 * rate + added * t**2 / 3
    )


def test_a_known_motion_moves_the_dock_the_other_way_and_leaves_a_fifth_of_the_speeds_to_chance():
    chain = Chain.begin(pose(), SETTINGS)
    moving = Chain(chain.state, np.array([0.0, 0.1, 0, 0, 0, 0.2]), chain.variances)
    travel, turn = np.array([0.1, 0.0, 0.5]), Rotation.from_rotvec([0, math.pi / 2, 0]).as_matrix()
    later = moving.predict(1e-9, SETTINGS, (travel, turn))
    # (0.2, -0.4, 0.7) in the old frame; the camera then looks along the old x axis: x is -z, z is x.
    np.testing.assert_allclose(later.position_m, [-0.7, -0.4, 0.2], atol=1e-6)
    np.testing.assert_allclose(later.normal, [0.8, 0, 0.6], atol=1e-6)
    np.testing.assert_allclose(later.rates, [0, 0.1, 0, -0.2, 0, 0], atol=1e-6)
    np.testing.assert_allclose(later.variances[2], (0.2 * speed_sigmas(chain.state, SETTINGS)) ** 2, rtol=1e-6)


def test_an_update_weighs_prediction_and_pose_by_their_variances():
    chain = Chain.begin(pose(), SETTINGS).predict(0.2, SETTINGS)
    measured = pose(PLACE + [0.05, 0, -0.02], NORMAL, sigma_m=0.02)
    after = chain.update(measured)
    value, both, rate = chain.variances
    distance = np.linalg.norm(measured.position_m)
    own = 0.02**2 + (1e-3 * distance) ** 2
    gain = value[:3] / (value[:3] + own)
    np.testing.assert_allclose(after.position_m, chain.position_m + gain * (measured.position_m - chain.position_m))
    np.testing.assert_allclose(after.rates[:3], both[:3] / (value[:3] + own) * (measured.position_m - chain.position_m))
    # Two independent measurements: 1 / v = 1 / v1 + 1 / v2.
    np.testing.assert_allclose(1 / after.variances[0, :3], 1 / value[:3] + 1 / own)
    np.testing.assert_allclose(after.variances[1, :3], both[:3] * own / (value[:3] + own))
    np.testing.assert_allclose(after.variances[2, :3], rate[:3] - both[:3] ** 2 / (value[:3] + own))
    assert np.linalg.norm(after.normal) == pytest.approx(1)


def test_an_innovation_is_the_squared_angle_and_its_variance():
    chain = Chain.begin(pose(), SETTINGS)
    turned = Rotation.from_rotvec([0, 0.05, 0]).apply(NORMAL)
    square, variance = chain.innovation(pose(normal=turned, sigma_rad=(0.04, 0.01)))
    assert math.sqrt(square) == pytest.approx(0.05, rel=1e-3)
    least = math.radians(0.2) ** 2
    assert variance == pytest.approx(0.03**2 + 0.04**2 + 2 * least)


def test_a_chain_as_a_pose_has_the_angles_errors_that_its_normal_has():
    chain = Chain.begin(pose(), SETTINGS)
    variances = chain.variances.copy()
    variances[0] = [1e-4, 4e-4, 9e-4, 1e-4, 2e-4, 5e-4]
    found = Chain(chain.state, chain.rates, variances).pose(CAMERA, DOCK)
    assert found.sigma_position_m == pytest.approx((0.01, 0.02, 0.03))
    # theta_x = asin n_y: d theta_x = dn_y / cos theta_x, here 1. theta_y = atan2(-n_x, -n_z): by both, at right angles.
    assert found.sigma_theta_rad is not None
    assert found.sigma_theta_rad[0] == pytest.approx(math.sqrt(2e-4))
    assert found.sigma_theta_rad[1] == pytest.approx(math.sqrt(0.8**2 * 1e-4 + 0.6**2 * 5e-4))
    # A nearly unknown normal is off by half a turn at the most.
    variances[0, 3:] = 1e4
    lost = Chain(chain.state, chain.rates, variances).pose(CAMERA, DOCK)
    assert lost.sigma_theta_rad == (math.pi, math.pi)
