import math

import msgspec
import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.image import turned
from dockpose.camera.port import FlatPort

PINHOLE = Camera(700, 690, 320, 240, 640, 480)
BARREL = Camera(700, 690, 310, 250, 640, 480, (-0.30, 0.10, 0.001, -0.002, 0.01))
STRONG_BARREL = Camera(300, 300, 310, 250, 640, 480, (-0.30, 0.09, 0.002, -0.003, -0.008))
STRONG_PINCUSHION = Camera(400, 400, 310, 250, 640, 480, (0.6, 0.9, 0.002, -0.003, 0.5))
STRONG_RATIONAL = Camera(300, 300, 310, 250, 640, 480, (8.0, 3.0, 0.0005, -0.0003, 0.1, 8.3, 5.0, 0.6))
FISHEYE = Camera(300, 305, 310, 250, 640, 480, (-0.02, 0.005, -0.001, 0.0002), fisheye=True)
BEHIND_ITSELF = Camera(170, 170, 310, 250, 640, 480, fisheye=True)  # sees 108 degrees off its axis
RATIONAL = Camera(700, 690, 310, 250, 640, 480, (-0.2, 0.1, 0.001, -0.002, 0.01, 0.05, 0.02, 0.001))


def whole_picture(camera: Camera) -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0, camera.width - 1, 33), np.linspace(0, camera.height - 1, 25))
    return np.column_stack([x.ravel(), y.ravel()])


def test_pinhole_projects_by_hand():
    np.testing.assert_allclose(PINHOLE.project([[0.1, -0.2, 2.0]]), [[320 + 35, 240 - 69]])
    np.testing.assert_allclose(PINHOLE.rays([[320, 240]]), [[0, 0, 1]])


@pytest.mark.parametrize(
    "camera", [PINHOLE, BARREL, RATIONAL, STRONG_BARREL, STRONG_PINCUSHION, STRONG_RATIONAL, FISHEYE, BEHIND_ITSELF]
)
def test_rays_and_project_are_inverses_over_the_whole_picture(camera):
    pixels = whole_picture(camera)
    np.testing.assert_allclose(camera.project(3 * camera.rays(pixels)), pixels, atol=1e-6)
    if camera is not BEHIND_ITSELF:
        np.testing.assert_allclose(camera.distort(camera.undistort(pixels)), pixels, atol=1e-6)


@pytest.mark.parametrize(
    ("camera", "distance_m"),
    [*((BARREL, distance_m) for distance_m in (0.1, 0.5, 3.0, 20.0)), (STRONG_BARREL, 2.0), (FISHEYE, 2.0)],
)
def test_rays_and_project_are_inverses_through_a_window_too(camera, distance_m):
    wet = msgspec.structs.replace(camera, port=FlatPort(0.03, 0.01))
    pixels = whole_picture(wet)
    points = wet.ray_starts(pixels) + distance_m * wet.rays(pixels)
    np.testing.assert_allclose(wet.project(points), pixels, atol=1e-6)


def test_an_equidistant_lens_by_hand():
    camera = Camera(200, 200, 320, 240, 640, 480, fisheye=True)
    # 90 degrees off the axis lies 200 pi / 2 px from the principal point.
    np.testing.assert_allclose(
        camera.project([[1, 0, 0], [0, 1, 1]]), [[320 + 100 * np.pi, 240], [320, 240 + 50 * np.pi]]
    )
    assert camera.field_of_view_rad == pytest.approx((640 / 200, 480 / 200))


def test_a_fisheye_has_no_image_where_its_polynomial_falls_again():
    camera = Camera(200, 200, 320, 240, 640, 480, (-0.3, 0, 0, 0), fisheye=True)
    # theta - 0.3 theta^3 grows up to theta = 1 / sqrt(0.9) = 60.4 degrees.
    angles = np.radians([60, 61])
    image = camera.project(np.column_stack([np.sin(angles), 0 * angles, np.cos(angles)]))
    assert np.isfinite(image).all(axis=1).tolist() == [True, False]


def test_pixels_outside_a_lens_are_still_numbers():
    camera = Camera(300, 300, 320, 240, 640, 480, (-0.4, 0, 0, 0))  # reaches 0.61 focal lengths, the corner 1.3
    assert np.isfinite(camera.undistort(whole_picture(camera))).all()
    assert np.isfinite(BEHIND_ITSELF.undistort(whole_picture(BEHIND_ITSELF))).all()


@pytest.mark.parametrize("depth_m", [0.5, 1.0, 10.0])
def test_virtual_pixels_are_what_a_pinhole_in_the_water_would_see(depth_m):
    wet = msgspec.structs.replace(BARREL, port=FlatPort(0.03, 0.01))
    points = np.array([[0.1, 0.2, 1.0], [-0.3, 0.05, 1.0], [0.0, 0.0, 1.0]]) * depth_m
    virtual = wet.virtual_pixels(wet.project(points), depth_m)
    np.testing.assert_allclose(virtual, msgspec.structs.replace(BARREL, distortion=()).project(points), atol=1e-6)


