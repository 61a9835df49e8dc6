"""Errors that all pictures share: by hand, and by drawing camera, diameter and lights off by their standard errors."""

import math
from dataclasses import replace

import msgspec
import numpy as np
import pytest
from dockpose.camera.camera import Camera
from dockpose.camera.port import FlatPort
from dockpose.camera.sigma import errors_of, moved
from dockpose.dock import Dock
from dockpose.pose.circle import CirclePose, angles_of, rotation_from_angles
from dockpose.pose.shared import SharedErrors
from dockpose.pose.solve import find_poses
from dockpose.pose.uncertainty import PARTS, PoseErrors, _prior_noise_px, _quantile, deviations, log_evidence, nearer
from dockpose.study.judge import nearest, signed_errors
from scipy.integrate import quad
from scipy.spatial.transform import Rotation
from scipy.special import erf, stdtrit
from scipy.stats import chi2

PINHOLE = Camera(700, 700, 319.5, 239.5, 640, 480)
EXACT = {"fx_px": 0.0, "fy_px": 0.0, "cx_px": 0.0, "cy_px": 0.0}


def seen(camera: Camera, dock: Dock, position_m, normal=(0.0, 0.0), noise_px: float = 0.0, seed: int = 0) -> np.ndarray:
    """Images of a dock's lights, at pitch and yaw in degrees."""
    rotation = rotation_from_angles(*np.radians(normal))
    points = camera.project(np.asarray(position_m) + dock.light_points() @ rotation.T)
    return points + np.random.default_rng(seed).normal(0, noise_px, points.shape)


def pose_by(camera: Camera, dock: Dock, points_px: np.ndarray) -> CirclePose:
    choice = find_poses(points_px, camera, dock)[1]
    return choice.candidates[choice.selected]


def test_what_the_residuals_show_of_the_lights_is_not_counted_again():
    rng = np.random.default_rng(3)
    place_m = 0.002
    dock = Dock(0.30, 12, diameter_sigma_m=0.0, lights_sigma_m=place_m)
    built = msgspec.structs.replace(dock, offsets_m=tuple(map(tuple, rng.normal(0, place_m, (12, 3)).tolist())))
    exact = Camera(700, 700, 319.5, 239.5, 640, 480, sigma=EXACT)
    pose = pose_by(exact, dock, seen(exact, built, (0, 0, 1.0)))
    alone = pose_by(exact, dock, seen(exact, dock, (0, 0, 1.0)))
    # As large as where the lights happen to be in place, for it is the same dock; the scatter of 12 residuals in it.
    assert pose.sigma_total_position_m[2] == pytest.approx(alone.sigma_total_position_m[2], rel=0.5)


KNOWN = Camera(700, 705, 310, 245, 640, 480, sigma={"fx_px": 3.0, "fy_px": 3.0, "cx_px": 4.0, "cy_px": 3.0})
BENT = Camera(
    *(700, 690, 319.5, 239.5, 640, 480, (-0.2, 0.05, 0.0, 0.0)),
    sigma={"fx_px": 2.0, "fy_px": 2.0, "cx_px": 2.0, "cy_px": 2.0, "distortion": [0.02, 0.02, 0.001, 0.001]},
    covariance=np.diag(np.square([2.0, 2.0, 2.0, 2.0, 0.02, 0.02, 0.001, 0.001]))
    + 3.9 * np.outer([1, 1, 0, 0, 0, 0, 0, 0], [1, 1, 0, 0, 0, 0, 0, 0]) * (1 - np.eye(8)),
)
PORT = Camera(
    *(700, 700, 319.5, 239.5, 640, 480),
    port=FlatPort(0.03, 0.01),
    sigma={"fx_px": 2.0, "fy_px": 2.0, "cx_px": 2.0, "cy_px": 2.0, "air_gap_m": 0.003, "glass_m": 0.001},
)


def test_of_lights_off_by_a_millimetre_residuals_show_their_noise_by_hand():
    """A metre ahead 1 mm across the line of sight is 0.7 px, and along it 0.15 of that, along one of two axes."""
    shared = SharedErrors(PINHOLE, Dock(0.30, 10, lights_sigma_m=0.001), np.array([0.0, 0.0, 1.0]))
    whole, unseen = (np.linalg.norm(shared.roots(np.eye(3), noise_px)["lights"]) for noise_px in (0.0, 0.35))
    assert unseen / whole == pytest.approx(math.sqrt(1 - (0.35 / 0.7) ** 2 / (1 + 0.15**2 / 2)), rel=1e-3)


