# pyright: reportOperatorIssue=false, reportCallIssue=false, reportArgumentType=false

import math

import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.camera.port import FlatPort
from dockpose.lights.ellipse import fit_ellipse
from dockpose.pose.choice import choose_by_spacing
from dockpose.pose.circle import circle_poses, rotation_from_angles
from dockpose.pose.refine import light_rays, on_planes, refine, squares_at, weigh
from dockpose.pose.uncertainty import LIKELY_NOISE_PX, noise_px
from scipy.optimize import brentq

from tests.support.scenes import CAMERA

DOCK = Dock(0.30, 10)
BENT = Camera(700, 690, 310, 250, 640, 480, (-0.30, 0.10, 0.001, -0.002, 0.01))


def candidates_of(*arguments):
    return choose_by_spacing(*arguments).candidates


def seen(position_m, theta_x, theta_y, *, camera=CAMERA, noise_px=0.0, seed=0, count=10):
    rotation = rotation_from_angles(theta_x, theta_y)
    rng = np.random.default_rng(seed)
    angles = 2 * np.pi * np.arange(count) / count + rng.uniform(0, 6)
    ring = DOCK.radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    points = camera.project(np.array(position_m) + ring @ rotation.T)
    return points + rng.normal(0, 1, points.shape) * noise_px, rotation, angles


def slopes(rotation, position, angles, axis, h=1e-6):
    """How lights move in the picture by a step of the pose: along the camera's axes, or about the dock's."""

    def project(step):
        x, y, z = step[3:]
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        ring = DOCK.radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
        return CAMERA.project(position + step[:3] + ring @ (rotation @ (np.eye(3) + cross)).T)

    return (project(h * axis) - project(-h * axis)) / (2 * h)


def test_the_covariance_is_that_of_numerical_derivatives():
    points, rotation, angles = seen((0.1, -0.05, 1.2), 0.3, 0.5)
    position, radius = np.array([0.1, -0.05, 1.2]), DOCK.radius
    fit = refine(rotation[None], position[None], angles[None], radius, light_rays(points, CAMERA))

    J = np.column_stack([slopes(rotation, position, angles, axis).ravel() for axis in np.eye(6)])
    expected = np.linalg.inv(J.T @ J)
    np.testing.assert_allclose(fit.covariances[0], expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())


def test_errors_are_as_large_as_the_deviations_say():
    """Whitened errors of 300 poses at a fixed noise: their mean square is known to 0.08."""
    off = []
    for seed in range(300):
        points, _, _ = seen((0.1, -0.05, 1.2), 0.4, 0.3, noise_px=0.2, seed=seed)
        poses = circle_poses(fit_ellipse(points), CAMERA, DOCK.diameter)
        pose = candidates_of(poses, points, CAMERA, DOCK)[0]
        truth = [0.1, -0.05, 1.2, 0.4, 0.3]
        found = [*pose.position_m, pose.theta_x_rad, pose.theta_y_rad]
        sigma = [*pose.sigma_position_m, *pose.sigma_theta_rad]
        off.append((np.array(found) - truth) / sigma)
    inside = (np.abs(off) < 1.96).mean(axis=0)
    # The share of 300 is known to 0.013.
    assert (inside > 0.91).all()
    assert (inside < 0.99).all()


@pytest.mark.parametrize("numbers", [6, 8, 10, 14])
def test_noise_drawn_as_it_is_likely_is_held_in_95_of_100(numbers):
    # Three lights leave no residual, four leave two. 20,000 draws know the share to 0.0015,
    # the prior's tails cost 0.015.
    rng = np.random.default_rng(numbers)
    noise = np.exp(rng.uniform(*np.log(LIKELY_NOISE_PX), 20_000))
    squares = noise**2 * (rng.chisquare(numbers - 6, len(noise)) if numbers > 6 else 0.0)
    error = rng.normal(0, noise)
    held = np.mean([abs(e) < 1.96 * noise_px(s, numbers, 6) for e, s in zip(error, squares, strict=True)])
    assert 0.935 <= held <= 0.97


def test_lights_out_of_place_are_weighed_alike_and_none_is_better_than_its_picture():
    points, _, angles = seen((0.1, -0.05, 1.2), 0.3, 0.5, noise_px=0.5)
    known = np.array([(0.01 if light % 2 else 0.05) ** 2 * np.eye(2) for light in range(10)])
    rays, R = light_rays(points, CAMERA), rotation_from_angles(0.3, 0.5)
    fit = refine(R[None], np.array([[0.1, -0.05, 1.2]]), angles[None], DOCK.radius, rays)
    same, noise = weigh(rays, known, fit, 0, angles, DOCK.radius)
    assert same is rays
    assert noise == pytest.approx(math.sqrt(2 / (1 / 0.01**2 + 1 / 0.05**2)))
    exact, _, angles = seen((0.1, -0.05, 1.2), 0.3, 0.5)
    poses = circle_poses(fit_ellipse(exact), CAMERA, DOCK.diameter)
    told = [candidates_of(poses, exact, CAMERA, DOCK, scale * known)[0] for scale in (1, 100)]
    assert told[1].sigma_position_m[2] == pytest.approx(10 * told[0].sigma_position_m[2], rel=0.05)


