# pyright: reportOperatorIssue=false, reportCallIssue=false, reportArgumentType=false

import math

import numpy as np
import pytest
from dockpose import Dock
from dockpose.camera import FlatPort
from dockpose.lights.ellipse import fit_ellipse
from dockpose.pose.choice import choose_by_side, choose_by_spacing, is_square_on
from dockpose.pose.circle import CirclePose, circle_poses, rotation_from_angles
from dockpose.pose.solve import find_poses
from dockpose.pose.uncertainty import PRIOR_NOISE_PX, PRIOR_NUMBERS, WORTH_OF_EVIDENCE, log_odds, noise_px
from msgspec.structs import replace
from scipy.stats import binom

from tests.support.docks import CAMERA, uneven

DOCK = Dock(0.30, 10)


def seen(position_m, theta_x, theta_y, roll=0.2, dock=DOCK, skip=(), noise_px=0.0, seed=0):
    rotation = rotation_from_angles(theta_x, theta_y, roll)
    points = np.array(position_m) + dock.light_points() @ rotation.T
    points = CAMERA.project(np.delete(points, skip, axis=0))
    return points + np.random.default_rng(seed).normal(0, 1, points.shape) * noise_px, -rotation[:, 2]


def choose(points, dock=DOCK):
    choice = choose_or_not(points, dock)
    assert choice is not None
    return choice


def choose_or_not(points, dock):
    return choose_by_spacing(circle_poses(fit_ellipse(points), CAMERA, dock.diameter), points, CAMERA, dock)


@pytest.mark.parametrize("angles", [(0.3, 0.5), (-0.3, 0.5), (0.6, -0.1), (0.0, 0.35)])
@pytest.mark.parametrize("skip", [(), (3,), (0, 5, 6)])
def test_even_spacing_tells_the_right_pose(angles, skip):
    points, normal = seen((0.1, -0.05, 1.2), *angles, skip=skip)
    choice = choose(points)
    assert choice.selected_by == "spacing"
    first, second = choice.candidates
    np.testing.assert_allclose(first.normal, normal, atol=1e-6)
    assert first.probability > 0.99
    assert first.probability + second.probability == pytest.approx(1)
    assert first.rms_px < 1e-4 < second.rms_px


def spaced_by_eye(seed, across_m=0.0):
    """Points of a dock whose ten lights are up to 3 degrees off along the rim, and ``across_m`` off it."""
    rng = np.random.default_rng(seed)
    angles = np.arange(10) * math.pi / 5 + np.radians(rng.uniform(-3, 3, 10))
    radii = DOCK.radius + rng.normal(0, across_m, 10)
    lights = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), np.zeros(10)])
    rotation = rotation_from_angles(0.3, 0.5, 0.2)
    points = CAMERA.project(np.array([0.1, -0.05, 1.2]) + lights @ rotation.T)
    return points + rng.normal(0, 0.05, points.shape), -rotation[:, 2]


@pytest.mark.parametrize("seed", range(5))
def test_lights_spaced_by_eye_on_a_true_rim_turn_the_dock_by_no_more_than_their_noise(seed):
    points, normal = spaced_by_eye(seed)
    (pose, _) = choose(points).candidates
    # A twentieth of a pixel across a ring of 88 px turns it by some hundredths of a degree; spacing would by degrees.
    assert math.degrees(math.acos(pose.normal @ normal)) < 0.2
    assert np.linalg.norm(pose.position_m - (0.1, -0.05, 1.2)) < 1.5e-3
    off = np.array([*(pose.position_m - (0.1, -0.05, 1.2))])
    assert (np.abs(off) < 4 * np.array(pose.sigma_position_m)).all()
    assert max(pose.sigma_theta_rad) < math.radians(0.2)
    assert pose.rms_px > 1  # they are off their places all the same


def test_lights_off_in_all_directions_say_nothing_of_a_slide():
    # As much across the rim as along it, some 4 mm: the places of all ten tell more than the ellipse.
    points, _ = spaced_by_eye(1, across_m=0.004)
    (pose, _) = choose(points).candidates
    assert max(pose.sigma_theta_rad) > math.radians(0.5)


def test_roll_comes_back_modulo_the_spacing():
    for roll in (0.2, 0.2 + 3 * np.pi / 5):
        points, _ = seen((0.1, -0.05, 1.2), 0.3, 0.5, roll=roll)
        assert choose(points).candidates[0].roll_rad == pytest.approx(0.2, abs=1e-5)


