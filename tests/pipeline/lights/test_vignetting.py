import numpy as np
import pytest
from dockpose.lights.vignetting import undo_slopes

UNKNOWN = 0.3**2  # variance of what a lens takes off the corners, before anything is seen


def lights(places, seen_slopes, variance, radii, moves):
    """What is known of lights: their slopes (N, 2) with this variance each, and by how much a slope moves a centre."""
    count = len(places)
    slopes = np.zeros((count, 2, 5))
    slopes[:, :, 0] = seen_slopes
    slopes[:, 0, 1] = slopes[:, 1, 2] = variance
    slopes[:, 0, 3] = slopes[:, 1, 4] = moves
    return np.zeros((count, 2)), np.full((count, 2, 2), 0.01) * np.eye(2), slopes, np.full(count, radii)


def test_well_known_slopes_of_a_dark_corner_move_centres_outwards_by_what_they_tell():
    # 1 - v r^2 has the slope -2 v x along x; v = .4 is seen, and slopes move centres by five pixels each.
    off = np.array([[0.1, 0.0], [-0.1, 0.05], [0.0, -0.2]])
    centres, covariances, slopes, radii = lights(off, -2 * 0.4 * off, 1e-8, 3.0, 5.0)
    undo_slopes(centres, covariances, slopes, radii, off)
    np.testing.assert_allclose(centres, 5 * -2 * 0.4 * off, rtol=1e-3)
    # What is not known of v is next to nothing.
    np.testing.assert_allclose(covariances, np.full((3, 2, 2), 0.01) * np.eye(2), atol=1e-6)


def test_slopes_that_are_not_known_leave_centres_and_widen_their_covariances_along_the_radius():
    off = np.array([[0.1, 0.2]])
    centres, covariances, slopes, radii = lights(off, [[-0.08, -0.16]], 1e6, 3.0, 5.0)
    undo_slopes(centres, covariances, slopes, radii, off)
    np.testing.assert_allclose(centres, 0, atol=1e-5)
    along = 5 * -2 * off[0]
    np.testing.assert_allclose(covariances[0], 0.01 * np.eye(2) + UNKNOWN * np.outer(along, along), rtol=1e-4)


def test_what_is_seen_is_weighed_against_what_is_expected_by_its_variances():
    # Correlated slopes of one light: g = -2 off v, so that the weight of v is 4 off' C^-1 off.
    off = np.array([[0.1, -0.2]])
    covariance = np.array([[0.02, 0.005], [0.005, 0.03]])
    centres, covariances, slopes, radii = lights(off, [[-0.05, 0.2]], 0.0, 3.0, 1.0)
    slopes[0, :, 1:3] = covariance
    x = -2 * off[0]
    information = 1 / UNKNOWN + x @ np.linalg.solve(covariance, x)
    v = x @ np.linalg.solve(covariance, [-0.05, 0.2]) / information
    undo_slopes(centres, covariances, slopes, radii, off)
    np.testing.assert_allclose(centres[0], v * x, rtol=1e-9)
    np.testing.assert_allclose(covariances[0], 0.01 * np.eye(2) + np.outer(x, x) / information, rtol=1e-9)


def test_brighter_corners_are_no_lens_and_white_or_unknown_lights_tell_nothing():
    off = np.array([[0.1, 0.0], [0.2, 0.1]])
    centres, covariances, slopes, radii = lights(off, 0.8 * off, 1e-8, 3.0, 5.0)
    undo_slopes(centres, covariances, slopes, radii, off)
    np.testing.assert_array_equal(centres, 0)
    centres, covariances, slopes, radii = lights(off, -0.8 * off, 1e-8, 0.0, 5.0)
    slopes[1, 0, 0] = np.nan
    undo_slopes(centres, covariances, slopes, radii, off)
    np.testing.assert_array_equal(centres, 0)
    assert covariances[0, 0, 0] == pytest.approx(0.01 + UNKNOWN * (5 * 2 * 0.1) ** 2)
    np.testing.assert_array_equal(covariances[1], 0.01 * np.eye(2))


@pytest.mark.parametrize(("radius_px", "is_moved"), [(5.0, False), (5.1, True)])
def test_a_large_light_has_a_slope_of_its_own_beyond_what_noise_makes(radius_px, is_moved):
    # Of a second light, far off the lens's middle, it is known that the lens takes nothing off.
    off = np.array([[0.0, 0.0], [10.0, 10.0]])
    centres, covariances, slopes, radii = lights(off, [[0.3, 0.0], [0.0, 0.0]], 1e-6, radius_px, 2.0)
    undo_slopes(centres, covariances, slopes, radii, off)
    assert (abs(centres[0, 0]) > 0.5) == is_moved
    assert centres[0, 1] == pytest.approx(0, abs=1e-6)