@pytest.mark.parametrize("lights", [9, None])
@pytest.mark.parametrize("camera", [KNOWN, BENT, PORT], ids=["known", "bent", "port"])
def test_shared_errors_are_how_a_wrong_number_moves_the_pose(camera: Camera, lights: int | None):
    """Each number a little off, the same picture measured again, and the differences in the numbers' covariance."""
    place_m, angles, share = np.array([0.15, -0.1, 1.1]), (25.0, -20.0), 0.02
    built = Dock(0.30, 9, diameter_sigma_m=0.002, lights_sigma_m=0.001)
    if lights is not None:
        built = msgspec.structs.replace(built, lamp_depth_m=0.01, lamp_depth_sigma_m=0.003)
    normal = -rotation_from_angles(*np.radians(angles))[:, 2]

    def measured(points_px, by=camera, **more) -> CirclePose:
        told = msgspec.structs.replace(built, lights=lights, **more)
        return nearest(find_poses(points_px, by, told)[1].candidates, normal)

    def change(one: CirclePose, other: CirclePose):
        turned = np.subtract(angles_of(one.normal), angles_of(other.normal))
        return np.concatenate([one.position_m - other.position_m, turned]) / (2 * share)

    points = seen(camera, built, place_m, angles)
    names, errors = errors_of(camera)
    sides = [
        [measured(points, moved(camera, name, side * share * sigma)) for side in (1, -1)]
        for name, sigma in zip(names, np.sqrt(np.diag(errors)).tolist(), strict=True)
    ]
    J = np.array([change(*pair) for pair in sides]).T / np.sqrt(np.diag(errors))
    wider, narrower = (measured(points, diameter=0.30 + side * share * 0.002) for side in (1, -1))
    by_lights = []
    for step in 0.001 * share * np.eye(27).reshape(27, 9, 3):
        there, back = (msgspec.structs.replace(built, offsets_m=(side * step).tolist()) for side in (1, -1))
        by_lights.append(
            change(measured(seen(camera, there, place_m, angles)), measured(seen(camera, back, place_m, angles)))
        )
    if lights is not None:
        deeper, less_deep = (measured(points, lamp_depth_m=0.01 + side * share * 0.003) for side in (1, -1))
        by_lights.append(change(deeper, less_deep))
    pose = measured(points)
    assert isinstance(pose.errors.shared, SharedErrors)
    roots = pose.errors.shared.roots(pose.errors.rotation, 0.0)
    for name, variances in (
        ("camera", np.diag(J @ errors @ J.T)),
        ("diameter", change(wider, narrower) ** 2),
        ("lights", np.square(by_lights).sum(axis=0)),
    ):
        (x, y, z), thetas = deviations(roots[name] @ roots[name].T, pose.errors.rotation, 1.0)
        np.testing.assert_allclose([x, y, z, *thetas], np.sqrt(variances), rtol=0.02, atol=2e-5, err_msg=name)


@pytest.mark.parametrize("lights", [10, None])
@pytest.mark.parametrize("camera", [PINHOLE, KNOWN], ids=["usual", "known"])
def test_intervals_hold_where_camera_diameter_and_lights_are_off_by_their_sigmas(camera: Camera, lights: int | None):
    """Truth is drawn about what the files say: errors are as large as is said, no larger and no smaller."""
    rng = np.random.default_rng([len(camera.distortion), camera.port is None, lights or 0])
    draws, ratios = 200, []
    for _ in range(draws):
        true = camera
        names, errors = errors_of(camera)
        for name, off in zip(names, rng.multivariate_normal(np.zeros(len(names)), errors), strict=True):
            true = moved(true, name, float(off))
        told = Dock(0.30, lights or 10, diameter_sigma_m=0.001, lights_sigma_m=0.0005)
        offsets = rng.normal(0, 0.0005, (lights or 10, 3))
        built = Dock(0.30 + rng.normal(0, 0.001), lights or 10, offsets_m=offsets)
        position = np.array([*rng.uniform(-0.2, 0.2, 2), 1.0]) * rng.uniform(0.7, 2.0)
        pitch_yaw = rng.uniform(15, 40, 2) * rng.choice([-1, 1], 2)
        points = seen(true, built, position, tuple(pitch_yaw), 0.1, int(rng.integers(1 << 30)))
        dock = msgspec.structs.replace(told, lights=lights)
        normal = -rotation_from_angles(*np.radians(pitch_yaw))[:, 2]
        pose = nearest(find_poses(points, camera, dock)[1].candidates, normal)
        assert pose.sigma_total_theta_rad is not None
        sigmas = [*pose.sigma_total_position_m, *np.degrees(pose.sigma_total_theta_rad)]
        ratios.append(np.array(signed_errors(pose, position, normal)) / sigmas)
    # Three standard deviations of 95 % of 200, and one per cent for what is not linear.
    held = (np.abs(ratios) <= 1.96).mean(axis=0)
    assert (held >= 0.95 - 3 * math.sqrt(0.95 * 0.05 / draws) - 0.01).all(), held
    # Of errors over their sigmas the root mean square is 1; of 200 it is below 0.84 once in a thousand (chi-squared).
    rms = np.sqrt(np.square(ratios).mean(axis=0))
    assert (rms >= math.sqrt(chi2.ppf(0.001, draws) / draws)).all(), rms


