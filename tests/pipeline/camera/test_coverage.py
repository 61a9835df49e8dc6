import numpy as np
import pytest
from dockpose.camera.board import Sighting
from dockpose.camera.coverage import coverage_of
from dockpose.pose.circle import rotation_from_angles

from tests.support.boards import SIZE, TRUE, corners_m, sightings


def seen(towards_px, theta_x=0.0, theta_y=0.0, z=0.6):
    flat = corners_m()
    ray = TRUE.rays([towards_px])[0]
    middle = ray / ray[2] * z
    picture_px = TRUE.project((flat - flat.mean(axis=0)) @ rotation_from_angles(theta_x, theta_y).T + middle)
    return Sighting("", flat, picture_px)


def test_a_board_in_the_middle_leaves_the_corners_empty():
    covered = coverage_of([seen((320, 240)), seen((320, 240))], SIZE, TRUE.fx)
    assert covered.cells[1, 1] == 2
    assert covered.cells[0, 0] == 0
    assert "lower left" in covered.wanted[0]
    assert not covered.is_enough


def test_tilts_are_told_apart():
    # theta_y > 0 turns the dock's face, and the board's, to the left: its right edge comes nearer.
    covered = coverage_of([seen((320, 240), 0.0, 0.5), seen((320, 240), 0.5, 0.0)], SIZE, TRUE.fx)
    assert np.abs(covered.tilts_deg) == pytest.approx(np.degrees([[0.5, 0], [0, 0.5]]), abs=2)
    flat = corners_m() - corners_m().mean(axis=0)
    for (theta_x, theta_y), tilt in zip(((0, 0.5), (0.5, 0)), covered.tilts_deg, strict=True):
        deeper = flat @ rotation_from_angles(theta_x, theta_y)[2]
        axis = 0 if theta_y else 1
        far = np.sign(deeper @ flat[:, axis])  # whether the right, or the lower, edge is away from the camera
        assert np.sign(tilt[axis]) == far


def test_all_that_is_missing_is_named_and_nothing_where_all_is_there():
    assert [words for words in coverage_of([seen((320, 240))], SIZE).wanted if "nearer and farther" in words]
    many = coverage_of(sightings(TRUE, 0, count=60), SIZE, TRUE.fx)
    assert (many.is_enough, many.share) == (True, 1)
    nothing = coverage_of([], SIZE)
    assert (nothing.is_enough, nothing.share) == (False, 0)
