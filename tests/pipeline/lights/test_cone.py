import numpy as np
import pytest
from dockpose.lights.cone import circles_behind
from dockpose.lights.ellipse import NoEllipseError, fit_ellipse

FOCAL_PX, CENTRE_PX, RADIUS = (800.0, 900.0), (310.0, 250.0), 0.4


def picture_of(normal, centre, radius=RADIUS, count=40):
    """Points (count, 2) of a circle's rim, of a camera with unlike focal lengths."""
    right = np.cross(normal, [0, 1.0, 0])
    right /= np.linalg.norm(right)
    down = np.cross(normal, right)
    at = 2 * np.pi * np.arange(count)[:, None] / count
    rim = centre + radius * (np.cos(at) * right + np.sin(at) * down)
    return rim[:, :2] / rim[:, 2:] * FOCAL_PX + CENTRE_PX


@pytest.mark.parametrize("centre", [(0.2, -0.1, 3.0), (-0.5, 0.4, 2.0), (0.0, 0.0, 5.0), (1.5, 0.2, 3.0)])
@pytest.mark.parametrize("tilt", [(0.5, 0.2), (-0.4, 0.3), (0.1, -0.7)])
def test_of_both_circles_one_is_the_truth_and_both_have_this_picture(tilt, centre):
    normal = np.array([*tilt, -np.sqrt(1 - tilt[0] ** 2 - tilt[1] ** 2)])
    picture = picture_of(normal, np.array(centre))
    circles = circles_behind(fit_ellipse(picture).conic, FOCAL_PX, CENTRE_PX, RADIUS)
    off = [max(np.abs(one - normal).max(), np.abs(there - centre).max()) for one, there in circles]
    assert min(off) < 1e-5 < 0.1 < max(off)
    assert circles[0, 0, 0] <= circles[1, 0, 0]
    for one, there in circles:
        assert np.linalg.norm(one) == pytest.approx(1)
        assert there[2] > 0
        assert one @ there < 0  # it faces the camera
        np.testing.assert_allclose(fit_ellipse(picture_of(one, there)).conic, fit_ellipse(picture).conic, atol=1e-7)


def test_a_circle_square_on_has_one_pose_at_the_range_of_its_size():
    # A radius of 40 px at a focal length of 800: twenty radii away.
    conic = np.array([1, 0, 1, 0, 0, -(40.0**2)])
    circles = circles_behind(conic, (800.0, 800.0), (0.0, 0.0), 0.5)
    np.testing.assert_allclose(circles[:, 0], [[0, 0, -1]] * 2, atol=1e-6)
    np.testing.assert_allclose(circles[:, 1], [[0, 0, 10]] * 2, atol=1e-5)


def test_no_circle_has_a_picture_that_is_no_ellipse():
    with pytest.raises(NoEllipseError, match="too small, or too narrow"):
        circles_behind(np.array([1, 0, 1, 0, 0, 25.0]), (800.0, 800.0), (0.0, 0.0), 0.5)
