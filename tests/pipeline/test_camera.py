import math

import cv2
import numpy as np
import pytest

from pipeline import Camera

PINHOLE = Camera(700, 690, 320, 240, 640, 480)
BARREL = Camera(700, 690, 310, 250, 640, 480, (-0.30, 0.10, 0.001, -0.002, 0.01))
RATIONAL = Camera(700, 690, 310, 250, 640, 480, (-0.2, 0.1, 0.001, -0.002, 0.01, 0.05, 0.02, 0.001))


def whole_picture(camera: Camera) -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0, camera.width - 1, 33), np.linspace(0, camera.height - 1, 25))
    return np.column_stack([x.ravel(), y.ravel()])


def test_pinhole_projects_by_hand():
    np.testing.assert_allclose(PINHOLE.project([[0.1, -0.2, 2.0]]), [[320 + 35, 240 - 69]])


def test_ray_through_the_principal_point_is_the_axis():
    np.testing.assert_allclose(PINHOLE.rays([[320, 240]]), [[0, 0, 1]])


@pytest.mark.parametrize("camera", [PINHOLE, BARREL, RATIONAL])
def test_rays_and_project_are_inverses_over_the_whole_picture(camera):
    pixels = whole_picture(camera)
    np.testing.assert_allclose(camera.project(3 * camera.rays(pixels)), pixels, atol=1e-6)
    np.testing.assert_allclose(camera.distort(camera.undistort(pixels)), pixels, atol=1e-6)


def test_barrel_distortion_moves_the_corner_inwards_as_the_polynomial_says():
    camera = Camera(500, 500, 0, 0, 640, 480, (-0.1, 0, 0, 0))
    x, y = 0.6, 0.4
    factor = 1 - 0.1 * (x * x + y * y)
    np.testing.assert_allclose(camera.project([[x, y, 1]]), [[500 * x * factor, 500 * y * factor]])


def test_points_behind_the_camera_have_no_image():
    image = PINHOLE.project([[0, 0, 1], [0, 0, -1], [0.1, 0, 0]])
    assert np.isfinite(image).all(axis=1).tolist() == [True, False, False]


def test_no_points_are_no_fault():
    assert PINHOLE.project(np.empty((0, 3))).shape == (0, 2)
    assert BARREL.undistort(np.empty((0, 2))).shape == (0, 2)


def test_field_of_view_by_hand():
    camera = Camera(320, 240, 319.5, 239.5, 640, 480)
    assert camera.field_of_view_rad == pytest.approx((math.pi / 2, math.pi / 2))


def test_a_rescaled_picture_scales_the_intrinsics_about_pixel_corners():
    half = PINHOLE.for_size(320, 240)
    assert (half.fx, half.fy, half.cx, half.cy) == (350, 345, 159.75, 119.75)
    assert PINHOLE.for_size(640, 480) is PINHOLE


def test_rescaled_intrinsics_agree_with_a_picture_that_opencv_shrank():
    picture = np.zeros((480, 640), np.uint8)
    picture[100:104, 200:204] = 255  # centre (201.5, 101.5)
    small = cv2.resize(picture, (160, 120), interpolation=cv2.INTER_AREA)
    (y,), (x,) = np.nonzero(small)
    ray = PINHOLE.rays([[201.5, 101.5]])
    np.testing.assert_allclose(PINHOLE.for_size(160, 120).project(ray), [[x, y]], atol=1e-9)


def test_a_cropped_picture_is_refused_by_its_size():
    with pytest.raises(ValueError, match=r"640 x 400 .* 640 x 480"):
        PINHOLE.for_size(640, 400)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"fx": 0}, "fx is 0"),
        ({"fy": -1.0}, "fy is -1.0"),
        ({"cx": math.nan}, "cx is nan"),
        ({"cy": math.inf}, "cy is inf"),
        ({"fx": "700"}, "fx is '700'"),
        ({"width": 0}, "width is 0"),
        ({"height": 480.5}, "height is 480.5"),
        ({"distortion": (0.1, 0.2, 0.3)}, "distortion has 3 coefficients"),
        ({"distortion": (0.1, math.nan, 0, 0)}, r"distortion\[1\] is nan"),
    ],
)
def test_bad_values_are_named(change, message):
    good = {"fx": 700, "fy": 700, "cx": 320, "cy": 240, "width": 640, "height": 480}
    with pytest.raises(ValueError, match=message):
        Camera(**(good | change))


def test_points_of_a_wrong_shape_are_named():
    with pytest.raises(ValueError, match=r"points_m has shape \(3,\)"):
        PINHOLE.project([1, 2, 3])