def test_picture_slopes_tell_how_far_the_picture_moves():
    wet = Camera(700, 690, 310, 250, 640, 480, port=FlatPort(0.0, 0.0))
    # On the axis a pinhole sees an angle in water that the camera sees 1.333 times as large.
    np.testing.assert_allclose(wet.picture_slopes([[310, 250]], 1.0)[0], 1.333 * np.eye(2), atol=1e-6)
    np.testing.assert_allclose(PINHOLE.picture_slopes([[3, 4]], 1.0)[0], np.eye(2))
    moved = BARREL.virtual_pixels([[600, 100], [600.5, 100.2]], 1.0)
    slope = BARREL.picture_slopes([[600.25, 100.1]], 1.0)[0]
    np.testing.assert_allclose(slope @ (moved[1] - moved[0]), [0.5, 0.2], atol=1e-5)


def test_points_behind_the_camera_have_no_image_and_no_points_are_no_fault():
    image = PINHOLE.project([[0, 0, 1], [0, 0, -1], [0.1, 0, 0]])
    assert np.isfinite(image).all(axis=1).tolist() == [True, False, False]
    assert PINHOLE.project(np.empty((0, 3))).shape == (0, 2)
    assert BARREL.undistort(np.empty((0, 2))).shape == (0, 2)


def test_a_rescaled_picture_scales_the_intrinsics_about_pixel_corners():
    half = PINHOLE.for_size(320, 240)
    assert (half.fx, half.fy, half.cx, half.cy) == (350, 345, 159.75, 119.75)
    assert PINHOLE.for_size(640, 480) is PINHOLE
    with pytest.raises(ValueError, match=r"640 x 400 .* 640 x 480"):  # a crop
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
        (
            {"distortion": (0.1, 0.2, 0.3, 0.4, 0.5), "fisheye": True},
            "distortion has 5 coefficients; it must have 0 or 4",
        ),
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


def with_prism(*tilt: float) -> Camera:
    """A lens with a thin prism, before a sensor that may be tilted."""
    bent = (-0.2, 0.05, 0.001, -0.002, 0.0, 0.0, 0.0, 0.0, 0.003, -0.001, 0.002, 0.0005)
    return msgspec.structs.replace(BARREL, distortion=(*bent, *tilt))


TURNED_BY_RULE = {  # where a pixel of a 640 x 480 picture goes
    0: lambda x, y: (x, y),
    90: lambda x, y: (479 - y, x),
    180: lambda x, y: (639 - x, 479 - y),
    270: lambda x, y: (y, 639 - x),
}


@pytest.mark.parametrize("degrees", TURNED_BY_RULE)
@pytest.mark.parametrize(
    "camera",
    [
        msgspec.structs.replace(BARREL, distortion=BARREL.distortion[:4]),
        RATIONAL,
        FISHEYE,
        msgspec.structs.replace(BARREL, port=FlatPort(0.02, 0.01)),
        msgspec.structs.replace(FISHEYE, port=FlatPort(0.02, 0.01)),
        with_prism(),
        with_prism(0.02, 0.0),
        with_prism(0.0, -0.03),
    ],
)
def test_the_turned_camera_sees_the_turned_point_where_the_turned_picture_has_it(camera, degrees):
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-0.5, 0.5, (50, 2)), rng.uniform(1, 3, 50)])
    wanted = np.column_stack(TURNED_BY_RULE[degrees](*camera.project(points).T))
    angle = math.radians(degrees)
    about_axis = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    turned = camera.rotated(degrees)
    np.testing.assert_allclose(turned.project(points @ about_axis.T), wanted, atol=1e-9)
    np.testing.assert_allclose(turned.rays(wanted), camera.rays(camera.project(points)) @ about_axis.T, atol=1e-9)
    assert (turned.width, turned.height) == ((480, 640) if degrees % 180 else (640, 480))


def test_a_sensor_that_is_tilted_both_ways_turns_by_180_alone():
    camera = with_prism(0.02, -0.03)
    x, y = camera.project([[0.3, -0.2, 2.0]])[0]
    np.testing.assert_allclose(camera.rotated(180).project([[-0.3, 0.2, 2.0]]), [[639 - x, 479 - y]], atol=1e-9)
    for degrees in (90, 270):
        with pytest.raises(ValueError, match="turns by 180 alone"):
            camera.rotated(degrees)


def test_a_turn_goes_on_and_a_picture_turns_by_the_same_rule():
    picture = np.arange(480 * 640, dtype=np.int32).reshape(480, 640)
    for degrees, rule in TURNED_BY_RULE.items():
        x, y = rule(5, 7)
        assert turned(picture, degrees)[y, x] == picture[7, 5]
    assert BARREL.rotated(90).rotated(270) == BARREL
    assert BARREL.rotated(90).rotated(90) == BARREL.rotated(180)


@pytest.mark.parametrize("degrees", [45, -90, 360, 90.0, "90", None, True])
def test_other_turns_are_refused(degrees):
    with pytest.raises(ValueError, match=rf"degrees is {degrees!r}; it must be 0, 90, 180 or 270"):
        BARREL.rotated(degrees)


def test_a_port_of_another_kind_is_refused():
    with pytest.raises(ValueError, match=r"port is 0\.02; it must be a FlatPort"):
        msgspec.structs.replace(BARREL, port=0.02)
