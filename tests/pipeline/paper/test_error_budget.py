import msgspec
import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.port import FlatPort
from dockpose.paper import error_budget
from dockpose.paper.error_budget import CAMERA, VIEWS, calibrations, errors_of, poses_of_tables, rendered_calibration

TRUE = Camera(525, 525, 319.5, 239.5, 640, 480, (-0.18, 0.05, 0.0, 0.0, 0.0), FlatPort(0.03, 0.01))
PINHOLE = Camera(700, 700, 319.5, 239.5, 640, 480)


def test_corners_without_errors_give_the_camera_back():
    (found,) = calibrations(TRUE, 1, 0.0, seed=1)
    # Corners are stored in single precision, 3e-5 px.
    assert (found.fx, found.fy, found.cx, found.cy) == pytest.approx((525, 525, 319.5, 239.5), abs=1e-2)
    assert found.distortion == pytest.approx(TRUE.distortion, abs=1e-3)
    assert found.port == TRUE.port


@pytest.mark.slow
def test_the_same_seed_gives_the_same_digits_and_twice_the_corners_errors_scatter_twice_as_much():
    for _ in range(3):  # with threads, they would differ in one of two runs or so
        assert calibrations(TRUE, 8, 0.1, seed=3) == calibrations(TRUE, 8, 0.1, seed=3)
    assert calibrations(TRUE, 1, 0.1, seed=4) != calibrations(TRUE, 1, 0.1, seed=3)
    small, large = (np.std([camera.fx for camera in calibrations(TRUE, 20, px, seed=1)]) for px in (0.05, 0.1))
    assert large == pytest.approx(2 * small, rel=0.05)  # the same draws, and nearly linear


@pytest.mark.slow
def test_rendered_boards_are_found_and_calibrate_the_camera():
    done = rendered_calibration(TRUE, seed=2)
    assert sum(not view.dropped for view in done.views) >= VIEWS - 2
    assert done.error_px < 0.3
    assert done.camera.fx == pytest.approx(525, rel=0.005)


@pytest.fixture
def of_draws(monkeypatch):
    """Errors of so many draws a pose."""

    def errors(items, draws, believed=PINHOLE, camera=PINHOLE):
        monkeypatch.setattr(error_budget, "DRAWS", draws)
        return errors_of(items, [believed], 0.1, 1, camera)

    return errors


def test_what_is_known_exactly_brings_no_error(of_draws):
    np.testing.assert_allclose(of_draws((), 1), 0, atol=1e-5)
    # Behind a port the poses are computed in turn with the rays, to 1e-7 of the range and within a pixel's hundredth.
    np.testing.assert_allclose(of_draws((), 1, camera=CAMERA), 0, atol=1e-3)


def test_a_diameter_that_is_off_scales_the_position(of_draws):
    errors = of_draws(("diameter",), 30)
    measured = poses_of_tables()[0]
    # A diameter that is off by d of 300 mm scales x, y and z alike by d / 300, and leaves the angles.
    scales = errors[..., 2] / measured[:, 2]
    np.testing.assert_allclose(errors[..., :3], scales[..., None] * measured[:, :3], atol=1e-4)
    np.testing.assert_allclose(errors[..., 3:], 0, atol=1e-3)
    # d is 1 mm: 360 draws know it to 1 / sqrt(720), four per cent.
    assert np.sqrt((scales**2).mean()) == pytest.approx(1 / 300, rel=0.12)


def test_lights_that_are_off_across_the_ring_scale_it_and_along_it_turn_it(of_draws):
    across, along = (np.sqrt((of_draws((item,), 10) ** 2).mean(axis=(0, 1))) for item in ("across", "along"))
    measured = poses_of_tables()[0]
    # The mean radius of ten lights, each off by 1 mm: 1 / sqrt(10) of 150 mm is 0.2 % of the range. Along the ring
    # they hardly change its size.
    assert across[2] == pytest.approx(np.sqrt((measured[:, 2] ** 2).mean()) / 150 / np.sqrt(10.5), rel=0.35)
    assert along[2] < 0.7 * across[2]
    assert along.min() > 1e-3


def test_a_principal_point_that_is_off_turns_the_ray(of_draws):
    errors = of_draws(("intrinsics",), 1, believed=msgspec.structs.replace(PINHOLE, cx=PINHOLE.cx + 1))
    # One pixel to the left of 700: x falls by z / 700, to first order.
    np.testing.assert_allclose(errors[0, :, 0], -poses_of_tables()[0][:, 2] / 700, rtol=0.15)