def test_a_pose_says_what_comes_from_what():
    pose = pose_by(PINHOLE, Dock(0.30, 10), seen(PINHOLE, Dock(0.30, 10), (0, 0, 2.0), (10, 10), 0.2))
    errors = pose.errors
    assert errors is not None
    assert tuple(errors.parts) == PARTS
    assert errors.total == pytest.approx(sum(errors.parts.values()))
    assert replace(errors, shared=None).sigmas[None][0] == pytest.approx(pose.sigma_position_m)
    assert pose.covariance is not None
    assert pose.covariance_total is not None
    assert np.sqrt(np.diag(pose.covariance)[:3]) == pytest.approx(pose.sigma_position_m)
    assert np.sqrt(np.diag(pose.covariance_total)[:3]) == pytest.approx(pose.sigma_total_position_m)


@pytest.mark.parametrize("lights", [4, 10, None])
@pytest.mark.parametrize("normal", [(0, 0), (20, -30)])
def test_lamps_behind_the_rim_put_the_dock_before_them(lights, normal):
    deep = Dock(0.30, lights or 10, lamp_depth_m=0.02)
    points = seen(PINHOLE, deep, (0.1, -0.05, 1.2), normal)
    told = msgspec.structs.replace(deep, lights=lights)
    poses = find_poses(points, PINHOLE, told)[1].candidates
    nearest_m = min(np.linalg.norm(pose.position_m - [0.1, -0.05, 1.2]) for pose in poses)
    assert nearest_m < 1e-6


@pytest.mark.parametrize("freedom", [1, 2, 3, 4, 5, 10, 15, 122, 123, 1000])
def test_the_quantile_of_students_distribution_is_scipys(freedom):
    # SciPy 1.13 has its own to ten digits.
    assert _quantile(freedom) * 1.96 == pytest.approx(stdtrit(freedom, 0.975), rel=1e-9)


def test_the_noise_by_the_prior_alone_covers_as_it_should():
    noises = np.geomspace(1e-3, 1e3, 240)
    rising, falling = np.minimum(0, 0.5 * np.log(noises / 0.05)), np.minimum(0, 3 * np.log(0.95 / noises))
    weights = np.exp(rising + falling)
    held = (erf(1.96 * _prior_noise_px() / noises / math.sqrt(2)) * weights).sum() / weights.sum()
    assert held == pytest.approx(0.95, abs=1e-3)


def test_a_covariance_is_about_the_cameras_axes_and_leaves_the_roll_open():
    # Of a dock whose own x axis points along the camera's y, y along -z and z along -x.
    rotation = np.array([[0.0, 0, -1], [1, 0, 0], [0, -1, 0]])
    known = np.diag([0.01, 0.02, 0.03, 0.1, 0.2, 0.0]) ** 2
    known[0, 3] = known[3, 0] = 0.5e-3
    told = PoseErrors(known, rotation, noise=2.0).in_camera(total=False)
    full_turn = (2 * math.pi) ** 2 / 12
    expected = np.diag([4e-4, 16e-4, 36e-4, full_turn, 0.04, 0.16])
    expected[0, 4] = expected[4, 0] = 2e-3  # what turns it about its own x axis turns it about the camera's y
    np.testing.assert_allclose(told, expected, atol=1e-12)


