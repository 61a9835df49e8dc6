import importlib.util
import math
import sys
import types
from pathlib import Path

import numpy as np
import pytest
from dockpose import Camera
from dockpose.lights.ellipse import ellipse_from_conic, fit_ellipse
from dockpose.pose.circle import CirclePose, circle_poses, rotation_from_angles
from scipy.spatial.transform import Rotation

CAMERA = Camera(700, 690, 310, 250, 640, 480)


def circle(position_m, rotation, radius_m, count=12):
    t = 2 * np.pi * np.arange(count) / count
    return position_m + radius_m * np.column_stack([np.cos(t), np.sin(t), 0 * t]) @ rotation.T


def drawn_circles(count):
    """Circles in front of the camera that it does not see edge-on, and not exactly square on."""
    rng = np.random.default_rng(7)
    while count:
        theta_x, theta_y = rng.uniform(-1.2, 1.2, 2)
        z = rng.uniform(0.4, 20)
        position = np.array([rng.uniform(-0.4, 0.4) * z, rng.uniform(-0.3, 0.3) * z, z])
        rotation, radius_m = rotation_from_angles(theta_x, theta_y), rng.uniform(0.02, 0.15)
        facing = rotation[:, 2] @ position / np.linalg.norm(position)
        if 0.1 < facing < 0.9995:
            count -= 1
            yield position, rotation, radius_m


def test_200_circles_are_given_back_and_their_twins_see_the_same_ellipse():
    for position, rotation, radius_m in drawn_circles(200):
        ellipse = fit_ellipse(CAMERA.project(circle(position, rotation, radius_m)))
        poses = circle_poses(ellipse, CAMERA, 2 * radius_m)
        errors = [np.abs(pose.normal + rotation[:, 2]).max() for pose in poses]
        right, wrong = poses if errors[0] < errors[1] else poses[::-1]
        np.testing.assert_allclose(right.position_m, position, rtol=1e-6, atol=1e-6)
        np.testing.assert_allclose(right.normal, -rotation[:, 2], atol=1e-6)
        np.testing.assert_allclose(right.centre_px, CAMERA.project(position[None])[0], atol=1e-6)
        twin = rotation_from_angles(wrong.theta_x_rad, wrong.theta_y_rad)
        assert ellipse.distances(CAMERA.project(circle(wrong.position_m, twin, radius_m))).max() < 1e-6
        assert np.linalg.norm(right.position_m - wrong.position_m) > 1e-4 * radius_m
        assert np.linalg.norm(right.normal - wrong.normal) > 1e-3


def test_a_dock_square_on_the_axis_by_hand():
    # A circle of radius 0.15 m, 1.5 m ahead on the axis, is a circle of 700 * 0.1 = 70 px.
    camera = Camera(700, 700, 320, 240, 640, 480)
    ellipse = ellipse_from_conic([1, 0, 1, -640, -480, 320**2 + 240**2 - 70**2])
    for pose in circle_poses(ellipse, camera, 0.30):
        np.testing.assert_allclose(pose.position_m, [0, 0, 1.5], atol=1e-6)
        np.testing.assert_allclose(pose.normal, [0, 0, -1], atol=1e-6)
        np.testing.assert_allclose(pose.centre_px, [320, 240], atol=1e-6)


@pytest.mark.extra
@pytest.mark.parametrize("seed", range(30))
def test_both_poses_agree_with_pycalib(seed):
    solve = pycalib_circle().solve_circle_3d
    camera = Camera(700, 700, 310, 250, 640, 480)  # pycalib takes one focal length
    rng = np.random.default_rng(seed)
    position = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(0.7, 3)])
    rotation = rotation_from_angles(*rng.uniform(-0.7, 0.7, 2))
    ellipse = fit_ellipse(camera.project(circle(position, rotation, 0.15)))
    ours = circle_poses(ellipse, camera, 0.30)
    # As cv2.fitEllipse gives it: the second axis lies 90 degrees on from the angle.
    major, minor = ellipse.semi_axes_px
    as_opencv = (ellipse.centre_px, (2 * minor, 2 * major), math.degrees(ellipse.angle_rad) - 90)
    centres, normals = solve(camera.matrix, as_opencv, radius=0.15)
    for pose in ours:
        differences = [
            np.abs(pose.position_m - centre).max() + min(np.abs(pose.normal - n).max(), np.abs(pose.normal + n).max())
            for centre, n in zip(map(np.ravel, centres), map(np.ravel, normals), strict=True)
        ]
        assert min(differences) < 1e-6


def pycalib_circle():
    """The one module of pycalib that is needed; its package's __init__ would want plotting and tables as well."""
    package = importlib.util.find_spec("pycalib")
    if package is None or package.origin is None:
        pytest.fail("pycalib-simple is not installed; it takes pip install --no-deps")
    path = Path(package.origin).parent / "circle.py"
    spec = importlib.util.spec_from_file_location("pycalib_circle", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    stand_in = sys.modules.setdefault("pycalib", types.ModuleType("pycalib"))
    try:
        spec.loader.exec_module(module)
    finally:
        if sys.modules.get("pycalib") is stand_in:
            del sys.modules["pycalib"]
    return module


def test_angles_and_normal_are_inverses_by_the_conventions():
    # n = (-cos tx sin ty, sin tx, -cos tx cos ty)
    tx, ty = math.radians(20), math.radians(-35)
    rotation = rotation_from_angles(tx, ty)
    expected = [-math.cos(tx) * math.sin(ty), math.sin(tx), -math.cos(tx) * math.cos(ty)]
    np.testing.assert_allclose(-rotation[:, 2], expected)
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    position = np.array([0.1, 0.05, 1.0])
    poses = circle_poses(fit_ellipse(CAMERA.project(circle(position, rotation, 0.15))), CAMERA, 0.3)
    angles = [(pose.theta_x_rad, pose.theta_y_rad) for pose in poses]
    assert any(pair == pytest.approx((tx, ty), abs=1e-6) for pair in angles)
    for pose in poses:
        np.testing.assert_allclose(pose.T_camera_dock[:3, 3], pose.position_m)
        np.testing.assert_allclose(-pose.T_camera_dock[:3, 2], pose.normal, atol=1e-9)


def test_a_dock_twice_as_large_is_twice_as_far():
    ellipse = fit_ellipse(CAMERA.project(circle(np.array([0.1, 0, 1]), rotation_from_angles(0.2, 0.3), 0.1)))
    for small, large in zip(circle_poses(ellipse, CAMERA, 0.2), circle_poses(ellipse, CAMERA, 0.4), strict=True):
        np.testing.assert_allclose(2 * small.position_m, large.position_m)
        np.testing.assert_allclose(small.normal, large.normal)


@pytest.mark.parametrize("diameter", [0, -0.3, math.nan, math.inf])
def test_a_diameter_that_is_none_is_named(diameter):
    ellipse = ellipse_from_conic([1, 0, 1, -640, -480, 320**2 + 240**2 - 70**2])
    with pytest.raises(ValueError, match="diameter"):
        circle_poses(ellipse, CAMERA, diameter)


def test_the_quaternion_is_the_turn_by_pitch_and_then_by_yaw():
    normal = -rotation_from_angles(0.4, -0.9)[:, 2]
    pose = CirclePose.at(np.array([0.0, 0.0, 2.0]), normal, CAMERA)
    expected = Rotation.from_euler("YX", [-0.9, 0.4]).as_quat()
    np.testing.assert_allclose(pose.quaternion_xyzw, expected, atol=1e-12)
