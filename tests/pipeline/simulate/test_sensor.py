import msgspec
import numpy as np
import pytest
from dockpose.simulate import Lights, Sensor, render
from dockpose.simulate.parts import Background, Glare

from tests.support.scenes import QUIET, changed


def test_a_bayer_sensor_gives_the_colours_back_where_they_change_slowly():
    light = Background(level=50.0, glares=(Glare(x_px=320.0, y_px=240.0, size_px=100.0, level=100.0),))
    grey = render(changed(background=light, lights=Lights(level=0.0)))[0]
    colour = render(
        changed(
            background=light,
            lights=Lights(level=0.0),
            sensor=Sensor(colour="bayer", read_noise_levels=0.0, electrons_per_level=1e12),
        )
    )[0]
    assert colour.shape == (480, 640, 3)
    assert np.abs(colour[2:-2, 2:-2].astype(int) - grey[2:-2, 2:-2, None]).max() <= 2


@pytest.mark.parametrize(("bits", "kind"), [(8, np.uint8), (10, np.uint16), (12, np.uint16), (16, np.uint16)])
def test_every_depth_saturates_at_its_own_end(bits, kind):
    sensor = msgspec.structs.replace(QUIET, bits=bits)
    image, _ = render(changed(sensor=sensor, lights=Lights(level=5000.0)))
    assert image.dtype == kind
    assert image.max() == (1 << bits) - 1


def test_shot_and_read_noise_have_their_variance():
    sensor = Sensor(read_noise_levels=2.0, electrons_per_level=20.0)
    image, _ = render(changed(sensor=sensor, background=Background(level=100.0), lights=Lights(level=0.0)))
    # Shot noise 100 / 20, read noise 2^2, rounding 1/12; the variance of 307200 pixels is known to 0.3 %.
    assert image.astype(float).var() == pytest.approx(5 + 4 + 1 / 12, rel=0.01)


def test_exposure_vignetting_gain_and_jpeg_do_what_they_say():
    light = {"background": Background(level=40.0), "lights": Lights(level=0.0)}

    def level(**values):
        return render(changed(sensor=msgspec.structs.replace(QUIET, **values), **light))[0]

    assert level(exposure=2.0).mean() == pytest.approx(80)
    assert level(gain=3.0).mean() == pytest.approx(120)
    corner = level(vignetting=0.5)
    assert corner[0, 0] == pytest.approx(20, abs=1)
    assert corner[240, 320] == 40
    assert level(jpeg_quality=50).mean() == pytest.approx(40, abs=1)


def test_motion_blur_draws_a_streak_of_its_length():
    sensor = msgspec.structs.replace(QUIET, motion_blur_px=20.0, motion_angle_deg=90.0)
    image, truth = render(changed(sensor=sensor, lights=Lights(level=800.0, radius_m=0.001)))
    x, y = np.rint(truth.lights_px[0]).astype(int)
    column = image[y - 30 : y + 31, x].astype(float)
    assert np.count_nonzero(column > column.max() / 2) == pytest.approx(20, abs=2)
    assert np.count_nonzero(image[y, x - 30 : x + 31] > column.max() / 2) < 6