def test_what_nothing_tells_has_a_full_turn_and_a_kilometre():
    told = PoseErrors(1e12 * np.eye(6), np.eye(3)).in_camera(total=False)
    np.testing.assert_allclose(np.diag(told), [1e6] * 3 + [(2 * math.pi) ** 2 / 12] * 3)


def test_errors_of_what_is_fixed_to_the_dock_are_those_of_the_dock_and_of_its_turn():
    rotation = Rotation.from_rotvec([0.4, -0.8, 0.3]).as_matrix()
    lever, entrance = np.array([0.2, -0.1, 0.5]), Rotation.from_rotvec([0.0, 0.5, 0.0]).as_matrix()
    factor = np.random.default_rng(3).normal(0, 0.01, (6, 6))
    carried = PoseErrors(factor @ factor.T, rotation, 0.7).carried(lever, entrance)

    def moved(step):
        """Place of what is fixed, and its turn about its own axes, after a step of the dock's pose."""
        turn = Rotation.from_rotvec(rotation @ step[3:])
        return np.concatenate([step[:3] + turn.apply(lever) - lever, entrance.T @ turn.as_rotvec()])

    by = np.column_stack([(moved(1e-6 * one) - moved(-1e-6 * one)) / 2e-6 for one in np.eye(6)])
    np.testing.assert_allclose(carried.covariance, by @ factor @ factor.T @ by.T, atol=1e-9)
    assert carried.noise == 0.7
    np.testing.assert_array_equal(carried.rotation, entrance)


@pytest.mark.parametrize("freedom", [2, 8, 34])
def test_the_evidence_is_the_integral_of_the_likelihood_over_all_noises(freedom):
    def integral(squares):
        def of(log_noise):
            noise = math.exp(log_noise)
            prior = min(1, (noise / 0.05) ** 0.5) * min(1, (0.95 / noise) ** 3)
            return prior * noise**-freedom * math.exp(-squares / (2 * noise**2))

        around = 0.5 * math.log(squares / freedom)
        return quad(of, around - 4, around + 8, points=[around], limit=200)[0]

    squares = np.array([0.01, 0.05, 0.4, 9.0])
    expected = np.log([integral(each) for each in squares])
    told = log_evidence(squares, freedom)
    np.testing.assert_allclose(told - told[0], expected - expected[0], atol=0.02)


@pytest.mark.parametrize("angles", [(0.0, 0.0, 0.0), (1.0, 0.5, 0.7), (-0.8, -0.9, 2.0)])
def test_deviations_of_the_angles_are_those_of_small_turns_about_the_docks_axes(angles):
    rng, noise, R = np.random.default_rng(4), 0.4, rotation_from_angles(*angles)
    root = 1e-3 * np.array([[1.0, 0, 0], [1.5, 1.2, 0], [0.3, -0.4, 0.8]])
    covariance = np.diag([4.0, 9.0, 16.0, 0.0, 0.0, 0.0])
    covariance[3:, 3:] = root @ root.T
    turns = Rotation.from_rotvec(noise * rng.normal(0, 1, (20_000, 3)) @ root.T).as_matrix()
    spread = np.std([angles_of(-column) for column in (R @ turns)[:, :, 2]], axis=0)
    sigmas_m, sigmas_rad = deviations(covariance, R, noise)
    assert sigmas_m == pytest.approx((noise * 2, noise * 3, noise * 4))
    assert sigmas_rad == pytest.approx(tuple(spread), rel=0.03)


def test_the_truth_crosses_the_middle_by_the_errors_of_the_pose_it_is_of():
    beyond = 0.15865525  # of a normal distribution, beyond one standard error
    first, second = nearer((0.7, 0.3), (1.2, 1.6), ((1e-9, 1e-9), (1.0, 1.0)))
    assert (first, second) == pytest.approx((0.7 + 0.3 * beyond, 0.3 - 0.3 * beyond))
    first, second = nearer((0.7, 0.3), (1.2, 1.6), ((1.0, 1.0), (1e-9, 1e-9)))
    assert (first, second) == pytest.approx((0.7 - 0.7 * beyond, 0.3 + 0.7 * beyond))
    # Where both are one, nothing tells them apart, and far from the middle what is likelier stays so.
    assert nearer((0.9, 0.1), (0.0, 0.0), ((0.01, 0.01), (0.01, 0.01))) == (0.5, 0.5)
    assert nearer((0.9, 0.1), (0.3, 0.3), ((0.01, 0.01), (0.01, 0.01))) == pytest.approx((0.9, 0.1))
