import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.port import FlatPort
from dockpose.paper.tank.calibrations import VIEWS, calibrations, rendered_calibration

TRUE = Camera(525, 525, 319.5, 239.5, 640, 480, (-0.18, 0.05, 0.0, 0.0, 0.0), FlatPort(0.03, 0.01))


def test_corners_without_errors_give_the_camera_back():
    (found,) = calibrations(TRUE, 1, 0.0, seed=1)
    # Corners are stored in single precision, 3e-5 px.
    assert (found.fx, found.fy, found.cx, found.cy) == pytest.approx((525, 525, 319.5, 239.5), abs=1e-2)
    assert found.distortion == pytest.approx(TRUE.distortion, abs=1e-3)
    assert found.port == TRUE.port


@pytest.mark.slow
def test_the_same_seed_gives_the_same_digits():
    for _ in range(3):  # with threads, they would differ in one of two runs or so
        assert calibrations(TRUE, 8, 0.1, seed=3) == calibrations(TRUE, 8, 0.1, seed=3)
    assert calibrations(TRUE, 1, 0.1, seed=4) != calibrations(TRUE, 1, 0.1, seed=3)


@pytest.mark.slow
def test_twice_the_corners_errors_scatter_twice_as_much():
    small, large = (
        np.std([camera.fx for camera in calibrations(TRUE, 20, corner_px, seed=1)]) for corner_px in (0.05, 0.1)
    )
    assert large == pytest.approx(2 * small, rel=0.05)  # the same draws, and nearly linear


@pytest.mark.slow
def test_rendered_boards_are_found_and_calibrate_the_camera():
    done = rendered_calibration(TRUE, seed=2)
    assert sum(not view.dropped for view in done.views) >= VIEWS - 2
    assert done.error_px < 0.3
    assert done.camera.fx == pytest.approx(525, rel=0.005)