def test_weights_are_inverses_of_covariances_and_of_what_all_lights_have_beyond_them():
    # Lights off by .3 px that are known to a tenth of that, each with a long and a short axis askew.
    points, _, angles = seen((0.1, -0.05, 1.2), 0.3, 0.5, noise_px=0.3)
    rng, rays, R = np.random.default_rng(5), light_rays(points, BENT), rotation_from_angles(0.3, 0.5)
    factors = rng.normal(0, 0.03, (10, 2, 2)) * np.geomspace(0.3, 10, 10)[:, None, None]
    known = factors @ factors.transpose(0, 2, 1) + 0.01**2 * np.eye(2)
    fit = refine(R[None], np.array([[0.1, -0.05, 1.2]]), angles[None], DOCK.radius, rays)
    weighed, noise = weigh(rays, known, fit, 0, angles, DOCK.radius)
    lights = DOCK.radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    there = lights @ fit.rotations[0].T + fit.positions_m[0]
    off = np.einsum("nij,nj->ni", rays.slopes_px, rays.tangents - there[:, :2] / there[:, 2:])

    def left(more):
        return sum(r @ np.linalg.solve(C + more * np.eye(2), r) for r, C in zip(off, known, strict=True)) - 14

    more = brentq(left, 1e-4, 10)
    assert more > 1e-3
    inverses = np.linalg.inv(known + more * np.eye(2))
    inverses /= np.trace(inverses.T).mean() / 2
    roots = weighed.slopes_px @ np.linalg.inv(rays.slopes_px)
    np.testing.assert_allclose(roots.transpose(0, 2, 1) @ roots, inverses, rtol=1e-3, atol=1e-5)
    assert noise == pytest.approx(1 / math.sqrt(np.trace(np.linalg.inv(known).T).mean() / 2))


def test_squares_of_a_pose_are_those_of_its_projection():
    points, R, angles = seen((0.1, -0.05, 1.2), 0.3, 0.5, noise_px=0.3)
    place, offsets = np.array([0.1, -0.05, 1.2]), np.random.default_rng(1).normal(0, 0.001, (10, 3))
    ring = DOCK.radius * np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    rays = light_rays(points, CAMERA)
    for off in (None, offsets):
        there = place + (ring if off is None else ring + off) @ R.T
        expected = ((CAMERA.project(there) - points) ** 2).sum()
        assert squares_at(R, place, angles, DOCK.radius, rays, off) == pytest.approx(expected)


@pytest.mark.parametrize("port", [None, FlatPort(0.03, 0.01)])
def test_rays_meet_the_planes_of_docks_where_the_lights_are(port):
    camera = Camera(700, 690, 310, 250, 640, 480, port=port)
    points, R, angles = seen((0.1, -0.05, 1.2), 0.3, 0.5, camera=camera)
    places = np.array([[0.1, -0.05, 1.2]] * 2)
    turned = R @ rotation_from_angles(0.0, 0.0)
    flat = on_planes(light_rays(points, camera, 1.2), np.array([R, turned]), places)
    ring = DOCK.radius * np.column_stack([np.cos(angles), np.sin(angles)])
    np.testing.assert_allclose(flat[0], ring, atol=1e-6)


def test_free_lights_leave_the_roll_open_and_the_other_errors_as_across_the_circle():
    points, R, angles = seen((0.1, -0.05, 1.2), 0.3, 0.5)
    place = np.array([0.1, -0.05, 1.2])
    fit = refine(R[None], place[None], None, DOCK.radius, light_rays(points, CAMERA))
    assert (fit.numbers, fit.points) == (10, 10)

    *steps, along = (slopes(R, place, angles, axis) for axis in np.eye(6))  # a turn about the dock's own axis is last
    across = np.column_stack([-along[:, 1], along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    J = np.column_stack([(each * across).sum(axis=1) for each in steps])
    expected = np.linalg.inv(J.T @ J)
    np.testing.assert_allclose(fit.covariances[0, :5, :5], expected, rtol=1e-3, atol=1e-4 * np.abs(expected).max())


def test_of_several_poses_each_is_refined_and_a_hopeless_one_holds_nothing_up():
    points, R, angles = seen((0.1, -0.05, 1.2), 0.3, 0.5, noise_px=0.1)
    starts = np.array([R @ rotation_from_angles(0.05, -0.04), R, rotation_from_angles(-0.9, -0.9)])
    places, rays = np.array([[0.11, -0.06, 1.3], [0.1, -0.05, 1.2], [0.1, -0.05, 1.2]]), light_rays(points, CAMERA)
    fit = refine(starts, places, np.tile(angles, (3, 1)), DOCK.radius, rays)
    assert fit.squares_px2[0] == pytest.approx(fit.squares_px2[1], abs=1e-4)
    assert fit.squares_px2[0] == pytest.approx(
        squares_at(fit.rotations[0], fit.positions_m[0], angles, 0.15, rays, None), abs=1e-4
    )
    np.testing.assert_allclose(fit.positions_m[0], fit.positions_m[1], atol=1e-5)
    assert fit.squares_px2[2] > 10 * fit.squares_px2[0]
    one = fit.taken(np.array([1]))
    np.testing.assert_array_equal(one.rotations, fit.rotations[[1]])
    np.testing.assert_array_equal(one.covariances, fit.covariances[[1]])
    assert (one.numbers, one.points) == (20, 10)
