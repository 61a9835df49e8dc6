# pyright: reportArgumentType=false, reportOperatorIssue=false

import math

import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.camera.port import FlatPort
from dockpose.lights.ellipse import NoEllipseError
from dockpose.pose import few_lights
from dockpose.pose.assignments import assignments, squares_of
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.few_lights import poses_from_few_lights
from dockpose.pose.refine import light_rays, refine
from dockpose.pose.solve import find_poses

from tests.support.scenes import CAMERA

WET = Camera(500, 490, 310, 245, 640, 480, (-0.2, 0.05, 0.001, -0.001, 0.0), FlatPort(0.03, 0.01))
POSITION, ANGLES, ROLL = np.array([0.1, -0.08, 1.1]), (0.3, -0.45), 1.9
NORMAL = -rotation_from_angles(*ANGLES)[:, 2]


def seen(dock, which, camera=CAMERA):
    return camera.project(POSITION + dock.light_points()[list(which)] @ rotation_from_angles(*ANGLES, ROLL).T)


@pytest.mark.parametrize("camera", [CAMERA, WET])
@pytest.mark.parametrize("which", [(0, 1, 2, 3), (7, 0, 4, 2), (9, 3, 6, 5)])
def test_four_lights_of_ten_in_any_order(camera, which):
    dock = Dock(0.30, 10)
    choice = poses_from_few_lights(seen(dock, which, camera), camera, dock)
    pose = choice.candidates[0]
    np.testing.assert_allclose(pose.position_m, POSITION, atol=1e-4)
    np.testing.assert_allclose(pose.normal, NORMAL, atol=1e-4)
    assert choice.decided
    # Numbered from any light on, but all from the same one.
    assert len({(found - true) % 10 for found, true in zip(choice.lights, which, strict=True)}) == 1
    assert pose.roll_rad == pytest.approx(ROLL % (math.pi / 5), abs=1e-3)


def test_four_uneven_lights_tell_their_own_numbers():
    dock = Dock(0.30, angles_deg=(0, 40, 150, 200, 300))
    choice = poses_from_few_lights(seen(dock, (4, 1, 0, 2)), CAMERA, dock)
    np.testing.assert_allclose(choice.candidates[0].position_m, POSITION, atol=1e-4)
    assert choice.lights.tolist() == [4, 1, 0, 2]
    assert choice.candidates[0].roll_rad == pytest.approx(ROLL, abs=1e-3)


def test_three_lights_fit_many_poses():
    dock = Dock(0.30, 10)
    assert not poses_from_few_lights(seen(dock, (0, 2, 5)), CAMERA, dock).decided


def test_find_poses_takes_four_lights_and_gives_the_ellipse_of_their_pose():
    dock = Dock(0.30, 10)
    ellipse, choice = find_poses(seen(dock, (0, 1, 4, 6)), CAMERA, dock)
    np.testing.assert_allclose(choice.candidates[0].normal, NORMAL, atol=1e-4)
    assert ellipse.distances(seen(dock, range(10))).max() < 1e-2


@pytest.mark.parametrize(
    ("points", "dock", "message"),
    [
        ([[0, 0], [1, 0]], Dock(0.3, 10), "3 different lights, there are 2"),
        ([[0, 0], [1, 0], [1, 0], [5, 6]], Dock(0.3, 10), "there are 3 in 4"),
        ([[0, 0], [1, 2], [2, 4], [3, 6]], Dock(0.3, 10), "on a line"),
        ([[0, 0], [1, 0], [0, 1], [math.nan, 1]], Dock(0.3, 10), "not finite"),
        ([[0, 0], [1, 0], [0, 1], [1, 1]], Dock(0.3), "number of lights is not known"),
        ([[0, 0], [1, 0], [0, 1], [1, 1]], Dock(0.3, 3), "there are 4 lights, but the dock has 3"),
        ([[0, 0], [90, 0], [0, 90], [80, 90]], Dock(0.3, 60), "too many"),
        # One lies within the triangle of the others; points of an ellipse never do.
        ([[0, 0], [90, 0], [0, 90], [25, 30]], Dock(0.3, 10), "no pose"),
    ],
)
def test_lights_that_tell_no_pose_are_named(points, dock, message):
    with pytest.raises(NoEllipseError, match=message):
        poses_from_few_lights(points, CAMERA, dock)


@pytest.mark.parametrize("lights", [16, 24, 48])
def test_four_of_many_lights_are_refined_for_few_assignments(lights, monkeypatch):
    tried = []

    def counted(rotations, *others):
        tried.append(len(rotations))
        return refine(rotations, *others)

    monkeypatch.setattr(few_lights, "refine", counted)
    dock = Dock(0.30, lights)
    points = seen(dock, (0, lights // 4, lights // 2, lights // 2 + 3))
    np.testing.assert_allclose(
        poses_from_few_lights(points, CAMERA, dock).candidates[0].position_m, POSITION, atol=1e-3
    )
    assert max(tried) <= 48  # two poses each of 24 of up to 16,215 assignments


def test_squares_to_first_order_are_those_of_the_refined_pose():
    dock = Dock(0.30, 10)
    points = seen(dock, (0, 2, 5, 6)) + np.random.default_rng(3).normal(0, 0.1, (4, 2))
    rays = light_rays(points, CAMERA)
    squares = squares_of(dock, rays.tangents, rays.slopes_px)
    row = assignments(4, dock).tolist().index([0, 2, 5, 6])
    pose = poses_from_few_lights(points, CAMERA, dock).candidates[0]
    assert math.sqrt(squares[row] / 4) == pytest.approx(pose.rms_px, rel=0.02)


def test_five_of_ten_lights_are_judged_by_all_their_assignments():
    dock = Dock(0.30, 10)
    assert len(assignments(5, dock)) == math.comb(9, 4)
    choice = poses_from_few_lights(seen(dock, (3, 4, 5, 8, 9)), CAMERA, dock)
    np.testing.assert_allclose(choice.candidates[0].position_m, POSITION, atol=1e-4)
    assert choice.decided


def test_lights_off_their_places_by_pixels_leave_it_less_certain_but_are_no_other_pose():
    dock = Dock(0.30, 4)
    points = seen(dock, range(4))
    sure = poses_from_few_lights(points, CAMERA, dock)
    unsure = poses_from_few_lights(points + [[1.2, 0], [0, -1.2], [1.2, 0], [0, 1.2]], CAMERA, dock)
    assert 0.13 < unsure.candidates[0].rms_px < 2
    assert sure.candidates[0].probability > unsure.candidates[0].probability
    assert unsure.candidates[0].sigma_position_m[2] > 5 * sure.candidates[0].sigma_position_m[2]
    np.testing.assert_allclose(unsure.candidates[0].position_m, POSITION, rtol=0.02, atol=0.005)


def test_four_lights_off_the_axis_begin_at_the_true_pose():
    angles, position = np.array([[0.0, 1.5, 3.2, 4.9]]), np.array([0.5, -0.4, 1.1])
    rim = 0.15 * np.column_stack([np.cos(angles[0]), np.sin(angles[0]), np.zeros(4)])
    seen_m = position + rim @ rotation_from_angles(*ANGLES).T
    _, rotations, positions = few_lights._starts(seen_m[:, :2] / seen_m[:, 2:], angles, 0.15)
    off = np.abs(np.hstack([rotations[:, :, 2] + NORMAL, positions - position])).max(axis=1)
    assert off.min() < 0.05 < off.max()
