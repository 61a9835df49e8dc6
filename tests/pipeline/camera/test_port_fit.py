import pytest
from dockpose.camera.fitting import CalibrationError, fit_port
from dockpose.camera.port import FlatPort
from msgspec.structs import replace

from tests.support.boards import TRUE, sightings


@pytest.mark.slow
@pytest.mark.parametrize("gap_m", [0.01, 0.05])
def test_the_air_gap_is_found_within_its_error(gap_m):
    true = replace(TRUE, port=FlatPort(gap_m, 0.010))
    found = fit_port(sightings(true, 0, count=6), TRUE)
    port, sigma = found.camera.port, found.sigmas.values["air_gap_m"]
    assert port is not None
    assert abs(port.air_gap_m - gap_m) < 3 * sigma
    assert sigma < 1e-3
    assert found.camera.sigma is not None
    assert found.camera.sigma.air_gap_m == pytest.approx(sigma)  # which goes into its file
    # With 0.1 px on each of two coordinates.
    assert found.errors_px.mean() == pytest.approx(0.14, abs=0.02)


@pytest.mark.slow
def test_glass_cannot_be_told_from_the_gap_and_is_left_as_given():
    true = replace(TRUE, port=FlatPort(0.03, 0.010))
    found = fit_port(sightings(true, 1, count=6), replace(TRUE, port=FlatPort(0.02, 0.004)))
    assert not found.glass_is_told
    assert found.camera.port is not None
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
