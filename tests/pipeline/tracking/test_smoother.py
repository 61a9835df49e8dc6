# A None where a value is expected fails the test, which is what it should do.
# pyright: reportOptionalMemberAccess=false, reportOptionalSubscript=false, reportArgumentType=false
# pyright: reportCallIssue=false, reportAttributeAccessIssue=false

"""Smoothing against a dense least-squares solution, and against the truth of simulated approaches."""

import math

import numpy as np
import pytest
from dockpose import Settings, Tracker
from dockpose.pose.circle import CirclePose, rotation_from_angles
from dockpose.simulate import Approach, FilmPlan
from dockpose.simulate.sequence import scenes
from dockpose.tracking.chain import MEMORY_S, Chain
from dockpose.tracking.hypotheses import Hypotheses, links
from dockpose.tracking.smoother import Smoother, rts_step

from tests.pipeline.tracking.test_tracker import NOTHING, shown
from tests.support.scenes import CAMERA, DOCK, random_scene


def seen(position_m, theta_x, theta_y, noise_px, rng):
    """Estimate of a picture in which all ten lights were found where they are, but for noise; angles in radians."""
    return shown(position_m, rotation_from_angles(theta_x, theta_y), noise_px=noise_px, rng=rng)


def test_it_is_the_solution_of_all_equations_at_once():
    """Per axis x and its rate r: the prior, Ornstein-Uhlenbeck steps and measurements, as one least-squares problem."""
    rng = np.random.default_rng(0)
    # Without turning the noise of the rates is the same at every distance.
    settings = Settings(max_speed_m_per_s=0.6, max_turn_deg_per_s=1e-7)
    sigma_rate, times = 0.6 / 3, np.cumsum(rng.uniform(0.05, 0.4, 25))
    way = np.column_stack([0.1 * np.sin(times), 0.05 * times, 2.0 - 0.1 * times])
    known = {"sigma_position_m": (0.01,) * 3, "sigma_theta_rad": (0.01, 0.01)}
    noisy = way + rng.normal(0, 0.01, way.shape)
    poses = [CirclePose(at, np.array([0.0, 0.0, -1.0]), np.zeros(2), **known) for at in noisy]
    is_seen = rng.random(25) > 0.3
    is_seen[0] = True
    filtered, predicted = [Chain.begin(poses[0], settings)], [None]
    for k in range(1, 25):
        predicted.append(filtered[-1].predict(times[k] - times[k - 1], settings))
        filtered.append(predicted[k].update(poses[k]) if is_seen[k] else predicted[k])
    chain, smoothed = filtered[-1], [filtered[-1]]
    for k in range(23, -1, -1):
        chain = rts_step(filtered[k], predicted[k + 1], chain, times[k + 1] - times[k], settings)
        smoothed.insert(0, chain)
    for axis in range(3):
        H, y = np.zeros((50, 50)), np.zeros(50)

        def add(rows, values, covariance, H=H, y=y):
            weight = np.linalg.inv(covariance)
            H += rows.T @ weight @ rows
            y += rows.T @ weight @ values

        for k in range(25):
            at = np.eye(50)[2 * k : 2 * k + 2]
            measured = poses[k].position_m
            variance = 0.01**2 + (1e-3 * np.linalg.norm(measured)) ** 2
            if k == 0:
                add(at, np.array([measured[axis], 0.0]), np.diag([variance, sigma_rate**2]))
                continue
            elapsed_s = times[k] - times[k - 1]
            kept = math.exp(-elapsed_s / MEMORY_S)
            F = np.array([[1.0, MEMORY_S * (1 - kept)], [0.0, kept]])
            added = sigma_rate**2 * (1 - kept**2)
            Q = added * np.array([[elapsed_s**2 / 3, elapsed_s / 2], [elapsed_s / 2, 1.0]])
            add(at - F @ np.eye(50)[2 * k - 2 : 2 * k], np.zeros(2), Q)
            if is_seen[k]:
                add(at[:1], measured[axis : axis + 1], np.array([[variance]]))
        solution, covariance = np.linalg.solve(H, y), np.linalg.inv(H)
        np.testing.assert_allclose([one.state[axis] for one in smoothed], solution[::2], atol=1e-7)
        np.testing.assert_allclose([one.rates[axis] for one in smoothed], solution[1::2], atol=1e-6)
        np.testing.assert_allclose([one.variances[0, axis] for one in smoothed], np.diag(covariance)[::2], rtol=1e-5)


def course(truth, noise_px=0.3, seed=0, times=None):
    """Filtered and smoothed poses of a dock with these positions and angles (5,), frame by frame."""
    rng = np.random.default_rng(seed)
    tracker, smoother = Tracker(CAMERA, DOCK), Smoother(CAMERA)
    filtered = []
    for number, (x, y, z, theta_x, theta_y) in enumerate(truth):
        found = seen((x, y, z), theta_x, theta_y, noise_px, rng)
        tracked = tracker.follow(found, 0.1 * number if times is None else times[number])
        smoother.note(tracked)
        filtered.append(tracked.step.after.chains[tracked.chain].pose(CAMERA, DOCK))
    return filtered, smoother.poses()


def approach(seed):
    """The truth (80, 5) of an approach from 4 m to 0.8 m, carried by currents."""
    motion = Approach(start_m=4.0, end_m=0.8, frames=80, rate_hz=10.0, drift_m=0.02, drift_deg=0.5)
    found = [scene.pose for _, scene in scenes(FilmPlan(scene=random_scene(seed), motion=motion))]
    return [(*pose.position_m, math.radians(pose.theta_x_deg), math.radians(pose.theta_y_deg)) for pose in found]


