import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.fitting import LENSES, CalibrationError, climb, fit, fit_port, sigmas_of
from dockpose.camera.port import FlatPort
from msgspec.structs import replace

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


@pytest.mark.slow
def test_standard_errors_are_the_scatter_of_repeated_calibrations(repeated):
    off, sigma = repeated
    scatter = np.sqrt(np.mean((off / sigma) ** 2, axis=0))
    # The root mean square of 25 standard normal numbers lies within 0.65 and 1.4 with a probability of 99.5 %.
    assert (scatter > 0.65).all()
    assert (scatter < 1.45).all()


def test_boards_that_are_all_square_on_do_not_tell_the_focal_length():
    seen = sightings(TRUE, 0, tilt_rad=0.0, ranges_m=(0.4, 0.41))
    with pytest.raises(CalibrationError, match="no focal length"):
        fit(seen, SIZE, LENSES["none"])
    fitted = fit(seen, SIZE, LENSES["k2"])
    assert sigmas_of(fitted, seen).values["fx"] > fitted.camera.fx


@pytest.mark.slow
@pytest.mark.parametrize(
    ("camera", "name"),
    [
        (Camera(520, 515, 322, 236, *SIZE), "none"),
        (Camera(520, 515, 322, 236, *SIZE, (-0.18, 0.05, 0, 0)), "k2"),
        (Camera(520, 515, 322, 236, *SIZE, (-0.18, 0.05, 0.003, -0.002)), "tangential"),
        (Camera(400, 400, 322, 236, *SIZE, (-0.3, 0.15, 0.001, -0.001, -0.05)), "k3"),
        (Camera(300, 300, 322, 236, *SIZE, (-0.02, 0.01, -0.004, 0.001), fisheye=True), "fisheye"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_the_lens_that_took_the_pictures_is_chosen(camera, name):
    lens, rungs = climb(sightings(camera, 0, count=8 if camera.fisheye else 12), SIZE)
    assert lens.name == name
    # With 0.1 px on each of two coordinates the right lens meets pictures it has not seen to 0.14 px.
    assert next(rung for rung in rungs if rung.lens == lens).held_out_px == pytest.approx(0.14, abs=0.015)


def test_few_pictures_leave_k3_and_the_tangential_terms_alone():
    for count, name in ((3, "k1"), (5, "k2")):
        lens, rungs = climb(sightings(Camera(520, 515, 322, 236, *SIZE), 0, count=count), SIZE)
        assert (lens.name, rungs) == (name, ())


def test_boards_that_lie_alike_count_once():
    few = sightings(Camera(520, 515, 322, 236, *SIZE), 0, count=5)
    assert climb(few * 4, SIZE) == climb(few, SIZE)


def test_numbers_that_no_camera_has_are_no_camera(monkeypatch):
    """As OpenCV finds them of boards that are all square on."""
    boards = sightings(Camera(520, 515, 322, 236, *SIZE), 0, count=3)
    found = (0.1, np.eye(3) * 500, np.array([0, 7306768.0, 0, 0, 0]), *2 * [[np.zeros(3)] * 3])
    monkeypatch.setattr("cv2.calibrateCamera", lambda *_, **__: found)
    with pytest.raises(CalibrationError, match="tilt the board"):
        fit(boards, SIZE, LENSES["k2"])


@pytest.mark.slow
@pytest.mark.parametrize("gap_m", [0.01, 0.05])
def test_the_air_gap_is_found_within_its_error(gap_m):
    true = replace(TRUE, port=FlatPort(gap_m, 0.010))
    found = fit_port(sightings(true, 0, count=6), TRUE)
    port, sigma = found.camera.port, found.sigmas.values["air_gap_m"]
    assert abs(port.air_gap_m - gap_m) < 3 * sigma
    assert sigma < 1e-3
    assert found.camera.sigma.air_gap_m == pytest.approx(sigma)  # which goes into its file
    # With 0.1 px on each of two coordinates.
    assert found.errors_px.mean() == pytest.approx(0.14, abs=0.02)


@pytest.mark.slow
def test_glass_cannot_be_told_from_the_gap_and_is_left_as_given():
    true = replace(TRUE, port=FlatPort(0.03, 0.010))
    found = fit_port(sightings(true, 1, count=6), replace(TRUE, port=FlatPort(0.02, 0.004)))
    assert "glass_m" not in found.sigmas.values
    assert found.camera.port.glass_m == 0.004
    # On the axis glass acts as a gap of the opposite sign, (1 - n_w / n_g) / (n_w - 1) of its thickness: 0.36.
    assert 0 < found.gap_per_glass < 0.36
    gap_m = 0.03 + found.gap_per_glass * (0.004 - 0.010)
    assert found.camera.port.air_gap_m == pytest.approx(gap_m, abs=3 * found.sigmas.values["air_gap_m"])


def test_far_boards_do_not_tell_the_gap():
    far = replace(TRUE, fx=3000.0, fy=3000.0)
    with pytest.raises(CalibrationError, match="cannot determine the port's air gap"):
        fit_port(sightings(replace(far, port=FlatPort(0.03, 0.01)), 0, count=3, ranges_m=(4, 5)), far)


@pytest.mark.slow
def test_pictures_in_air_have_no_port():
    with pytest.raises(CalibrationError, match=r"no flat port explains|cannot determine"):
        fit_port(sightings(TRUE, 0, count=3), replace(TRUE, fx=700.0, distortion=()))


def test_too_few_boards_are_refused():
    with pytest.raises(CalibrationError, match="2 boards do not determine a port"):
        fit_port(sightings(TRUE, 0, count=2), TRUE)
