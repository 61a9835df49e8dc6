import numpy as np
import pytest
from dockpose import Camera
from dockpose.camera.fitting import LENSES, CalibrationError, fit
from dockpose.camera.ladder import climb

from tests.support.boards import SIZE, sightings


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
