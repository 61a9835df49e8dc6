import math

import cv2
import numpy as np
import pytest
from dockpose import Dock
from dockpose.pose.circle import rotation_from_angles
from dockpose.pose.pnp import METHODS, NoPoseError, solve

from tests.support.scenes import CAMERA

DOCK = Dock(0.30, 12)
POSITION, NORMAL = np.array([0.1, -0.08, 1.1]), -rotation_from_angles(0.3, -0.45)[:, 2]


def seen(which, roll=1.9, noise_px=0.0, seed=0):
    points = CAMERA.project(POSITION + DOCK.light_points()[list(which)] @ rotation_from_angles(0.3, -0.45, roll).T)
    return points + np.random.default_rng(seed).normal(0, 1, points.shape) * noise_px


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("which", [range(12), (0, 1, 4, 7, 9), (11, 3, 6, 2)])
def test_every_method_finds_the_exact_pose(method, which):
    pose = solve(seen(which), list(which), CAMERA, DOCK, method)
    np.testing.assert_allclose(pose.position_m, POSITION, atol=2e-3)
    np.testing.assert_allclose(pose.normal, NORMAL, atol=2e-2)
    np.testing.assert_allclose(pose.centre_px, CAMERA.project([POSITION])[0], atol=0.5)


@pytest.mark.parametrize("method", METHODS)
def test_every_method_is_as_opencv_has_it(method):
    for seed in range(30):
        points = seen(range(12), roll=seed, noise_px=0.3, seed=seed)
        lights = DOCK.light_points()
        _, turn, shift = cv2.solvePnP(lights, points, CAMERA.matrix, None, flags=METHODS[method])  # type: ignore
        pose = solve(points, list(range(12)), CAMERA, DOCK, method)
        np.testing.assert_allclose(pose.position_m, shift.ravel(), atol=1e-4)
        np.testing.assert_allclose(-pose.normal, cv2.Rodrigues(turn)[0][:, 2], atol=1e-3)


@pytest.mark.parametrize(
    ("points", "lights", "message"),
    [
        ([[0, 0], [1, 0], [0, 1]], [0, 1, 2], "3 points"),
        ([[0, 0], [1, 0], [0, 1], [1, 1]], [0, 1, 2, 2], "all different"),
        ([[0, 0], [1, 0], [0, 1], [math.nan, 1]], [0, 1, 2, 3], "not finite"),
        ([[0, 0], [1, 0], [0, 1], [0, 1]], [0, 1, 2, 3], "two are the same"),
    ],
)
@pytest.mark.parametrize("method", METHODS)
def test_lights_that_tell_no_pose_are_named(points, lights, message, method):
    with pytest.raises(NoPoseError, match=message):
        solve(points, lights, CAMERA, DOCK, method)


@pytest.mark.parametrize("method", METHODS)
def test_lights_in_a_row_never_give_nan(method):
    points = [[10 * i, 20 * i] for i in range(6)]
    try:
        pose = solve(points, range(6), CAMERA, DOCK, method)
    except NoPoseError:
        return
    assert np.isfinite([*pose.position_m, *pose.normal]).all()


def test_an_unknown_method_is_named():
    with pytest.raises(ValueError, match="'magic'"):
        solve(seen(range(12)), range(12), CAMERA, Dock(0.3, 12), "magic")
