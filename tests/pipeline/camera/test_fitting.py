import cv2
import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.fitting import LENSES, CalibrationError, fit, sigmas_of

from tests.support.boards import SIZE, TRUE, sightings


@pytest.fixture(scope="module")
def repeated():
    """Deviations from the truth and standard errors of 25 calibrations of the same camera."""
    off, sigma = [], []
    for seed in range(25):
        seen = sightings(TRUE, seed)
        fitted = fit(seen, SIZE, LENSES["k2"])
        camera = fitted.camera
        found = np.array([camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion[:2]])
        off.append(found - [TRUE.fx, TRUE.fy, TRUE.cx, TRUE.cy, *TRUE.distortion[:2]])
        sigma.append(list(sigmas_of(fitted, seen).values.values()))
    return np.array(off), np.array(sigma)


def test_standard_errors_are_the_scatter_of_repeated_calibrations(repeated):
    off, sigma = repeated
    scatter = np.sqrt(np.mean((off / sigma) ** 2, axis=0))
    # The root mean square of 25 standard normal numbers lies within 0.65 and 1.4 with a probability of 99.5 %.
    assert (scatter > 0.65).all()
    assert (scatter < 1.45).all()


def test_the_true_camera_is_within_its_errors(repeated):
    off, sigma = repeated
    assert np.abs(off / sigma).max() < 4  # of 150 numbers


def test_standard_errors_agree_with_opencvs():
    seen = sightings(TRUE, 1, count=30)
    fitted = fit(seen, SIZE, LENSES["k3"])
    boards, pictures = [each.board_m for each in seen], [each.picture_px for each in seen]
    deviations = cv2.calibrateCameraExtended(boards, pictures, SIZE, np.eye(3), np.zeros(5))[5].ravel()
    ours = np.array(list(sigmas_of(fitted, seen).values.values()))
    # Ours are never smaller, and larger where the scatter over pictures is.
    assert (ours > 0.999 * deviations[:9]).all()
    assert np.median(ours / deviations[:9]) < 1.3


def test_a_fisheye_is_found_from_a_perspective_start():
    true = Camera(300, 300, 322, 236, *SIZE, (-0.02, 0.01, -0.004, 0.001), fisheye=True)
    for seed in range(2):
        seen = sightings(true, seed, count=15)
        fitted = fit(seen, SIZE, LENSES["fisheye"])
        sigma = sigmas_of(fitted, seen)
        assert sigma.noise_px == pytest.approx(0.1, rel=0.1)
        assert abs(fitted.camera.fx - true.fx) < 4 * sigma.values["fx"]


def test_boards_that_are_all_square_on_do_not_tell_the_focal_length():
    seen = sightings(TRUE, 0, tilt_rad=0.0, ranges_m=(0.4, 0.41))
    with pytest.raises(CalibrationError, match="no focal length"):
        fit(seen, SIZE, LENSES["none"])
    fitted = fit(seen, SIZE, LENSES["k2"])
    assert sigmas_of(fitted, seen).values["fx"] > fitted.camera.fx
