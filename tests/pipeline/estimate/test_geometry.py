from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from dockpose import Camera, Dock
from dockpose.estimate.geometry import outside, pose_lines
from dockpose.pose.circle import CirclePose

LINE = np.array([[0.0, 0.0], [10.0, 0.0]])


def pieces(points, *circles):
    centres = np.array([circle[:2] for circle in circles]).reshape(-1, 2)
    found = outside(np.asarray(points, dtype=float), centres, np.array([circle[2] for circle in circles]))
    return [piece.round(6).tolist() for piece in found]


def test_a_line_stops_at_a_circle_and_goes_on_behind_it():
    assert pieces(LINE, (5, 0, 2)) == [[[0, 0], [3, 0]], [[7, 0], [10, 0]]]
    assert pieces(LINE, (5, 3, 5)) == [[[0, 0], [1, 0]], [[9, 0], [10, 0]]]  # 3, 4, 5


def test_a_line_beside_all_circles_or_touching_one_stays_whole():
    assert pieces(LINE) == [[[0, 0], [10, 0]]]
    assert pieces(LINE, (5, 2, 2), (20, 0, 3), (-4, 0, 3)) == [[[0, 0], [10, 0]]]


def test_circles_that_overlap_leave_one_gap_and_one_over_all_of_it_leaves_nothing():
    assert pieces(LINE, (4, 0, 2), (6, 0, 2)) == [[[0, 0], [2, 0]], [[8, 0], [10, 0]]]
    assert pieces(LINE, (5, 0, 6)) == []


def test_a_line_with_corners_is_one_piece_up_to_the_circle():
    corners = [[0, 0], [10, 0], [10, 10], [0, 10]]
    assert pieces(corners, (10, 5, 1)) == [[[0, 0], [10, 0], [10, 4]], [[10, 6], [10, 10], [0, 10]]]
    assert pieces(corners, (10, 0, 2)) == [[[0, 0], [8, 0]], [[10, 2], [10, 10], [0, 10]]]


@pytest.mark.parametrize("gone", [[np.nan, 0], [np.inf, 0]])
def test_what_is_behind_the_camera_is_not_drawn(gone):
    assert pieces([[0, 0], [1, 0], gone, [3, 0], [4, 0]], (100, 100, 1)) == [[[0, 0], [1, 0]], [[3, 0], [4, 0]]]


def test_a_poses_lines_are_its_circle_two_diameters_and_its_normal():
    """Square on in the middle, at 1 m: the normal comes towards the camera, and is seen as a point."""
    camera, dock = Camera(700.0, 700.0, 320.0, 240.0, 641, 481), Dock(0.30, 10)
    for tilt_rad in (0.0, 0.4):
        normal = np.array([-np.sin(tilt_rad), 0.0, -np.cos(tilt_rad)])
        pose = CirclePose.at(np.array([0.0, 0.0, 1.0]), normal, camera)
        stages: Any = SimpleNamespace(camera=camera, dock=dock)
        circle, (one, other), (start, end) = pose_lines(pose, stages)
        ends_m = 0.15 * np.array([np.cos(tilt_rad), 0, -np.sin(tilt_rad)])
        on_x = [camera.project([[0, 0, 1] + side * ends_m])[0] for side in (-1, 1)]
        np.testing.assert_allclose(np.sort(one[:, 0]), np.sort([u for u, _ in on_x]), atol=1e-9)
        np.testing.assert_allclose(np.sort(other[:, 1]), [240 - 105, 240 + 105], atol=1e-9)
        np.testing.assert_allclose(circle.min(axis=0)[1], 240 - 105, atol=0.2)
        np.testing.assert_allclose(start, [320, 240], atol=1e-9)
        towards = camera.project([np.array([0.0, 0.0, 1.0]) + 0.05 * normal])[0] - start
        assert np.sign(np.round(end - start, 9)).tolist() == np.sign(np.round(towards, 9)).tolist()