def errors(poses, truth):
    """Errors (N, 5) of position and angles, and the same over their standard errors."""
    values = np.array([(*pose.position_m, pose.theta_x_rad, pose.theta_y_rad) for pose in poses])
    sigmas = np.array([(*pose.sigma_position_m, *pose.sigma_theta_rad) for pose in poses])
    return values - np.array(truth), (values - np.array(truth)) / sigmas


def wrong(poses, truth):
    """How many poses face more than 8 degrees away from the truth."""
    normals = [-rotation_from_angles(*true[3:])[:, 2] for true in truth]
    facing = [float(pose.normal @ normal) for pose, normal in zip(poses, normals, strict=True)]
    return sum(cosine < math.cos(math.radians(8)) for cosine in facing)


@pytest.mark.slow
def test_smoothed_poses_are_nearer_to_the_truth_and_their_sigma_holds():
    before, after, ratios = [], [], []
    for seed in range(8):
        truth = approach(seed)
        filtered, smoothed = course(truth, seed=seed)
        poses = [one.pose for one in smoothed]
        assert wrong(poses, truth) == 0
        before.append(errors(filtered, truth)[0])
        after.append(errors(poses, truth)[0])
        ratios.append(errors(poses, truth)[1])
    before, after = (np.sqrt(np.mean(np.square(np.concatenate(each)), axis=0)) for each in (before, after))
    within = (np.abs(np.concatenate(ratios)) < 1.96).mean(axis=0)
    print(f"RMS of x, y, z, theta: filtered {before}, smoothed {after}; within 1.96 sigma {within}")
    assert (after < before).all()
    assert (within >= 0.93).all()


@pytest.mark.slow
def test_the_end_decides_about_the_beginning():
    """From 9 m nothing tells the poses apart; nearer the filter knows, and the smoother knows it from the start."""
    truth = [(0.0, 0.0, z, math.radians(8), math.radians(14)) for z in np.linspace(9, 1.2, 90)]
    times = 0.2 * np.arange(90)
    runs = [course(truth, noise_px=0.5, seed=seed, times=times) for seed in range(6)]
    filtered = [wrong(run[0], truth) for run in runs]
    smoothed = [wrong([one.pose for one in run[1]], truth) for run in runs]
    assert sum(filtered) > 20  # of 540 frames
    assert sum(smoothed) < sum(filtered) / 4


def test_where_the_chains_may_cross_the_pose_stays_with_the_dock():
    """The dock turns past square on, where both poses coincide; which chain is right afterwards is decided anew."""
    truth = [(0.02, 0.01, 1.3, math.radians(3), angle) for angle in np.radians(np.linspace(-25, 25, 60))]
    for seed in range(4):
        filtered, smoothed = course(truth, seed=seed)
        poses = [one.pose for one in smoothed]
        assert wrong(poses, truth) <= wrong(filtered, truth)
        assert wrong(poses, truth) == 0
        assert smoothed[0].probability > 0.99
        assert smoothed[-1].probability > 0.99


def test_frames_without_a_dock_have_none_and_a_gap_is_bridged():
    truth = approach(1)[:30]
    rng = np.random.default_rng(0)
    tracker, smoother, positions = Tracker(CAMERA, DOCK), Smoother(CAMERA), []
    for number, (x, y, z, theta_x, theta_y) in enumerate(truth):
        found = seen((x, y, z), theta_x, theta_y, 0.3, rng)
        if number < 3 or 12 <= number < 17:
            found = NOTHING
        tracked = tracker.follow(found, 0.1 * number)
        smoother.note(tracked)
        positions.append(None if tracked.filtered is None else tracked.filtered.position_m)
    smoothed = smoother.poses()
    assert smoothed[:3] == [None] * 3
    assert None not in smoothed[3:]
    gap = range(12, 17)
    off = [np.linalg.norm(smoothed[k].pose.position_m - truth[k][:3]) for k in gap]
    before = [np.linalg.norm(positions[k] - truth[k][:3]) for k in gap]
    assert np.mean(off) < np.mean(before)
    assert smoothed[14].pose.sigma_position_m[2] > smoothed[8].pose.sigma_position_m[2]


def test_a_track_that_begins_anew_is_smoothed_by_itself():
    """The dock jumps where no vehicle can carry it, after it was lost: the smoothed way jumps with it."""
    truth = [(-0.3, 0.0, 1.5, 0.1, 0.3)] * 12 + [(0.3, 0.0, 1.5, 0.1, 0.3)] * 12
    times = [0.1 * k for k in range(12)] + [60 + 0.1 * k for k in range(12)]
    _, smoothed = course(truth, times=times)
    assert smoothed[11].pose.position_m[0] == pytest.approx(-0.3, abs=0.01)
    assert smoothed[12].pose.position_m[0] == pytest.approx(0.3, abs=0.01)


@pytest.mark.parametrize("first", [0.2, 0.5, 0.9])
def test_links_are_those_of_the_filter(first):
    """From whatever probability before, they lead to the filter's own after, as it bounds neither here."""
    rng = np.random.default_rng(4)
    settings = Settings()
    for angle in np.radians([2.0, 6.0, 15.0]):
        begun = Hypotheses.begin(seen((0.0, 0.0, 2.0), 0.05, angle, 0.3, rng), settings, 0.4)
        before = Hypotheses(begun.chains, first).predict(0.1, settings)
        found = seen((0.0, 0.0, 1.98), 0.05, angle, 0.3, rng)
        after = before.update(found, settings, 0.4)
        weights = np.array([first, 1 - first]) @ links(before, found, 0.4)
        assert weights[0] / weights.sum() == pytest.approx(after.first, abs=1e-9)