def test_a_dock_before_its_lamps_is_as_uncertain_as_their_tilt_moves_it():
    """By far more than the ring's own place is off: a turn about x moves it along y, and one about y along x."""
    deep = replace(DOCK, lamp_depth_m=0.14)
    points, _ = seen((0.0, 0.0, 1.0), 0.15, 0.1, dock=deep, noise_px=0.1)
    pose = find_poses(points, CAMERA, deep)[1].candidates[0]
    assert pose.sigma_position_m is not None
    sigma_x_m, sigma_y_m, _ = pose.sigma_position_m
    assert (sigma_y_m, sigma_x_m) == pytest.approx([0.14 * sigma for sigma in pose.sigma_theta_rad], rel=0.1)
    assert np.sqrt(np.diag(pose.covariance)[:3]) == pytest.approx(pose.sigma_position_m)


def test_lights_are_numbered_around_the_ring():
    points, _ = seen((0.1, -0.05, 1.2), 0.3, 0.5, skip=(4,))
    numbers = choose(points).lights
    steps = np.diff(numbers) % 10
    assert steps.tolist() == [1, 1, 1, 2, 1, 1, 1, 1]


def test_the_likelier_is_right_as_often_as_the_reference_says():
    # shared reference, 10 of 10 lights, 3 m, 10 degrees, 0.3 px: 0.90 of trials; 200 trials scatter by 0.02.
    right = 0
    for seed in range(200):
        points, normal = seen((0.0, 0.0, 3.0), np.radians(10), 0.0, roll=seed, noise_px=0.3, seed=seed)
        first, second = choose(points).candidates
        right += first.normal @ normal > second.normal @ normal
    assert right / 200 > 0.90 - 3 * 0.02


@pytest.mark.parametrize(
    ("numbers", "least_px", "spare", "floor_px2"),
    [
        (20, 0.0, 14, 0.0),
        (20, 0.2, 14, 0.0),  # .04 of 14, which both have
        (20, 0.5, 14, 2.5),  # .25 of 14 are 3.5, and 1 is there
        (8, 0.5, 2, 0.0),
        (4, 0.5, 0, 0.0),  # as many as a pose has, or fewer: nothing to spare
    ],
)
def test_odds_are_the_ratio_of_squares_to_half_of_the_numbers_to_spare(numbers, least_px, spare, floor_px2):
    for first, second, sign in ((1.0, 4.0, 1), (4.0, 1.0, -1)):
        floor = PRIOR_NUMBERS * PRIOR_NOISE_PX**2 + floor_px2
        odds = WORTH_OF_EVIDENCE * (PRIOR_NUMBERS + spare) / 2 * math.log((floor + 4) / (floor + 1))
        assert log_odds(first, second, numbers, least_px) == pytest.approx(sign * odds)


def test_the_noise_is_told_by_the_residuals_less_the_five_or_with_the_roll_six_numbers_of_a_pose():
    """Of lights anywhere on the circle only what is across it is a residual."""
    points, _ = seen((0.1, -0.05, 1.5), 0.3, 0.5, noise_px=0.3)
    poses = circle_poses(fit_ellipse(points), CAMERA, DOCK.diameter)
    count = len(points)
    for choice, numbers, freedom in (
        (choose_by_side(poses, points, CAMERA, DOCK), count, 5),
        (choose(points), 2 * count, 6),
    ):
        least_px2 = count * min(pose.rms_px**2 for pose in choice.candidates)
        for pose in choice.candidates:
            assert pose.errors.noise == pytest.approx(noise_px(least_px2, numbers, freedom))


@pytest.mark.parametrize(
    ("off_deg", "sigma_deg", "is_on"),
    [
        (0.09, None, True),
        (0.11, None, False),
        (2.0, (1.0, 1.0), False),
        (2.0, (1.0, 2.1), True),
        (2.0, (2.1, 1.0), True),
    ],
)
def test_a_dock_is_square_on_where_its_twin_twice_as_far_off_is_within_its_errors(off_deg, sigma_deg, is_on):
    """Off the line of sight, which need not be the camera's axis; poses a fifth of a degree apart are the same."""
    place_m = np.array([0.3, -0.2, 1.0])
    sight = place_m / np.linalg.norm(place_m)
    aside = np.cross(sight, [0.0, 1.0, 0.0])
    off = math.radians(off_deg)
    normal = -math.cos(off) * sight + math.sin(off) * aside / np.linalg.norm(aside)
    sigma = None if sigma_deg is None else tuple(np.radians(sigma_deg).tolist())
    assert is_square_on(CirclePose.at(place_m, normal, CAMERA, sigma_theta_rad=sigma)) == is_on


