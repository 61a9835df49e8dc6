# pyright: reportOperatorIssue=false, reportCallIssue=false, reportArgumentType=false

import math

import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.camera.port import FlatPort
from dockpose.lights.ellipse import NoEllipseError
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.solve import both_poses, find_poses

from tests.support.scenes import CAMERA

DOCK = Dock(0.30, 10)
IN_AIR = Camera(500, 500, 319.5, 239.5, 640, 480, port=FlatPort(0.03, 0.01))
BEHIND_ALL = Camera(500, 490, 310, 245, 640, 480, (-0.2, 0.05, 0.001, -0.001, 0.0), FlatPort(0.03, 0.01))
FISHEYE = Camera(300, 305, 310, 250, 640, 480, (-0.02, 0.005, -0.001, 0.0002), fisheye=True)


def seen(camera, position_m, theta_x, theta_y, dock=DOCK):
    rotation = rotation_from_angles(theta_x, theta_y)
    return camera.project(np.array(position_m) + dock.light_points() @ rotation.T), -rotation[:, 2]


@pytest.mark.parametrize("range_m", [0.5, 1.0, 3.0, 10.0])
@pytest.mark.parametrize("off_axis_deg", [0, 12, 25])
@pytest.mark.parametrize("camera", [IN_AIR, BEHIND_ALL])
def test_behind_a_port_the_range_is_right_near_and_far_on_and_off_the_axis(camera, range_m, off_axis_deg):
    off = math.radians(off_axis_deg)
    position = range_m * np.array([math.sin(off), 0.1, math.cos(off)])
    points, normal = seen(camera, position, 0.3, -0.4)
    _, choice = find_poses(points, camera, DOCK)
    pose = choice.candidates[0]
    np.testing.assert_allclose(pose.position_m, position, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(pose.normal, normal, atol=1e-4)
    # A third of the bound that the issue sets; without the port it is off by a fifth.
    assert np.linalg.norm(pose.position_m) == pytest.approx(np.linalg.norm(position), rel=0.001)


@pytest.mark.parametrize("camera", [CAMERA, FISHEYE, BEHIND_ALL])
def test_the_ellipse_is_what_the_pinhole_would_see(camera):
    points, _ = seen(camera, (0.2, -0.1, 0.8), 0.3, -0.4)
    ellipse, choice = find_poses(points, camera, DOCK)
    pinhole = Camera(camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height)
    direct, _ = seen(pinhole, (0.2, -0.1, 0.8), 0.3, -0.4)
    assert ellipse.distances(direct).max() < 1e-3
    np.testing.assert_allclose(choice.candidates[0].centre_px, pinhole.project([(0.2, -0.1, 0.8)])[0], atol=1e-3)


@pytest.mark.parametrize("camera", [CAMERA, FISHEYE, BEHIND_ALL])
def test_both_candidates_of_an_uneven_unknown_ring_explain_the_picture(camera):
    uneven = Dock(0.30, angles_deg=(0, 30, 100, 160, 200, 290))
    points, normal = seen(camera, (0.1, -0.1, 0.8), 0.3, -0.4, uneven)
    _, choice = find_poses(points, camera, Dock(0.30, 10))
    assert (choice.selected_by, choice.lights) == ("none", None)
    assert [pose.probability for pose in choice.candidates] == [0.5, 0.5]
    # Behind a port the rays do not meet in one point, so that the wrong pose does not explain them quite as well.
    assert max(pose.rms_px for pose in choice.candidates) < 0.01 + 0.1 * (camera is BEHIND_ALL)
    assert max(pose.normal @ normal for pose in choice.candidates) == pytest.approx(1, abs=1e-6)


def test_square_on_both_poses_are_one_and_it_says_so():
    points, _ = seen(CAMERA, (0, 0, 1.5), 0.0, 0.0)
    _, choice = find_poses(points, CAMERA, DOCK)
    assert choice.coincide
    for pose in choice.candidates:
        np.testing.assert_allclose(pose.position_m, [0, 0, 1.5], atol=1e-4)
        assert pose.normal[2] < -0.9999
        assert np.isfinite([*pose.sigma_position_m, *pose.sigma_theta_rad]).all()
    tilted, _ = seen(CAMERA, (0, 0, 1.5), 0.4, 0.0)
    assert not find_poses(tilted, CAMERA, DOCK)[1].coincide


@pytest.mark.parametrize("seed", range(10))
def test_noise_square_on_never_breaks_it(seed):
    points, _ = seen(CAMERA, (0, 0, 1.5), 0.0, 0.0)
    points = points + np.random.default_rng(seed).normal(0, 0.5, points.shape)
    for pose in find_poses(points, CAMERA, DOCK)[1].candidates:
        assert pose.position_m[2] == pytest.approx(1.5, rel=0.02)
        assert np.isfinite([*pose.normal, *pose.sigma_position_m, *pose.sigma_theta_rad, pose.probability]).all()


@pytest.mark.parametrize("seed", range(40))
def test_points_anywhere_give_numbers_or_a_named_error(seed):
    rng = np.random.default_rng(seed)
    camera = (CAMERA, FISHEYE, IN_AIR, BEHIND_ALL)[seed % 4]
    points = rng.uniform(0, 400, (3 + seed % 5, 2))
    try:
        ellipse, choice = find_poses(points, camera, (DOCK, Dock(0.3), Dock(0.3, 4), Dock(0.3, 8))[seed // 5 % 4])
    except NoEllipseError:
        return
    numbers = [*ellipse.conic, ellipse.rms_px]
    for pose in choice.candidates:
        numbers += [*pose.position_m, *pose.normal, *pose.sigma_position_m, *pose.sigma_theta_rad, pose.rms_px]
        numbers += [*pose.centre_px, pose.probability]
        assert pose.position_m[2] > 0
    assert np.isfinite(numbers).all()


@pytest.mark.parametrize("camera", [CAMERA, IN_AIR, BEHIND_ALL])
@pytest.mark.parametrize("position", [(0.1, -0.05, 0.45), (0.3, 0.1, 1.2)])
def test_of_a_whole_circle_one_pose_by_its_ellipse_alone_is_exact_behind_a_port_too(camera, position):
    points, normal = seen(camera, position, 0.3, -0.4, Dock(0.30, 40))
    poses = both_poses(points, camera, DOCK)[1]
    pose = max(poses, key=lambda pose: float(pose.normal @ normal))
    # What a port bends is no ellipse: in 3 cm of air before it by some 1e-4 of the range.
    np.testing.assert_allclose(pose.position_m, position, atol=1e-9 if camera.port is None else 2e-4)
    np.testing.assert_allclose(pose.normal, normal, atol=1e-9 if camera.port is None else 1e-3)
