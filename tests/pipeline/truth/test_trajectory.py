"""Covariances and angles of the five degrees of freedom, and placements as plain values."""

import math

import numpy as np
import pytest
from dockpose.estimate import estimate
from dockpose.pose.circle import angles_of, rotation_from_angles
from dockpose.truth.trajectory import Placement, angle_slopes, angles, five_of


def test_the_five_errors_of_a_pose_are_those_that_it_says_itself():
    pose = estimate("tilted").candidates[0]
    assert pose.covariance is not None
    assert pose.sigma_position_m is not None
    assert pose.sigma_theta_rad is not None
    five = five_of(pose.covariance[None], pose.normal[None])[0]
    assert np.sqrt(np.diag(five)) == pytest.approx([*pose.sigma_position_m, *pose.sigma_theta_rad], rel=1e-6)


def test_a_roll_that_nothing_shows_moves_no_angle():
    normal = -rotation_from_angles(0.3, -0.5)[:, 2]
    covariance = np.zeros((6, 6))
    covariance[3:, 3:] = np.outer(normal, normal)
    assert five_of(covariance[None], normal[None]) == pytest.approx(np.zeros((1, 5, 5)), abs=1e-15)


def test_angles_and_their_slopes_are_those_of_the_convention():
    normals = np.array([-rotation_from_angles(x, y)[:, 2] for x, y in ((0.2, 0.1), (-0.7, 0.9), (0.0, -1.2))])
    assert angles(normals) == pytest.approx(np.array([angles_of(normal) for normal in normals]))
    moved = 1e-6 * np.array([0.3, -0.2, 0.5])
    tangent = moved - (normals @ moved)[:, None] * normals
    moved_angles = np.array([angles_of(normal / np.linalg.norm(normal)) for normal in normals + tangent])
    assert angles(normals) + (angle_slopes(normals) @ tangent[:, :, None])[:, :, 0] == pytest.approx(
        moved_angles, abs=1e-11
    )


def test_a_placement_says_null_for_what_is_not_known():
    told = Placement((1, 2, 3), angle_sigma_deg=np.array([0.1, math.nan, 0.2])).to_dict()
    assert told == {
        "position_m": [1.0, 2.0, 3.0],
        "quaternion_xyzw": None,
        "position_sigma_m": None,
        "angle_sigma_deg": [0.1, None, 0.2],
    }