def test_the_truth_may_be_nearer_to_the_other_pose_where_their_errors_overlap():
    points, _ = seen((0.0, 0.0, 4.0), 0.03, 0.0, noise_px=0.1, seed=1)
    choice = choose(points)
    first, second = (10 * pose.rms_px**2 for pose in choice.candidates)
    apart_rad = math.acos(choice.candidates[0].normal @ choice.candidates[1].normal)
    assert apart_rad < 2 * max(choice.candidates[0].sigma_theta_rad)
    assert 0.5 < choice.candidates[0].probability < 1 / (1 + math.exp(-log_odds(first, second, 20))) - 0.1


def anywhere(dock, camera, seed, noise_px=0.0):
    """Lights in the picture, and the pose, of a dock anywhere in view."""
    rng = np.random.default_rng(seed)
    roll = float(rng.uniform(0, 2 * math.pi))
    theta_x, theta_y = np.radians(rng.uniform(-30, 30, 2)).tolist()
    rotation = rotation_from_angles(theta_x, theta_y, roll)
    place = np.array([*rng.uniform(-0.2, 0.2, 2), rng.uniform(1, 2)])
    points_px = camera.project(dock.light_points() @ rotation.T + place)
    return points_px + rng.normal(0, noise_px, points_px.shape), rotation, place, roll


@pytest.mark.parametrize("camera", [CAMERA, replace(CAMERA, port=FlatPort(0.02, 0.005))], ids=["air", "port"])
@pytest.mark.parametrize("seed", range(4))
def test_without_noise_the_pose_is_exact_and_the_roll_known(camera, seed):
    dock = uneven(seed)
    points_px, rotation, place, roll = anywhere(dock, camera, seed)
    _, choice = find_poses(points_px, camera, dock)
    pose = choice.candidates[0]
    assert pose.position_m == pytest.approx(place, abs=2e-5)
    assert pose.normal == pytest.approx(-rotation[:, 2], abs=1e-4)
    assert pose.roll_rad is not None
    assert math.remainder(pose.roll_rad - roll, 2 * math.pi) == pytest.approx(0, abs=1e-3)
    assert choice.lights.tolist() == list(range(10))


def test_the_roll_of_a_far_dock_stays_modulo_the_spacing():
    dock = uneven(1, off_m=0.1e-3)
    points_px, _, _, _ = anywhere(dock, CAMERA, 1, noise_px=0.3)
    pose = find_poses(points_px, CAMERA, dock)[1].candidates[0]
    assert pose.roll_rad is not None
    assert pose.roll_rad < 2 * math.pi / 10


def chosen_of_built(along_deg, across, docks):
    """The chance of the chosen pose, and whether it is the nearer one, of docks whose lights are off at random."""
    found = []
    for seed in range(docks):
        rng = np.random.default_rng([seed, 17])
        lights = int(rng.choice([5, 6, 8, 12]))
        angles = math.tau * np.arange(lights) / lights + math.radians(along_deg) * rng.normal(0, 1, lights)
        radii = 0.15 * (1 + across * rng.normal(0, 1, lights))
        ring = np.column_stack([radii * np.cos(angles), radii * np.sin(angles), 0 * angles])
        rotation = rotation_from_angles(*rng.uniform(-0.5, 0.5, 2))
        points = CAMERA.project(np.array([*rng.uniform(-0.1, 0.1, 2), 0.9]) + ring @ rotation.T)
        choice = find_poses(points + rng.normal(0, 0.05, points.shape), CAMERA, Dock(0.30, lights))[1]
        if choice.selected_by == "spacing":
            one, other = choice.candidates
            found.append((one.probability, one.normal @ -rotation[:, 2] > other.normal @ -rotation[:, 2]))
    return found


@pytest.mark.parametrize(("along_deg", "across"), [(6, 0.01), (4, 0.01), (2, 0.02)])
def test_of_docks_that_hands_have_built_no_more_are_wrong_than_is_said(along_deg, across):
    """Beside the wrong pose the right one may be no least sum of squares: a refined one is not held against it."""
    found = [one for one in chosen_of_built(along_deg, across, 500) if one[0] >= 0.95]
    assert len(found) > 100
    wrong, said = sum(not right for _, right in found), np.mean([1 - chance for chance, _ in found])
    assert wrong <= binom.ppf(0.999, len(found), said)


def test_of_docks_built_exactly_the_right_pose_is_sure():
    found = chosen_of_built(0.2, 0.002, 100)
    assert len(found) == 100
    assert all(chance > 0.95 and right for chance, right in found)
